"""The run of Algorithm 1 as one page: a single HTML file that needs nothing but a browser."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from twbal.algorithm.iteration import Basis, DiagnosisOutcome, Iteration, Search
from twbal.algorithm.outcome import driving, headline, rule_in_words, warnings_on
from twbal.algorithm.summary import Summary
from twbal.algorithm.tables import crps, policy_and_reason, tilt_band, trials_driven, trials_rows
from twbal.core.errors import DataError
from twbal.core.evaluation import PlaceBy, SuccessCriterion
from twbal.core.files import write_atomically
from twbal.core.text import counted
from twbal.search.predictor import Predictor
from twbal.viz.page import inline, percent, render


@dataclass(frozen=True)
class RunSetup:
    """What a reader must know of how the run was set up.

    Attributes:
        virtual: whether the robot behind the link was the virtual one, not hardware.
        rule: what made a trial a success.
        control_period: [s].
        ensemble: names of the further simulated robots that policy 0 serves.
        facts: further names and values, in order: state, cost widths, link and the like.
    """

    virtual: bool
    rule: SuccessCriterion
    control_period: float
    ensemble: Sequence[str]
    facts: Sequence[tuple[str, str]]


@dataclass(frozen=True)
class Pictures:
    """The figures as SVG text.

    Attributes:
        tilt: trials before and after; None where no trial was driven.
        predictions: one for each iteration; None where nothing was predicted.
        learning: the learning curve.
        drift: how far the robot rolled away; None where no trial was driven.
        cost: what a state costs.
    """

    tilt: str | None
    predictions: Sequence[str | None]
    learning: str
    drift: str | None
    cost: str


def write_report(path: Path, summary: Summary, setting: RunSetup, pictures: Pictures, commands: str) -> None:
    """Write the report; the same arguments give the same bytes.

    Args:
        path: of the HTML file.
        summary: what the run achieved.
        setting: how it was set up.
        pictures: of the run.
        commands: text of `commands.sh`.

    Raises:
        DataError: there is not one prediction picture for each iteration, or the file cannot be written.
    """
    if len(pictures.predictions) != len(summary.iterations):
        raise DataError(
            f"The report needs a prediction picture for each of {len(summary.iterations)} iterations; "
            f"found {len(pictures.predictions)}."
        )
    html = render(
        "run.html.jinja",
        summary=summary,
        setting=setting,
        commands=commands,
        headline=headline(summary),
        driving=driving(summary),
        rule=rule_in_words(setting.rule, setting.control_period),
        verdicts=trials_rows(summary),
        by_pose=any(iteration.place_by is PlaceBy.POSE for iteration in summary.iterations),
        count=summary.count(summary.best_iteration),
        first_count=summary.count(0),
        corrected=any(iteration.diagnosis is DiagnosisOutcome.USED for iteration in summary.iterations),
        steps=what_was_done(summary, setting.ensemble),
        doubts=warnings_on(summary, summary.iterations[-1]),
        driven=[trials_driven(iteration) for iteration in summary.iterations],
        policies=[policy_and_reason(iteration) for iteration in summary.iterations],
        crps=[crps(iteration) for iteration in summary.iterations],
        tilt_bands=[tilt_band(iteration) for iteration in summary.iterations],
        tilt=inline(pictures.tilt, "tilt", "Tilt of the robot in its trials, before and after learning"),
        predictions=[
            (
                i,
                inline(svg, f"iteration-{i.index}", f"Predicted and real states, iteration {i.index}"),
                _caption(i, warnings_on(summary, i)),
            )
            for i, svg in zip(summary.iterations, pictures.predictions, strict=True)
            if svg is not None
        ],
        learning=inline(pictures.learning, "learning", "Successes, cost and coverage of each iteration"),
        drift=inline(pictures.drift, "drift", "Position of the robot in its trials"),
        cost=inline(pictures.cost, "cost", "Cost of a state"),
    )
    write_atomically(path, html)


def what_was_done(summary: Summary, ensemble: Sequence[str]) -> list[str]:
    """A paragraph for each iteration: what drove the robot, what was learned, and what was searched.

    Args:
        summary: of the run.
        ensemble: names of the further simulated robots that policy 0 serves.
    """
    first, *later = summary.iterations
    paragraphs = [_first_policy(first, summary, ensemble)]
    for before, iteration in zip(summary.iterations, later, strict=False):
        rollouts = iteration.real_episodes - before.real_episodes
        seconds = iteration.real_seconds - before.real_seconds
        drove = f"Policy {before.first_had} drove the robot in {counted(rollouts, 'rollout')} ({seconds:.1f} s)."
        paragraphs.append(f"{drove} {_recalibrated(iteration) if iteration.recalibrates else _updated(iteration)}")
    return [f"{text}{_trials(iteration)}" for text, iteration in zip(paragraphs, summary.iterations, strict=True)]


def _first_policy(first: Iteration, summary: Summary, ensemble: Sequence[str]) -> str:
    match first.basis:
        case Basis.SIMULATION:
            robots = "the simulated robot"
            if ensemble:
                robots += f", and of simulated robots that differ from it ({', '.join(ensemble)})"
            learned = "a model f of it" if not ensemble else "a model f of each"
            data = f"{summary.sim.samples} samples of {counted(summary.sim.episodes, 'rollout')} of {robots}"
            found = "Policy 0 was searched on f." if not ensemble else "Policy 0 was searched on all of them at once."
            if first.search is Search.KEPT:
                found = "Policy 0 is one that an earlier search on f found; the last search found nothing better."
            return f"From {data}, Gaussian processes learned {learned}. {found}"
        case Basis.ROBOT:
            return (
                f"Random commands drove the robot in {counted(first.real_episodes, 'rollout')} "
                f"({first.real_seconds:.1f} s). Gaussian processes learned its whole dynamics from them, without a "
                "simulation, and policy 0 was searched on that."
            )
        case Basis.DATA_SHEET:
            return "Policy 0 is the linear-quadratic regulator of the linearised data sheet."
        case Basis.AGENT:
            return "Policy 0 is a model-free agent that was trained in simulation."
    return "Policy 0 was made before the robot was driven by any policy."


def _updated(iteration: Iteration) -> str:
    """What an update did after its rollouts."""
    data = f"all {iteration.real_seconds:.1f} s of rollouts so far"
    diagnosed = {
        DiagnosisOutcome.USED: "What the simulation lacks to explain the rollouts was diagnosed and added to it, and f "
        "was learned again. ",
        DiagnosisOutcome.NOT_USED: "A diagnosis of what the simulation lacks was not used: too much of the error was "
        "left, or the rollouts are likelier under another f, or without one. ",
    }.get(iteration.diagnosis or DiagnosisOutcome.NOT_MADE, "")
    if iteration.basis is Basis.IDENTIFIED:
        return f"A linear model was fitted to {data}; its regulator is policy {iteration.first_had}."
    what = {Basis.CORRECTED: "the difference g between robot and f", Basis.ROBOT: "the whole dynamics"}
    learned = f"Gaussian processes learned {what.get(iteration.basis or Basis.CORRECTED, 'a model')} from {data}."
    model = "f + g" if iteration.basis is Basis.CORRECTED else "that model"
    if iteration.search is Search.KEPT:
        found = f"The search on {model} found nothing better than policy {iteration.first_had}, which was kept."
    else:
        found = f"A search on {model} found policy {iteration.first_had}."
    return f"{diagnosed}{learned} {found}"


def _recalibrated(iteration: Iteration) -> str:
    """What was done for the model of a policy that stays."""
    what = "the whole dynamics" if iteration.basis is Basis.ROBOT else "the difference g between robot and f"
    return (
        f"Gaussian processes learned {what} from all {iteration.real_seconds:.1f} s of rollouts so far. No policy was "
        f"searched: policy {iteration.first_had} stayed as it is, and only its prediction is new."
    )


def _trials(iteration: Iteration) -> str:
    if not iteration.own_trials:
        return ""
    return f" In its trials policy {iteration.first_had} succeeded in {iteration.successes} of {iteration.trials}."


def _scored(iteration: Iteration) -> str:
    """The scores of the predicted bands, as a sentence; empty without them."""
    if iteration.crps is None:
        return ""
    text = f" Its CRPS is {iteration.crps:.2g}"
    if iteration.crps_of_trials is not None:
        text += f", that of the trials' own spread {iteration.crps_of_trials:.2g}"
    if iteration.log_density is not None:
        text += f"; its mean log predictive density is {iteration.log_density:.3g}"
    return f"{text} (in units of the cost's widths)."


def _caption(iteration: Iteration, warnings: Sequence[str]) -> str:
    """What to see in the prediction picture of one iteration."""
    learned = {
        Basis.SIMULATION: "f alone",
        Basis.CORRECTED: "f + g",
        Basis.ROBOT: "a model of the robot's rollouts alone",
    }.get(iteration.basis or Basis.CORRECTED, "the model")
    by_robots = iteration.predicted_by is Predictor.ROBOTS
    text = f"Predicted by {'robots with parameters drawn from what is known' if by_robots else learned}"
    if iteration.real_episodes:
        text += (
            f", learned from {counted(iteration.real_episodes, 'rollout')} on the robot "
            f"({iteration.real_samples} samples, {iteration.real_seconds:.1f} s)"
        )
    text += ". At each time the bands are of the robots that have not fallen yet." if by_robots else "."
    if iteration.coverage95 is not None:
        text += (
            f" The 95 % band holds {percent(iteration.coverage95)} of the real states (of the measured channels, "
            f"not of commands and positions); that of the tilt is {tilt_band(iteration)} wide (median, widest)."
        )
    if iteration.tilt_unknown is not None:
        text += (
            f" Of the tilt's variance {percent(iteration.tilt_unknown)} is due to what is not known of the robot; the "
            "rest varies from rollout to rollout (the inner band)."
        )
    text += _scored(iteration)
    if iteration.trials:
        text += f" {iteration.successes} of {iteration.trials} trials succeeded"
        expected = iteration.success_probability
        text += "." if expected is None else f"; each was expected to with probability {expected:.2f}."
    return " ".join([text, iteration.note, *warnings]).replace("  ", " ").rstrip()
