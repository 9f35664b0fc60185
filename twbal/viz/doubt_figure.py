"""What makes an import doubt a log: two curves that should be one, over time and against each other."""

import textwrap

import numpy as np
from matplotlib.figure import Figure

from twbal.core.gaussian import Array
from twbal.core.palette import MUTED, PREDICTED, REAL
from twbal.io.importers.checks.doubt import Curves
from twbal.viz.canvas import legend, panels, styled

_SHOWN = 6.0  # s; of a longer log, those in which most happens
_MOST_POINTS = 2000
_UPRIGHT = 30  # characters of a line beside a panel
_WIDTH = 44  # characters of a line of the title for each panel


@styled
def doubt_figure(sentence: str, evidence: Curves) -> Figure:
    """Draw the evidence of a doubt under its sentence.

    Args:
        sentence: of the doubt.
        evidence: what the log says, and what it should say where that is known.
    """
    alone = evidence.expected is None or bool(np.isnan(evidence.expected).any())
    name = f"expected: {evidence.expected_name}"
    figure, axes = panels(1 if alone else 2, columns=2, width=5.4, height=3.2)
    shown = _busiest(evidence)
    time = evidence.period * np.arange(len(evidence.found))[shown]
    axes[0].plot(time, evidence.found[shown], color=REAL.light, linewidth=1.2, label=f"found: {evidence.found_name}")
    axes[0].set_xlabel("time [s]" if evidence.period != 1.0 else "row")
    if evidence.expected is not None:
        axes[0].plot(time, evidence.expected[shown], color=PREDICTED.light, linewidth=1.2, linestyle="--", label=name)
    if evidence.expected is not None and not alone:
        every = max(1, len(evidence.found) // _MOST_POINTS)
        x, y = evidence.expected[::every], evidence.found[::every]
        axes[1].plot(x, y, ".", color=REAL.light, markersize=2.5)
        ends = np.array([x.min(), x.max()])
        axes[1].plot(ends, ends, color=MUTED.light, linewidth=1.0)
        axes[1].set_xlabel(name)
        axes[1].set_ylabel("found")
        axes[1].set_title("grey: as expected", color=MUTED.light)
    figure.suptitle("\n".join(textwrap.wrap(sentence, _WIDTH * len(axes))))
    axes[0].set_ylabel(textwrap.fill(evidence.found_name, _UPRIGHT))
    if evidence.expected is not None:
        legend(figure, axes[0])
    return figure


def _busiest(evidence: Curves) -> slice:
    """The stretch of the log in which the curve moves most."""
    count = round(_SHOWN / evidence.period) if evidence.period != 1.0 else _MOST_POINTS
    values: Array = evidence.found if evidence.expected is None else evidence.expected
    if len(values) <= count or np.isnan(values).any():
        return slice(None)
    sums = np.concatenate([[0.0], np.cumsum((values - values.mean()) ** 2)])
    begin = int(np.argmax(sums[count:] - sums[:-count]))
    return slice(begin, begin + count)
