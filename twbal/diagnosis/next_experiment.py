"""Which experiment to do next: the safe one that is expected to separate what the data leave open most."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from twbal.core.gaussian import Array
from twbal.core.robot_parameters import RobotParameters
from twbal.diagnosis.experiments import SECONDS, Experiment, experiments_of, simulate
from twbal.diagnosis.follow_up import NextExperiment
from twbal.diagnosis.model_comparison import ModelComparison
from twbal.diagnosis.separation import Prior, divergences, expected_separation, prior_of
from twbal.sysid.model import Offsets, offsets_of
from twbal.sysid.recording import Recording

_SEED = 0


def next_experiment(
    comparison: ModelComparison, robot: RobotParameters, progress: Callable[[str], None] = lambda line: None
) -> NextExperiment | None:
    """The experiment that is expected to separate the rivals most; None where none is safe for all of them.

    Args:
        comparison: what the data leave open.
        robot: data sheet.
        progress: is told what is being done.
    """
    candidates = experiments_of(robot)
    progress(f"weighing {len(candidates)} experiments by simulations of {len(comparison.rivals)} sets of effects")
    priors = [prior_of(comparison.data, rival.fit) for rival in comparison.rivals]
    found: list[tuple[float, Experiment]] = []
    for experiment in candidates:
        driven = [simulate(experiment, robot, c.fit.model, comparison.data, _SEED) for c in comparison.rivals]
        if all(each.is_safe for each in driven):
            path = driven[0].recording  # of the likeliest
            assert path is not None
            found.append((_separation(comparison, _of_episode(comparison, priors, path)), experiment))
    if not found:
        return None
    separation, best = max(found, key=lambda each: each[0])
    return NextExperiment(
        settings=best.settings(comparison.data.period),
        seconds=SECONDS,
        separation=separation,
        repetition=_separation(comparison, _of_repetition(comparison, priors)),
        rivals=tuple(rival.names for rival in comparison.rivals),
        refused=len(candidates) - len(found),
    )


def _separation(comparison: ModelComparison, divergences: Array) -> float:
    return expected_separation(divergences, comparison.probabilities) / comparison.temperature


def _of_episode(comparison: ModelComparison, priors: Sequence[Prior], recording: Recording) -> Array:
    """(R, R) divergences over a simulated episode, which has offsets of its own where it may have some."""
    models = [rival.fit.model for rival in comparison.rivals]
    offsets = (Offsets(),) if models[0].offsets else ()
    data = replace(comparison.data, recordings=[recording])
    return divergences(
        data,
        [model._replace(offsets=offsets, balanced=0) for model in models],
        [with_offsets(prior, comparison, len(offsets)) for prior in priors],
    )


def _of_repetition(comparison: ModelComparison, priors: Sequence[Prior]) -> Array:
    """(R, R) divergences over an episode like those that there are, by what the rivals predict of these."""
    models = [rival.fit.model for rival in comparison.rivals]
    priors = [with_offsets(prior, comparison, len(models[0].offsets)) for prior in priors]
    seconds = comparison.data.period * sum(len(recording) for recording in comparison.data.recordings)
    return SECONDS / seconds * divergences(comparison.data, models, priors)


def with_offsets(prior: Prior, comparison: ModelComparison, recordings: int) -> Prior:
    """A prior with new offsets of so many recordings."""
    if not recordings:
        return prior
    offsets = offsets_of(comparison.rivals[0].fit.free_parameters, range(recordings))
    size = len(prior.free_parameters)
    H = np.zeros((size + len(offsets),) * 2)
    H[:size, :size] = prior.curvature
    H[size:, size:] = np.diag([1.0 / free.sd**2 for free in offsets])
    return Prior((*prior.free_parameters, *offsets), H)
