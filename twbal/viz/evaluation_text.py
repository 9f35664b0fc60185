"""How well simulations predict logs, in tables of words, in sentences and as a page."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from twbal.core.files import write_atomically
from twbal.core.text import counted
from twbal.diagnosis.evaluation_record import (
    ALL_LOGS,
    CHANNEL_UNITS,
    EvaluatedSimulation,
    Interval,
    PredictionScore,
    SimulationEvaluation,
)
from twbal.viz.page import inline, render

OWN = "*"
"""Marks the score of a simulation on a log that it was found on."""
_SMALL = 0.1  # ratio of errors, below which two decimals tell little
_FLOOR = "sensor noise alone"


def found_on_tested_on(evaluation: SimulationEvaluation, channel: str, horizon: float) -> list[list[str]]:
    """Rows of words: a head with the logs, a row for each simulation, and the least noise floor of them.

    A cell is the error with its interval, and its ratio to that of the reference.
    """
    rows = [["simulation", "found on", *evaluation.columns]]
    for simulation in evaluation.simulations:
        scores = [evaluation.score(simulation.name, log, channel, horizon) for log in evaluation.columns]
        cells = ["-" if score is None else _cell(score, score.simulation != evaluation.reference) for score in scores]
        rows.append([simulation.name, ", ".join(simulation.found_on) or "-", *cells])
    return [*rows, [_FLOOR, "", *(_floor(evaluation, log, channel, horizon) for log in evaluation.columns)]]


def title(channel: str, horizon: float) -> str:
    """What a table shows."""
    return f"error of {channel.replace('_', ' ')} after {horizon:g} s [{CHANNEL_UNITS[channel]}]"


def judgements(evaluation: SimulationEvaluation) -> list[str]:
    """Notes, and a sentence for each simulation beside the reference, on the channel that stands for all."""
    channel, horizon = headline_channel(evaluation), evaluation.headline_horizon
    notes = [f"{simulation.note}." for simulation in evaluation.simulations if simulation.note]
    return notes + [
        _judgement(evaluation, simulation, channel, horizon)
        for simulation in evaluation.simulations
        if simulation.name != evaluation.reference
    ]


def headline_channel(evaluation: SimulationEvaluation) -> str:
    """The tilt; the wheels' angle where no log has a tilt."""
    return next(name for name in ("tilt", "wheel_angle", *evaluation.channels) if name in evaluation.channels)


def angle_channels(evaluation: SimulationEvaluation) -> list[str]:
    """Angles that all logs have; where there is none, all channels."""
    return [name for name in evaluation.channels if name in ("tilt", "wheel_angle")] or list(evaluation.channels)


def ratio_words(score: PredictionScore) -> str:
    """How many times the error of the reference a score is, with its interval."""
    if score.ratio is None:
        return "-"
    form = _ratio_form(score.ratio)
    return f"× {score.ratio:{form}}{_interval(score.ratio95, form)}"


def error_words(score: PredictionScore) -> str:
    """The error of a score with its interval, or how many predictions diverge."""
    if score.error is None:
        return f"diverges ({score.diverged} of {score.starts})"
    return f"{score.error:.3g}{_interval(score.error95, '.3g')}"


def closed_words(score: PredictionScore) -> str:
    """The share of the gap that a score closes, with its interval; negative where it opens it further."""
    if score.closed is None:
        return "-"
    interval = None if score.closed95 is None else Interval(100 * score.closed95.low95, 100 * score.closed95.high95)
    return f"{100 * score.closed:.0f} %{_interval(interval, '.0f')}"


