"""The pictures of a run of Algorithm 1, as its report shows them."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from twbal.algorithm.iteration import Iteration
from twbal.algorithm.iteration_findings import IterationFindings, Measures
from twbal.algorithm.summary import Summary
from twbal.core.channels import Channels
from twbal.core.copies import shared
from twbal.core.episode import Episode
from twbal.core.evaluation import positions
from twbal.core.files import write_atomically
from twbal.core.gaussian import Array
from twbal.viz.canvas import svg
from twbal.viz.cost_figures import cost_figure
from twbal.viz.learning_figure import learning_curve_figure
from twbal.viz.prediction_figures import prediction_figure
from twbal.viz.run_page import Pictures
from twbal.viz.trial_figures import Trials, drift_figure, tilt_figure

SHAPES = (0.25, 0.5, 1.0)  # of the paper's cost; 0.5 is its own


def pictures(
    summary: Summary, found: Sequence[IterationFindings], measures: Measures, control_period: float
) -> Pictures:
    """Draw all of them.

    Args:
        summary: of the run.
        found: what is known of each policy.
        measures: by what it was measured.
        control_period: [s].
    """
    channels, rule = measures.channels, measures.rule
    tried = [each for each in found if each.trials]
    rolled = _grouped(tried, lambda trial: positions(trial, channels.wheel_radius), "\n")
    first_and_best = [each for each in tried if each.iteration.index in (0, summary.best_iteration)]
    tilted = _grouped(first_and_best, lambda trial: trial.tilt, ": ")
    tasks: list[Callable[[], str | None]] = [
        lambda: svg(tilt_figure(tilted, control_period, rule)) if tilted else None,
        lambda: svg(drift_figure(rolled, control_period, rule)) if rolled else None,
        lambda: svg(learning_curve_figure(summary)),
        lambda: svg(cost_figure(SHAPES, measures.cost, channels.names, channels.units)),
        *(partial(_prediction, each, channels, control_period) for each in found),
    ]
    tilt, drift, learning, cost, *predictions = shared(tasks)
    assert learning is not None
    assert cost is not None
    return Pictures(tilt, predictions, learning, drift, cost)


def save(drawn: Pictures, folder: Path) -> list[Path]:
    """Write each picture as an SVG file into `folder`; returns the files."""
    named = {"tilt": drawn.tilt, "learning": drawn.learning, "drift": drawn.drift, "cost": drawn.cost}
    named |= {f"prediction_{i}": picture for i, picture in enumerate(drawn.predictions)}
    files = []
    for name, picture in named.items():
        if picture is not None:
            files.append(folder / f"{name}.svg")
            write_atomically(files[-1], picture)
    return files


def _prediction(found: IterationFindings, channels: Channels, control_period: float) -> str | None:
    if found.prediction is None:
        return None
    courses = [trial.states for trial in found.trials]
    figure = prediction_figure(
        found.prediction.states,
        courses,
        channels.names,
        channels.units,
        control_period,
        _title(found.iteration, ": "),
        found.prediction.unknown,
    )
    return svg(figure)


def _grouped(found: Sequence[IterationFindings], course: Callable[[Episode], Array], between: str) -> list[Trials]:
    return [Trials(_title(each.iteration, between), [course(trial) for trial in each.trials]) for each in found]


def _title(iteration: Iteration, between: str) -> str:
    """Which iteration it is, and how its trials went."""
    which = f"iteration {iteration.index}"
    if iteration.same_policy_as is not None:
        which += f" (policy {iteration.same_policy_as} again)"
    return f"{which}{between}{iteration.successes} of {iteration.trials} succeed" if iteration.trials else which
