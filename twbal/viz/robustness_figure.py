"""What policies survive: shares of successes over the levels of each axis, and their means."""

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from twbal.algorithm.robustness import UPRIGHT, AxisLevels, MethodRobustness, Robustness
from twbal.core.palette import GOOD, INK, MUTED, PREDICTED, REAL
from twbal.viz.canvas import legend, styled

_COLOURS = (
    *(colour.light for colour in (REAL, PREDICTED, GOOD, INK, MUTED)),
    *("#aa4499", "#8a6d00"),  # not of the palette: they are read on light and on dark pages
)
"""Of the methods in turn."""
_FORMS = ("s-", "o-", "d-", "^-", "v-", "P--", "X--", "*--", "<--", ">--")
_COLUMNS = 3
_ASIDE, _APART = 0.12, 0.6  # of the distance of levels: between two methods, and from the first to the last at most
_OVERALL = "overall"


@styled
def robustness_figure(robustness: Robustness) -> Figure:
    """Draw a panel for each axis with a line for each method, and below bars of the means over the levels.

    Lines are moved aside a little, so that points of the same share are told apart. Pale bars are the shares of trials
    that stayed upright. Where there are more methods than colours, the bars of the further ones are hatched.
    """
    rows = -(-len(robustness.axes) // _COLUMNS)
    figure = Figure(figsize=(3.6 * _COLUMNS, 2.6 * rows + 3.4))
    grid = figure.add_gridspec(rows + 1, _COLUMNS, height_ratios=[2.6] * rows + [2.8])
    for number, axis in enumerate(robustness.axes):
        panel = figure.add_subplot(grid[number // _COLUMNS, number % _COLUMNS])
        _draw_levels(panel, axis, robustness.methods)
        if number % _COLUMNS == 0:
            panel.set_ylabel("trials that succeed")
    below = figure.add_subplot(grid[rows, :])
    bars = _draw_means(below, robustness)
    lines = figure.axes[0].get_lines()
    shown = zip(lines, bars, strict=True)
    legend(figure, named=dict(zip((method.name for method in robustness.methods), shown, strict=True)))
    return figure


def _draw_levels(panel: Axes, axis: AxisLevels, methods: tuple[MethodRobustness, ...]) -> None:
    """One line a method, from the robots as they are to the highest level."""
    places = np.arange(len(axis.levels) + 1)
    apart = min(_ASIDE, _APART / max(len(methods) - 1, 1))
    for number, method in enumerate(methods):
        aside = apart * (number - 0.5 * (len(methods) - 1))
        shares = [method.unchanged(), *method.shares(axis.name)]
        colour, form = _style(number)
        panel.plot(places + aside, shares, form, color=colour, markersize=4.5, linewidth=1.3, label=method.name)
    panel.set_xticks(places, ["0", *(f"{level:g}" for level in axis.levels)])
    name = axis.name.replace("_", " ")
    panel.set_xlabel(f"{name} [{axis.unit}]")
    panel.set_title(name)
    panel.set_ylim(-0.06, 1.06)
    panel.yaxis.set_major_formatter(PercentFormatter(1.0))


def _draw_means(panel: Axes, robustness: Robustness) -> list[Artist]:
    """Bars of the means of each axis, and of all; returned is one of each method."""
    names = [*(axis.name for axis in robustness.axes), _OVERALL]
    width, drawn = 0.8 / len(robustness.methods), list[Artist]()
    for number, method in enumerate(robustness.methods):
        places = np.arange(len(names)) + width * (number - 0.5 * (len(robustness.methods) - 1))
        colour, _ = _style(number)
        upright = [*(method.mean(axis.name, UPRIGHT) for axis in robustness.axes), method.overall(UPRIGHT)]
        means = [*(method.mean(axis.name) for axis in robustness.axes), method.overall()]
        hatch = "///" if number >= len(_COLOURS) else None
        panel.bar(places, upright, 0.85 * width, color=colour, alpha=0.22, linewidth=0)
        bars = panel.bar(places, means, 0.85 * width, facecolor=colour, edgecolor="white", linewidth=0, hatch=hatch)
        drawn.append(bars[0])
    panel.axvline(len(names) - 1.5, color=MUTED.light, linewidth=0.8)
    panel.set_xticks(range(len(names)), [name.replace("_", " ") for name in names])
    panel.set_xlim(-0.5, len(names) - 0.5)
    panel.set_ylim(0.0, 1.0)
    panel.yaxis.set_major_formatter(PercentFormatter(1.0))
    panel.set_ylabel("mean over the levels")
    panel.set_title("trials that succeed (pale: that stay upright)")
    panel.grid(visible=False, axis="x")
    return drawn


def _style(number: int) -> tuple[str, str]:
    """Colour and form of a method's line."""
    return _COLOURS[number % len(_COLOURS)], _FORMS[number % len(_FORMS)]
