"""Where the simulation and the measurement disagree: which channel, in which region of the data, how much."""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from twbal.core.gaussian import Array
from twbal.diagnosis.findings import FilterResult, Trajectory
from twbal.diagnosis.record import Region
from twbal.sysid.open_loop import EARLIEST
from twbal.sysid.recording import MEASURED, Recording

_FEWEST = 20  # samples in a region, below which a mean says little


def disagreement(
    best: FilterResult, recordings: Sequence[Recording], bins: int, errors: Sequence[Array] | None = None
) -> tuple[Region, ...]:
    """The map of disagreement of a simulation, the largest first.

    Args:
        best: what the best guess makes of the recordings: its motion, and the noise that regions are measured in.
        recordings: at least one.
        bins: ranges of an axis.
        errors: per recording (T + 1, 4), of the simulation's predictions over one control period from that motion; None
            for those of the best guess itself.
    """
    rows = [np.flatnonzero(recording.usable[EARLIEST + 1 :]) + EARLIEST + 1 for recording in recordings]
    errors = best.errors if errors is None else errors

    def all_of(values: Sequence[Array]) -> Array:
        return np.concatenate([value[row] for value, row in zip(values, rows, strict=True)])

    trajectories: Sequence[Trajectory] = best.trajectories
    axes = {
        "speed": all_of([trajectory.speed for trajectory in trajectories]),
        "command": all_of([np.concatenate([np.zeros(1), recording.commands]) for recording in recordings]),
        "tilt": all_of([trajectory.tilt for trajectory in trajectories]),
        "direction": np.sign(all_of([trajectory.wheel_rate for trajectory in trajectories])),
        "time": all_of(
            [recording.period * np.arange(len(recording) + 1, dtype=np.float64) for recording in recordings]
        ),
    }
    sensed = recordings[0].sensed
    channels = [name for name, is_sensed in zip(MEASURED, sensed, strict=True) if is_sensed]
    return regions(all_of(errors)[:, sensed], best.error_noise[sensed], axes, channels, bins)


def regions(
    errors: Array, noise: Array, axes: Mapping[str, Array], channels: Sequence[str], bins: int
) -> tuple[Region, ...]:
    """The disagreement over ranges of each axis, the largest first.

    Where the simulation is right, and the noise too, errors are as large as their noise: the root mean square is 1.

    Ranges hold about as many samples each; `direction` has two. Ranges with fewer than 20 samples are left out.

    Args:
        errors: (N, E) one-step prediction errors of the simulation, in the channels' units.
        noise: (E,) standard deviations that these errors would have by the sensors' noise alone.
        axes: by name of an axis, (N,) its value at each error; see `Region`.
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
