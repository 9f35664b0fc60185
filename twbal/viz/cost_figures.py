"""What a state costs: the paper's Fig. 2, and the cost of each channel as it is used."""

import math
from collections.abc import Sequence
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from twbal.core.cost import Cost, SaturatingCost
from twbal.core.palette import INK, MUTED, PREDICTED
from twbal.viz.canvas import in_words, label, legend, panels, shown, styled

_REACH = 3.5  # widths on either side of the target that are drawn; beyond, the cost is flat
_AT_WIDTH = 1.0 - math.exp(-0.5)  # cost of a state one width off
_POINTS = 4001  # at which a cost is looked at
_DASHES = ("-", "--", "-.", ":")


@styled
def cost_figure(shapes: Sequence[float], cost: Cost, channels: Sequence[str], units: Sequence[str]) -> Figure:
    """Draw the cost over distance for some shape parameters, and over each channel with the others at their target.

    Args:
        shapes: values of the paper's shape parameter a (eq. 11), for the first panel.
        cost: the one in use; a channel of infinite width costs nothing and has no panel.
        channels: names of the channels.
        units: their units.
    """
    priced = [i for i, width in enumerate(cost.widths) if math.isfinite(width)]
    figure, axes = panels(1 + len(priced), columns=3, width=3.2, height=2.4)
    _draw_shapes(axes[0], shapes)
    for panel, i in zip(axes[1:], priced, strict=True):
        _draw_channel(panel, cost, i, channels[i], units[i])
    for panel in axes:
        panel.set_ylim(0.0, 1.05)
        panel.set_ylabel("cost c(x)")
    legend(figure, *axes[1:])
    return figure


def _draw_shapes(axes: Axes, shapes: Sequence[float]) -> None:
    distance = np.linspace(0.0, _REACH * max(shapes), 300)
    for a, dashes in zip(shapes, cycle(_DASHES), strict=False):
        cost = SaturatingCost(np.zeros(1), np.array([a]))
        axes.plot(distance, cost(distance[:, None]), dashes, color=INK.light, label=f"a = {a:g}", linewidth=1.4)
    axes.set_title("shape parameter (eq. 11)")
    axes.set_xlabel("distance to the target d(x)")
    axes.legend(loc="lower right")


def _draw_channel(axes: Axes, cost: Cost, i: int, name: str, unit: str) -> None:
    """Draw the cost over one channel, and how far off it costs `_AT_WIDTH`.

    That is the channel's width, unless its changes are priced, too: a last command costs more where the one before is
    at its target.
    """
    factor, drawn_unit = shown(unit)
    target = float(cost.target[i])
    width = _half_width(cost, i)
    reach = _REACH * (width or float(cost.widths[i]))
    states = np.tile(cost.target, (301, 1))
    states[:, i] += reach * np.linspace(-1.0, 1.0, 301)
    axes.plot(factor * states[:, i], cost(states), color=PREDICTED.light)
    if width is not None:
        ends = factor * np.array([target - width, target + width])
        mark = f"distance from the target at which a state costs {_AT_WIDTH:.2f}"
        axes.plot(ends, [_AT_WIDTH] * 2, color=MUTED.light, linestyle=":", label=mark)
        note, at = f"± {factor * width:.3g}", (factor * target, _AT_WIDTH)
        axes.annotate(note, at, (0, 4), textcoords="offset points", ha="center")
    axes.set_title(in_words(name))
    axes.set_xlabel(label(name, drawn_unit))


def _half_width(cost: Cost, i: int) -> float | None:
    """Distance from the target at which the cost over a channel is `_AT_WIDTH`; None where it never is."""
    distance = _REACH * float(cost.widths[i]) * np.linspace(0.0, 1.0, _POINTS)
    states = np.tile(cost.target, (_POINTS, 1))
    states[:, i] += distance
    costs = cost(states)
    if costs.max() < _AT_WIDTH:
        return None
    after = int(np.argmax(costs >= _AT_WIDTH))
    return float(np.interp(_AT_WIDTH, costs[after - 1 : after + 1], distance[after - 1 : after + 1]))
