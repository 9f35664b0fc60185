"""How the policies got better, over real data."""

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from twbal.algorithm.summary import Summary
from twbal.algorithm.tables import angle
from twbal.core.palette import GOOD, MUTED, PAPER, PREDICTED, REAL
from twbal.viz.canvas import panels, styled

_MOST_LABELS = 6  # of iterations, side by side in a panel
_ROW = 36  # characters of them that find room there
_SHARES = (-0.04, 1.1)  # axis of a share: points at 0 and 1 are whole


@styled
def learning_curve_figure(summary: Summary) -> Figure:
    """Draw successes, cost and coverage of each iteration over the seconds that the robot was driven for learning.

    Where labels of all iterations would run into each other, some are labelled, and the best.
    """
    figure, (trials, cost, coverage) = panels(3, columns=3, width=3.4, height=2.6)
    names = [f"{i.index}\n{i.real_seconds:.1f} s" for i in summary.iterations]
    labelled = _labelled(summary)
    for panel in (trials, cost, coverage):
        panel.set_xticks(labelled, [names[i] for i in labelled])
        panel.set_xlim(-0.4, len(names) - 0.6)
        panel.set_xlabel("iteration, driving to learn so far")
        panel.grid(visible=False, axis="x")
    _draw_successes(trials, summary, labelled)
    _draw_costs(cost, summary)
    _draw_coverage(coverage, summary, labelled)
    return figure


def _labelled(summary: Summary) -> list[int]:
    """Places of the iterations that find room for a label each, evenly spaced, the best among them."""
    count = len(summary.iterations)
    longest = max(len(f"{i.real_seconds:.1f} s ") for i in summary.iterations)
    every = max(-(-count // _MOST_LABELS), -(-count * longest // _ROW))
    best = next((place for place, i in enumerate(summary.iterations) if i.index == summary.best_iteration), 0)
    return list(range(best % every, count, every))


def _draw_successes(axes: Axes, summary: Summary, labelled: Sequence[int]) -> None:
    counts = [i.successes for i in summary.iterations]
    most = max(1, *(i.trials for i in summary.iterations))
    colours = [GOOD.light if i.first_had == summary.best_iteration else MUTED.light for i in summary.iterations]
    bars = axes.bar(range(len(counts)), counts, width=0.6, color=colours)
    shares = [f"{i.successes}/{i.trials}" for i in summary.iterations]
    axes.bar_label(bars, [share if place in labelled else "" for place, share in enumerate(shares)], padding=2)
    axes.set_ylim(0, 1.15 * most)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_title("trials that succeed")
    axes.set_ylabel("trials")


def _draw_costs(axes: Axes, summary: Summary) -> None:
    predicted = [i.predicted_cost for i in summary.iterations]
    _draw_line(axes, predicted, PREDICTED.light, "o--", "predicted")
    _draw_line(axes, [i.real_cost for i in summary.iterations], REAL.light, "s-", "robot")
    axes.set_ylim(bottom=0)
    axes.set_title("long-term cost")
    axes.set_ylabel("cost, summed")
    if axes.get_legend_handles_labels()[0]:
        axes.legend()


def _draw_coverage(axes: Axes, summary: Summary, labelled: Sequence[int]) -> None:
    axes.axhline(0.95, color=MUTED.light, linestyle=":", linewidth=1.2)
    axes.annotate("0.95 wanted", (0.02, 0.95), (0, 3), xycoords=("axes fraction", "data"), textcoords="offset points")
    _draw_line(axes, [i.coverage95 for i in summary.iterations], PREDICTED.light, "o-", "coverage")
    for i in (summary.iterations[place] for place in labelled):
        if i.coverage95 is not None and i.tilt_band_widest is not None:
            below = i.coverage95 > 0.5  # of the point, so that the text stays within the panel
            width, offset = f"±{angle(i.tilt_band_widest)}", (0, -8 if below else 8)
            at, side = (i.index, i.coverage95), "top" if below else "bottom"
            text = axes.annotate(width, at, offset, textcoords="offset points", fontsize=9, ha="center", va=side)
            text.set_bbox({"facecolor": PAPER.light, "linewidth": 0.0, "pad": 1.0})  # lets no line run through it
    axes.set_ylim(*_SHARES)
    axes.set_yticks([0.0, 0.25, 0.5, 0.75, 1.0])
    axes.set_title("states in the 95 % band")
    axes.set_ylabel("share of states")
    if any(i.coverage95 is not None and i.tilt_band_widest is not None for i in summary.iterations):
        note = "±: widest band of the tilt"
        axes.annotate(note, (0.98, 0.03), xycoords="axes fraction", ha="right", fontsize=9, color=MUTED.light)


def _draw_line(axes: Axes, values: Sequence[float | None], colour: str, form: str, name: str) -> None:
    """Draw what was measured; an iteration without trials leaves no point."""
    known = [(i, value) for i, value in enumerate(values) if value is not None]
    if not known:
        return
    axes.plot([i for i, _ in known], [value for _, value in known], form, color=colour, label=name)
