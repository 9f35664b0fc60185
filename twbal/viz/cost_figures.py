"""What a state costs: the paper's Fig. 2, and the cost of each channel as it is used."""

import math
from collections.abc import Sequence
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from twbal.core.cost import Cost, SaturatingCost
from twbal.core.palette import INK, MUTED, PREDICTED
from twbal.viz.canvas import label, panels, shown, styled

_REACH = 3.5  # widths on either side of the target that are drawn; beyond, the cost is flat
_AT_WIDTH = 1.0 - math.exp(-0.5)  # cost of a state one width off
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
    factor, drawn_unit = shown(unit)
    target, width = float(cost.target[i]), float(cost.widths[i])
    states = np.tile(cost.target, (301, 1))
    states[:, i] += width * np.linspace(-_REACH, _REACH, 301)
    axes.plot(factor * states[:, i], cost(states), color=PREDICTED.light)
    axes.plot(factor * np.array([target - width, target + width]), [_AT_WIDTH] * 2, color=MUTED.light, linestyle=":")
    note = f"± {factor * width:.3g}"
    axes.annotate(note, (factor * target, _AT_WIDTH), (0, 4), textcoords="offset points", ha="center")
    axes.set_title(name.replace("_", " "))
    axes.set_xlabel(label(name, drawn_unit))
