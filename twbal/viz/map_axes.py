"""The axes of the map of disagreement, and their values in words."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array
from twbal.diagnosis.record import Region
from twbal.viz.canvas import shown

DIRECTION = "direction"
"""The axis whose two regions are no ranges of values."""

_SPAN = 1e-2  # share of the whole range that need not be told apart
_MOVED = 0.15  # share of the smallest distance by which rounding may move an edge: 2.5 s are neither 2 nor 3


class MapAxis(NamedTuple):
    """An axis of the map.

    Attributes:
        title: in words.
        unit: in which regions give it; "" for none.
        most_decimals: of its values in the unit in which they are shown; smaller differences mean nothing.
    """

    title: str
    unit: str
    most_decimals: int


AXES = {
    "speed": MapAxis("speed", "m/s", 3),
    "command": MapAxis("command", "N·m", 4),
    "tilt": MapAxis("tilt", "rad", 2),
    DIRECTION: MapAxis("wheels turn", "", 0),
    "time": MapAxis("time", "s", 2),
}


def direction_text(region: Region) -> str:
    """Which way the wheels turn in a region of `direction`."""
    return "back" if region.low < 0.0 else "forth"


def edge_texts(axis: str, edges: Sequence[float]) -> list[str]:
    """Ends of ranges in the unit in which they are shown, all rounded to the same number of decimals.

    Args:
        axis: name of the axis.
        edges: at least two, rising [SI].
    """
    factor, _ = shown(AXES[axis].unit)
    values = factor * np.array(edges)
    decimals = min(_decimals(values), AXES[axis].most_decimals)
    return [f"{value:z.{decimals}f}" for value in values]  # z: no minus before a value that rounds to zero


def range_text(region: Region) -> str:
    """The range of a region with its unit: `speed 0.5 to 1.0 m/s`."""
    if region.axis == DIRECTION:
        return f"wheels that turn {direction_text(region)}"
    low, high = edge_texts(region.axis, (region.low, region.high))
    _, unit = shown(AXES[region.axis].unit)
    return f"{AXES[region.axis].title} {low} to {high}{'' if unit == '°' else ' '}{unit}"


def _decimals(edges: Array) -> int:
    """The fewest decimals that show half the smallest distance of edges, or a small share of their whole range.

    One more where the edges would not be where they are written.
    """
    smallest, span = float(np.diff(edges).min()), float(edges[-1] - edges[0])
    decimals = max(0, int(np.ceil(-np.log10(max(0.5 * smallest, _SPAN * span)))))
    moved = float(np.abs(np.round(edges, decimals) - edges).max())
    return decimals + (moved > max(_MOVED * smallest, _SPAN * span))
