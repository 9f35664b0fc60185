"""Which experiment to do next: the safe one that is expected to separate what the data leave open most."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from twbal.core.gaussian import Array
from twbal.core.robot_parameters import RobotParameters
from twbal.diagnosis.contest import Contest
from twbal.diagnosis.experiments import SECONDS, Experiment, experiments_of, simulate
from twbal.diagnosis.follow_up import NextExperiment
from twbal.diagnosis.separation import Prior, divergences, expected_separation, prior_of
from twbal.sysid.model import TiltOffset
from twbal.sysid.recording import Recording

_SEED = 0


def next_experiment(
    contest: Contest, robot: RobotParameters, progress: Callable[[str], None] = lambda line: None
) -> NextExperiment | None:
    """The experiment that is expected to separate the contenders most; None where none is safe for all of them.

    Args:
        contest: what the data leave open.
        robot: data sheet.
        progress: is told what is being done.
    """
    candidates = experiments_of(robot)
    progress(f"weighing {len(candidates)} experiments by simulations of {len(contest.contenders)} sets of effects")
    priors = [prior_of(contest.data, contender.fit) for contender in contest.contenders]
    found: list[tuple[float, Experiment]] = []
    for experiment in candidates:
        driven = [simulate(experiment, robot, c.fit.model, contest.data, _SEED) for c in contest.contenders]
        if all(each.is_safe for each in driven):
            path = driven[0].recording  # of the likeliest
            assert path is not None
            found.append((_separation(contest, _of_episode(contest, priors, path)), experiment))
    if not found:
        return None
    separation, best = max(found, key=lambda each: each[0])
    return NextExperiment(
        settings=best.settings(contest.data.period),
        seconds=SECONDS,
        separation=separation,
        repetition=_separation(contest, _of_repetition(contest, priors)),
        rivals=tuple(contender.names for contender in contest.contenders),
        refused=len(candidates) - len(found),
    )


def _separation(contest: Contest, divergences: Array) -> float:
    return expected_separation(divergences, contest.probabilities) / contest.temperature


def _of_episode(contest: Contest, priors: Sequence[Prior], recording: Recording) -> Array:
    """(R, R) divergences over a simulated episode, in which the tilt has an offset of its own where it may have one."""
    models = [contender.fit.model for contender in contest.contenders]
    offsets = (0.0,) if models[0].offsets else ()
    data = replace(contest.data, recordings=[recording])
    return divergences(
        data,
        [model._replace(offsets=offsets) for model in models],
        [with_offsets(prior, contest, len(offsets)) for prior in priors],
    )


def _of_repetition(contest: Contest, priors: Sequence[Prior]) -> Array:
    """(R, R) divergences over an episode like those that there are, by what the contenders predict of these."""
    models = [contender.fit.model for contender in contest.contenders]
    priors = [with_offsets(prior, contest, len(models[0].offsets)) for prior in priors]
    seconds = contest.data.period * sum(len(recording) for recording in contest.data.recordings)
    return SECONDS / seconds * divergences(contest.data, models, priors)


def with_offsets(prior: Prior, contest: Contest, recordings: int) -> Prior:
    """A prior with a new constant of the tilt in each of so many recordings."""
    if not recordings:
        return prior
    first = next(free for free in contest.contenders[0].fit.frees if isinstance(free.field, TiltOffset))
    offsets = tuple(first._replace(field=TiltOffset(number)) for number in range(recordings))
    size = len(prior.frees)
    H = np.zeros((size + recordings,) * 2)
    H[:size, :size] = prior.curvature
    H[size:, size:] = np.eye(recordings) / first.sd**2
    return Prior((*prior.frees, *offsets), H)
