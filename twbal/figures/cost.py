"""What a state costs: the paper's Fig. 2, and the cost of each channel as it is used."""

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from twbal.figures.canvas import label, panels, shown, styled
from twbal.gaussian import Array
from twbal.palette import INK, MUTED, PREDICTED

_REACH = 3.5  # widths on either side of the target that are drawn; beyond, the cost is flat
_DASHES = ("-", "--", "-.", ":")


@styled
def cost_figure(
    shapes: Sequence[float],
    target: Array,
    widths: Array,
    channels: Sequence[str],
    units: Sequence[str],
) -> Figure:
    """Draw the cost over distance for some shape parameters, and over each channel with the others at their target.

    Args:
        shapes: values of the paper's shape parameter a (eq. 11), for the first panel.
        target: (D,) target state.
        widths: (D,) width of each channel in its unit; infinite where the channel is free of charge.
        channels: names of the channels.
        units: their units.
    """
    priced = [i for i, width in enumerate(widths) if math.isfinite(width)]
    figure, axes = panels(1 + len(priced), columns=3, width=3.2, height=2.4)
    _draw_shapes(axes[0], shapes)
    for panel, i in zip(axes[1:], priced, strict=True):
        _draw_channel(panel, float(target[i]), float(widths[i]), channels[i], units[i])
    for panel in axes:
        panel.set_ylim(0.0, 1.05)
        panel.set_ylabel("cost c(x)")
    return figure


def _draw_shapes(axes: Axes, shapes: Sequence[float]) -> None:
    distance = np.linspace(0.0, 3.0 * max(shapes), 300)
    for i, a in enumerate(shapes):
        axes.plot(
            distance, _cost(distance / a), _DASHES[i % len(_DASHES)], color=INK.light, label=f"a = {a:g}", linewidth=1.4
        )
    axes.set_title("shape parameter (eq. 11)")
    axes.set_xlabel("distance to the target d(x)")
    axes.legend(loc="lower right")


def _draw_channel(axes: Axes, target: float, width: float, name: str, unit: str) -> None:
    factor, drawn_unit = shown(unit)
    steps = np.linspace(-_REACH, _REACH, 301)
    axes.plot(factor * (target + width * steps), _cost(steps), color=PREDICTED.light)
    at_width = float(_cost(np.ones(1))[0])
    axes.plot([factor * (target - width), factor * (target + width)], [at_width] * 2, color=MUTED.light, linestyle=":")
    axes.annotate(
        f"width {factor * width:.3g}", (factor * target, at_width), (0, 4), textcoords="offset points", ha="center"
    )
    axes.set_title(name.replace("_", " "))
    axes.set_xlabel(label(name, drawn_unit))


def _cost(widths_away: Array) -> Array:
    cost: Array = 1.0 - np.exp(-0.5 * widths_away**2)
    return cost
