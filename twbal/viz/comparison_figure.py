"""Groups of runs beside each other: every run a dot, medians as lines."""

from collections.abc import Collection, Mapping, Sequence
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from twbal.algorithm.comparison import METRICS, Run
from twbal.core.gaussian import Array
from twbal.core.palette import INK, LINE, MUTED, PREDICTED, REAL
from twbal.viz.canvas import aslant, legend, panels, styled
from twbal.viz.short_names import short_names

_TITLE = 38  # characters of a line of a panel's title
_ROW = 30  # characters that find room side by side below a panel
_ASLANT = 0.06  # inch; height that a character of theirs takes where they are turned
_ROOM = 0.06  # of an axis, below 0 and above the largest value, so that dots at its ends are whole
_NEVER = (1.12, 1.28)  # where the strip begins that has runs which never got there, and where they stand in it
_TICKS = MaxNLocator(5, steps=[1, 2, 2.5, 5, 10])
_TAKES = {"crps_ratio": "takes three trials or more of a policy"}
"""What it takes to measure a metric, where that is not clear."""


@styled
def comparison_figure(groups: Mapping[str, Sequence[Run]], incomparable: Collection[str] = ()) -> Figure:
    """Draw each metric of each run; runs that never got there stand in a strip above the numbers of the axis.

    Long names of groups are shortened.

    Args:
        groups: runs by the name of their group.
        incomparable: metrics that are left out of all runs, as these were judged by unlike settings.
    """
    names = short_names(groups)
    longest = max(map(len, names.values()))
    is_aslant = (longest + 1) * len(groups) > _ROW
    figure, axes = panels(len(METRICS), columns=3, width=3.6, height=2.7 + _ASLANT * longest * is_aslant)
    jitter = np.random.default_rng(0)
    for panel, (metric, (what, unit, _)) in zip(axes, METRICS.items(), strict=True):
        values = [np.array([run.values[metric] for run in runs]) for runs in groups.values()]
        _draw_metric(panel, [each[~np.isnan(each)] for each in values], "share" in what or metric == "coverage", jitter)
        if all(np.isnan(each).all() for each in values):
            reason = f"measured in none of these runs{f': {_TAKES[metric]}' if metric in _TAKES else ''}"
            reason = "does not compare: the runs have unlike settings" if metric in incomparable else reason
            middle = (0.5, 0.5)
            text = fill(reason, _TITLE - 8)
            panel.annotate(text, middle, xycoords="axes fraction", ha="center", va="center", color=MUTED.light)
            panel.set_yticks([])
        panel.set_xticks(range(len(groups)), [names[group] for group in groups])
        if is_aslant:
            aslant(panel)
        panel.set_xlim(-0.5, len(groups) - 0.5)
        panel.grid(visible=False, axis="x")
        panel.set_title(fill(f"{what} [{unit}]" if unit else what, _TITLE), fontsize=8.5)
    legend(figure, *axes)
    return figure


def _draw_metric(panel: Axes, groups: Sequence[Array], is_share: bool, jitter: np.random.Generator) -> None:
    """Draw one metric, (n,) values a group, of which the infinite ones are of runs that never got there."""
    known = [float(value) for values in groups for value in values if np.isfinite(value)]
    top = 1.0 if is_share else max(known, default=0.0) or 1.0
    has_never = any(np.isinf(values).any() for values in groups)
    begins, never = (top * share for share in _NEVER)
    for place, values in enumerate(groups):
        across = place + 0.12 * jitter.uniform(-1, 1, len(values))
        is_never = np.isinf(values)
        dots = panel.plot(across[~is_never], values[~is_never], "o", color=REAL.light, markersize=4, label="a run")
        dots[0].set(alpha=0.7, zorder=3.0)  # over the median, which may run through all of them
        if is_never.any():
            among = np.full(is_never.sum(), never)
            panel.plot(
                across[is_never], among, "x", color=MUTED.light, markersize=6, label="a run that never got there"
            )
        if len(values):
            middle = float(np.median(values))  # infinite where half of the runs never got there
            middle = never if np.isinf(middle) else middle
            across_all = [place - 0.25, place + 0.25]
            panel.plot(across_all, [middle] * 2, color=PREDICTED.light, linewidth=2.2, label="median of the runs")
    ticks = [float(tick) for tick in _TICKS.tick_values(0.0, top) if 0.0 <= tick <= top] if known else []
    panel.set_yticks(
        [*ticks, never] if has_never else ticks, [*(f"{tick:g}" for tick in ticks), *["never"] * has_never]
    )
    end = 2.0 * never - begins if has_never else (1.0 + _ROOM) * top
    panel.set_ylim(-_ROOM * end, end)
    if has_never:
        panel.axhspan(begins, end, color=LINE.light, alpha=0.5, linewidth=0)
        panel.get_yticklabels()[-1].set_color(INK.light)
