"""Errors of simulations over the horizon of their predictions."""

import numpy as np
from matplotlib.artist import Artist
from matplotlib.figure import Figure

from twbal.core.gaussian import Array
from twbal.core.palette import GOOD, INK, MUTED, PREDICTED, REAL
from twbal.diagnosis.evaluation_record import CHANNEL_UNITS, PredictionScore, SimulationEvaluation
from twbal.viz.canvas import legend, over_horizons, panels, styled

_COLOURS = (REAL, PREDICTED, GOOD, INK, MUTED)  # of the reference, and of the others in turn
_FORMS = ("s-", "o-", "d--", "^-.", "v:", "P--", "X-.", "*:", "<-", ">--")  # twice as many: ten are told apart


@styled
def evaluation_figure(evaluation: SimulationEvaluation, log: str) -> Figure:
    """Draw each simulation's error on a log, with its interval as a band; dotted, what noise alone would make of it.

    Errors are in SI units, as in the tables beside the figure.

    Args:
        evaluation: of simulations.
        log: name of the log, or of the pool of all.
    """
    channels = list(dict.fromkeys(score.channel for score in evaluation.scores if score.log == log))
    figure, drawn = panels(len(channels), columns=2, width=4.6, height=2.9)
    named: dict[str, Artist] = {}
    for panel, channel in zip(drawn, channels, strict=True):
        for number, simulation in enumerate(evaluation.simulations):
            colour, form = _COLOURS[number % len(_COLOURS)].light, _FORMS[number % len(_FORMS)]
            rows = [s for s in evaluation.scores if (s.simulation, s.log, s.channel) == (simulation.name, log, channel)]
            times = [1e3 * score.horizon for score in rows]
            (line,) = panel.plot(times, [_known(s.error) for s in rows], form, color=colour, label=simulation.name)
            named.setdefault(simulation.name, line)
            low, high = _band(rows)
            panel.fill_between(times, low, high, color=colour, alpha=0.18, linewidth=0)
            floor = [_known(score.noise_floor) for score in rows]
            panel.plot(times, floor, ":", color=colour, linewidth=1.1)
        panel.plot([], [], ":", color=INK.light, linewidth=1.1, label="sensor noise alone")
        over_horizons(panel, channel, CHANNEL_UNITS[channel])
    legend(figure, drawn[0], named=named)
    return figure


def _known(value: float | None) -> float:
    """A figure, or a gap in the line."""
    return np.nan if value is None else value


def _band(rows: list[PredictionScore]) -> tuple[Array, Array]:
    """Lower and upper ends of the intervals."""
    low = np.array([np.nan if score.error95 is None else score.error95.low95 for score in rows])
    high = np.array([np.nan if score.error95 is None else score.error95.high95 for score in rows])
    return low, high
