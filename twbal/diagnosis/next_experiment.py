"""Which experiment to do next: the safe one after which the true set of effects is expected to be likeliest."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array
from twbal.core.robot_parameters import RobotParameters
from twbal.diagnosis.experiments import SECONDS, Experiment, experiments_of, simulate
from twbal.diagnosis.follow_up import NextExperiment
from twbal.diagnosis.model_comparison import ModelComparison
from twbal.diagnosis.separation import Prior, divergences, expected_probability, expected_separation, prior_of
from twbal.sysid.model import Model, Offsets, offsets_of
from twbal.sysid.prediction_error_fit import Fit
from twbal.sysid.recording import Recording

_SEEDS = (0, 1)  # of noise and disturbance, with all of which an experiment must be safe
_OFFERED = (1, 3)  # sizes of the disturbance below the largest that is safe: 1.4 times as much would be safe, and half


class _Expected(NamedTuple):
    """What an episode is expected to bring.

    Attributes:
        probability: of the true set afterwards, on average.
        separation: mean log likelihood ratio of the true set over another one, over the temperature [nats].
    """

    probability: float
    separation: float


def next_experiment(
    comparison: ModelComparison, robot: RobotParameters, progress: Callable[[str], None] = lambda line: None
) -> NextExperiment | None:
    """The experiment after which the true one of the rivals is expected to be likeliest; None where none is safe.

    Args:
        comparison: what the data leave open.
        robot: data sheet.
        progress: is told what is being done.
    """
    progress(f"comparing experiments by simulations of {len(comparison.rivals)} sets of effects")
    fits = [*(rival.fit for rival in comparison.rivals), comparison.base]
    priors = [prior_of(comparison.data, fit) for fit in fits]
    found: list[tuple[_Expected, Experiment]] = []
    candidates = experiments_of(robot)
    for sizes in candidates:
        for experiment, path in _safe(sizes, comparison, robot):
            found.append((_expected(comparison, _of_episode(comparison, fits, priors, path)), experiment))
    if not found:
        return None
    expected, best = max(found, key=lambda each: each[0])
    return NextExperiment(
        settings=best.settings(comparison.data.period),
        seconds=SECONDS,
        separation=expected.separation,
        repetition=_expected(comparison, _of_repetition(comparison, fits, priors)).separation,
        rivals=tuple(rival.names for rival in comparison.rivals),
        refused=sum(map(len, candidates)) - len(found),
    )


def _safe(
    sizes: Sequence[Experiment], comparison: ModelComparison, robot: RobotParameters
) -> Iterator[tuple[Experiment, Recording]]:
    """Of experiments of growing size, those that are offered, each with what the likeliest rival makes of it."""
    safe: list[tuple[Experiment, Recording]] = []
    for experiment in sizes:
        driven = [
            simulate(experiment, robot, rival.fit.model, comparison.data, seed)
            for seed in _SEEDS
            for rival in comparison.rivals
        ]
        if not all(each.is_safe for each in driven):
            break
        path = driven[0].recording
        assert path is not None
        safe.append((experiment, path))
    if len(sizes) == 1:
        yield from safe
    else:
        yield from (safe[-1 - below] for below in _OFFERED if below < len(safe))


def _expected(comparison: ModelComparison, found: Array) -> _Expected:
    """Of divergences between the rivals and, last, the data sheet refitted."""
    between, probabilities = found[:-1, :-1], comparison.probabilities
    temperature = comparison.tempering.after(2.0 * float(found[0, -1]))
    return _Expected(
        expected_probability(between, probabilities, temperature),
        expected_separation(between, probabilities) / temperature,
    )


def _of_episode(
    comparison: ModelComparison, fits: Sequence[Fit], priors: Sequence[Prior], recording: Recording
) -> Array:
    """Divergences over a simulated episode, which has offsets of its own where it may have some."""
    offsets = (Offsets(),) if fits[0].model.offsets else ()
    data = replace(comparison.data, recordings=[recording])
    models = [fit.model._replace(offsets=offsets, balanced=0) for fit in fits]
    return divergences(data, models, [with_offsets(prior, comparison, len(offsets)) for prior in priors])


def _of_repetition(comparison: ModelComparison, fits: Sequence[Fit], priors: Sequence[Prior]) -> Array:
    """Divergences over an episode like those that there are, by what the models predict of these."""
    models: list[Model] = [fit.model for fit in fits]
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