def write_evaluation_report(path: Path, evaluation: SimulationEvaluation, picture: str) -> None:
    """Write the report; the same arguments give the same bytes.

    Args:
        path: of the page.
        evaluation: of simulations.
        picture: `evaluation_figure` as SVG text.

    Raises:
        DataError: the file cannot be written.
    """
    horizon = evaluation.headline_horizon
    shown = [score for score in evaluation.scores if score.log == pool(evaluation)]
    html = render(
        "evaluation.html.jinja",
        evaluation=evaluation,
        judgements=judgements(evaluation),
        tables=[(title(c, horizon), found_on_tested_on(evaluation, c, horizon)) for c in angle_channels(evaluation)],
        details=[(c, [score for score in shown if score.channel == c]) for c in evaluation.channels],
        words={"error": error_words, "ratio": ratio_words, "closed": closed_words},
        units=CHANNEL_UNITS,
        pool=pool_words(evaluation),
        picture=inline(picture, "evaluation", "Errors of the simulations over the horizon of their predictions"),
    )
    write_atomically(path, html)


def _interval(interval: Interval | None, form: str) -> str:
    return "" if interval is None else f" ({interval.low95:{form}} to {interval.high95:{form}})"


def _ratio_form(ratio: float) -> str:
    """Two decimals, or two digits of what they would show as nothing."""
    return ".2f" if ratio >= _SMALL else ".2g"


def _cell(score: PredictionScore, is_compared: bool) -> str:
    ratio = f" × {score.ratio:{_ratio_form(score.ratio)}}" if is_compared and score.ratio is not None else ""
    return f"{error_words(score)}{ratio}{OWN if score.is_own_data else ''}"


def _floor(evaluation: SimulationEvaluation, log: str, channel: str, horizon: float) -> str:
    scores = [evaluation.score(simulation.name, log, channel, horizon) for simulation in evaluation.simulations]
    floors = [score.noise_floor for score in scores if score is not None and score.noise_floor is not None]
    return f"{min(floors):.3g}" if floors else "-"


def _judgement(evaluation: SimulationEvaluation, simulation: EvaluatedSimulation, channel: str, horizon: float) -> str:
    """On how many logs that it was not found on a simulation predicts better and worse, with the worst of them."""
    scores = [evaluation.score(simulation.name, log.name, channel, horizon) for log in evaluation.logs]
    known = [score for score in scores if score is not None]
    judged = [score for score in known if not score.is_own_data] or known
    logs = counted(len(judged), "log")
    if simulation.found_on:
        logs += " that it was found on" if judged[0].is_own_data else " that it was not found on"
    worse = [score for score in judged if score.is_worse]
    better = sum(score.is_better for score in judged)
    short = sum(score.ratio95 is None and not score.is_worse and score.ratio is not None for score in judged)
    alike = len(judged) - better - len(worse) - short
    counts = f"better on {better}, worse on {len(worse)}, not told apart on {alike}"
    counts += f", without an interval on {short}, as the recording is too short for one" if short else ""
    what = f"{simulation.name} beside {evaluation.reference}, {title(channel, horizon)}"
    return " ".join([f"{what}: {counts}, of {logs}.", *_warnings(worse)])


def _warnings(worse: Sequence[PredictionScore]) -> Iterator[str]:
    for score in worse:
        if score.diverged:
            yield f"WARNING: on {score.log} {score.diverged} of its {score.starts} predictions diverge."
        else:
            closed = "" if score.closed is None else f", which closes {closed_words(score)} of the gap"
            yield f"WARNING: on {score.log} its error is {ratio_words(score)}{closed}."


def best_simulation(evaluation: SimulationEvaluation) -> EvaluatedSimulation | None:
    """The simulation with the least error on all logs; None where none is better than the reference."""
    channel, horizon, log = headline_channel(evaluation), evaluation.headline_horizon, pool(evaluation)
    errors = {}
    for simulation in evaluation.simulations:
        score = evaluation.score(simulation.name, log, channel, horizon)
        if score is not None and score.error is not None and score.is_better:
            errors[simulation.name] = score.error
    best = min(errors, key=lambda name: errors[name], default=None)
    return next((simulation for simulation in evaluation.simulations if simulation.name == best), None)


def pool(evaluation: SimulationEvaluation) -> str:
    """Name of what stands for all logs."""
    return evaluation.columns[-1]


def pool_words(evaluation: SimulationEvaluation) -> str:
    """The same in a sentence."""
    return ALL_LOGS if len(evaluation.logs) > 1 else f"log {evaluation.logs[0].name}"
