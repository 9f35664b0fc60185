"""The run of Algorithm 1 as one page: a single HTML file that needs nothing but a browser."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from markupsafe import Markup

from twbal.errors import DataError
from twbal.evaluation import SuccessRule
from twbal.files import write_atomically
from twbal.report.page import inline, percent, render
from twbal.summary import Iteration, Summary


@dataclass(frozen=True)
class Setting:
    """What a reader must know of how the run was set up.

    Attributes:
        virtual: whether the robot behind the link was the virtual one, not hardware.
        rule: what made a trial a success.
        control_period: [s].
        method: by which the policies came about, as of conf/method/.
        facts: further names and values, in order: state, cost widths, link and the like.
    """

    virtual: bool
    rule: SuccessRule
    control_period: float
    method: str
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


class Method(NamedTuple):
    """What a report says of a method.

    Attributes:
        first: where policy 0 comes from.
        story: what was done, a sentence for each step; empty for Algorithm 1, which the page tells itself.
    """

    first: str
    story: Sequence[str] = ()


OWN = Method("from the simulation alone")
METHODS: Mapping[str, Method] = {
    "lqr": Method(
        "of the data sheet",
        ("The linear-quadratic regulator of the linearised data sheet drives the robot; nothing is learned.",),
    ),
    "lqr_identified": Method(
        "of the data sheet",
        (
            "The linear-quadratic regulator of the linearised data sheet drives the robot first.",
            "A linear state-space model is fitted to all that the robot did, and its regulator drives next.",
        ),
    ),
    "pilco": Method(
        "from rollouts at random",
        (
            "No simulation. Random torques drive the robot, and a Gaussian process learns its whole dynamics.",
            "A policy is searched on it and drives the robot; then all is learned and searched again.",
        ),
    ),
    "agent": Method(
        "of a model-free agent trained in simulation",
        ("A model-free agent was trained in the simulation; nothing is learned on the robot.",),
    ),
}
"""Methods whose story is another than that of Algorithm 1."""


def write_report(path: Path, summary: Summary, setting: Setting, pictures: Pictures, commands: str) -> None:
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
        headline=headline(summary, setting.method),
        method=METHODS.get(setting.method, OWN),
        tilt=_optional_inline(pictures.tilt, "tilt", "Tilt of the robot in its trials, before and after learning"),
        predictions=[
            (i, inline(svg, f"iteration-{i.index}", f"Predicted and real states, iteration {i.index}"), _caption(i))
            for i, svg in zip(summary.iterations, pictures.predictions, strict=True)
            if svg is not None
        ],
        learning=inline(pictures.learning, "learning", "Successes, cost and coverage of each iteration"),
        drift=_optional_inline(pictures.drift, "drift", "Position of the robot in its trials"),
        cost=inline(pictures.cost, "cost", "Cost of a state"),
    )
    write_atomically(path, html)


def headline(summary: Summary, method: str) -> str:
    """What the run achieved, in one or two sentences."""
    first, best, updates = summary.iterations[0], summary.best, len(summary.iterations) - 1
    if not first.trials or not best.trials:
        return (
            f"{_count(updates, 'update')} of the policy; no trial was driven, so nothing is known of how it balances."
        )
    begin = METHODS.get(method, OWN).first
    start = f"The policy {begin} balances the robot in {first.successes} of {first.trials} trials."
    if best.index == 0:
        return f"{start} {_count(updates, 'update')} brought nothing better." if updates else start
    return (
        f"{start} After {_count(best.index, 'update')}, learned from {best.real_seconds:.1f} s of driving the robot, "
        f"it is {best.successes} of {best.trials}."
    )


def _caption(iteration: Iteration) -> str:
    """What to see in the prediction picture of one iteration."""
    learned = "f alone"
    if iteration.index:
        learned = (
            f"f + g, with g from {_count(iteration.real_episodes, 'rollout')} on the robot "
            f"({iteration.real_samples} samples, {iteration.real_seconds:.1f} s)"
        )
    text = f"Predicted by {learned}."
    if iteration.coverage95 is not None:
        text += f" The 95 % band holds {percent(iteration.coverage95)} of the real states."
    if iteration.trials:
        text += f" The robot balanced in {iteration.successes} of {iteration.trials} trials."
    return f"{text} {iteration.note}".rstrip()


def _optional_inline(svg: str | None, name: str, label: str) -> Markup | None:
    return None if svg is None else inline(svg, name, label)


def _count(number: int, thing: str) -> str:
    return f"{number} {thing}" if number == 1 else f"{number} {thing}s"
