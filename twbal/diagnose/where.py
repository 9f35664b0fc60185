"""Where the simulation and the measurement disagree: which channel, in which region of the data, how much."""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from twbal.diagnosis import Region
from twbal.gaussian import Array

AXES = ("speed", "command", "tilt", "direction", "time")
"""What regions are ranges of: axle speed [m/s], command [N·m], tilt [rad], the sign of the wheels' rate relative to the
body (-1 to 0 backwards, 0 to 1 forwards), and time since the episode began [s]."""

_FEWEST = 20  # samples in a region, below which a mean says little


def regions(
    errors: Array, noise: Array, axes: Mapping[str, Array], channels: Sequence[str], bins: int
) -> tuple[Region, ...]:
    """The disagreement over ranges of each axis, the largest first.

    Ranges hold about as many samples each; `direction` has two. Ranges with fewer than 20 samples are left out.

    Args:
        errors: (N, E) one-step prediction errors of the simulation, in the channels' units.
        noise: (E,) standard deviations that these errors would have by the sensors' noise alone.
        axes: by name of an axis, (N,) its value at each error; see `AXES`.
        channels: names of the E channels.
        bins: ranges of an axis.
    """
    scaled = errors / noise  # (N, E)
    found = []
    for axis, values in axes.items():
        edges = _edges(axis, values, bins)
        for low, high in pairwise(edges):
            last = high == edges[-1]
            inside = (values >= low) & ((values <= high) if last else (values < high))
            if inside.sum() < _FEWEST:
                continue
            here = scaled[inside]
            for i, channel in enumerate(channels):
                bias, rms = float(here[:, i].mean()), float(np.sqrt(np.mean(here[:, i] ** 2)))
                found.append(Region(channel, axis, float(low), float(high), int(inside.sum()), bias, rms))
    return tuple(sorted(found, key=lambda region: -region.rms))


def _edges(axis: str, values: Array, bins: int) -> Array:
    """Ends of the ranges of an axis."""
    if axis == "direction":
        return np.array([-1.0, 0.0, 1.0])
    return np.unique(np.quantile(values, np.linspace(0.0, 1.0, bins + 1)))
