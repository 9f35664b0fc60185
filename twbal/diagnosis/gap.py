"""How far rollouts of a simulation stray from what was measured, over short horizons.

From many instants of a recording the physics engine starts at the motion that a model's filter makes of the data so
far and runs under the recorded commands. Longer rollouts of an unstable robot saturate: by half a second any model is
wrong.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array
from twbal.core.start_pose import InitialState
from twbal.diagnosis.findings import Effects, FilterResult
from twbal.diagnosis.record import Gap
from twbal.diagnosis.rollouts_from_recordings import (
    EXPLODED,
    Replay,
    RolloutInputs,
    Rollouts,
    RolloutStarts,
    replayed_courses,
    rollouts_of,
    start_places,
)
from twbal.sim.replay import ReplayStart
from twbal.sysid.recording import MEASURED, Recording, commands_over

_FLOOR_STARTS = 12  # from which the floor is found


class Models(NamedTuple):
    """The same recordings by three models, and the last of them with values drawn by their standard errors."""

    nominal: FilterResult
    refitted: FilterResult
    named: FilterResult
    drawn: Sequence[Effects] = ()


def measure_gaps(
    models: Models,
    recordings: Sequence[Recording],
    replay: Replay,
    horizons: Sequence[int],
    stretches: RolloutStarts,
    noise: Array,
    radius: float,
) -> tuple[Gap, ...]:
    """The gap of each measured channel over each horizon.

    The floor is what the sensors' noise leaves where the model is right: that of the measurement at the horizon's end,
    and that of the start, carried there by the named model (four rollouts from starts that are off by a little). Where
    the filter of one of the models has diverged, no rollouts begin, of no model.

    Args:
        models: with the trajectories of these recordings.
        recordings: held out from all fitting.
        replay: runs a model in the physics engine.
        horizons: lengths of the rollouts [control periods], at most `stretches.ahead`.
        stretches: where they begin.
        noise: (4,) standard deviations of the sensors, in the order of `MEASURED`.
        radius: of the wheels [m].
    """
    places = start_places(recordings, stretches, models[:3])
    if not places:
        return ()
    given = RolloutInputs(recordings, commands_over(recordings, stretches.parts), places)
    nominal, refitted = (
        rollouts_of(model, given, replay, stretches.ahead) for model in (models.nominal, models.refitted)
    )
    named = refitted
    if models.named is not models.refitted:
        named = rollouts_of(models.named, given, replay, stretches.ahead)
    floor = _floor(models.named, named, replay, given.ahead(stretches.ahead), noise, radius)
    gaps = list[Gap]()
    for i in np.flatnonzero(recordings[0].sensed):
        for steps in horizons:
            before, middle, after = (_rms(each.errors[:, steps, i]) for each in (nominal, refitted, named))
            horizon = steps * recordings[0].period
            better = nominal if before < middle else refitted
            excess = _excess(named.errors[:, steps, i], better.errors[:, steps, i])
            noise_floor = float(floor[steps, i])
            least = min(noise_floor, after)
            gap = Gap(MEASURED[i], horizon, before, middle, after, least, None, noise_floor, excess)
            gaps.append(gap._replace(closed=gap.share(before - after)))
    if not models.drawn or all(gap.is_near_floor(gap.after) for gap in gaps):
        return tuple(gaps)
    by_values = _parameter_floor(models, named, replay, given.ahead(stretches.ahead))
    places_of = [(round(gap.horizon / recordings[0].period), MEASURED.index(gap.channel)) for gap in gaps]
    return tuple(gap._replace(parameter_floor=float(by_values[at])) for gap, at in zip(gaps, places_of, strict=True))


def _excess(errors: Array, others: Array) -> float:
    """Mean square of errors (n,) less that of others from the same starts, in standard errors of the difference.

    0 where they are too few to tell, or all alike; `EXPLODED` where any of these has exploded, and none of the others.
    """
    if np.abs(errors).max() >= EXPLODED > np.abs(others).max():
        return EXPLODED
    differences = errors**2 - others**2
    standard_error = np.std(differences, ddof=1) / np.sqrt(len(differences)) if len(differences) > 1 else 0.0
    return float(np.mean(differences) / standard_error) if standard_error > 0.0 else 0.0


def rollout_error(
    result: FilterResult,
    recordings: Sequence[Recording],
    replay: Replay,
    gap: Gap,
    stretches: RolloutStarts,
) -> float:
    """Root mean square error of rollouts of another model, in the channel and over the horizon of a gap.

    Arguments as of `measure_gaps`; the rollouts begin where its own do, but where the filter of this model has
    diverged: infinite where it has everywhere.
    """
    column, steps = MEASURED.index(gap.channel), round(gap.horizon / recordings[0].period)
    places = start_places(recordings, stretches, [result])
    if not places:
        return math.inf
    given = RolloutInputs(recordings, commands_over(recordings, stretches.parts), places)
    return _rms(rollouts_of(result, given, replay, steps).errors[:, -1, column])


def _floor(
    result: FilterResult, rollouts: Rollouts, replay: Replay, commands: Array, noise: Array, radius: float
) -> Array:
    """What noise alone leaves of each channel after each number of periods, (S + 1, 4).

    Args:
        result: of the model that is taken to be right.
        rollouts: of it.
        replay: runs the model in the physics engine.
        commands: of the rollouts, (n, S, k).
        noise: as of `measure_gaps`.
        radius: as of `measure_gaps`.
    """
    starts, courses = rollouts.starts, rollouts.courses
    some = _some(rollouts)
    held, right, of = commands[some], courses[some], [rollouts.recordings[i] for i in some]
    values, vectors = np.linalg.eigh(result.posterior_covariance)
    variance = np.tile(noise**2, (right.shape[1], 1))
    for value, direction in zip(values, vectors.T, strict=True):
        off = [_moved(starts[i], np.sqrt(max(value, 0.0)) * direction, radius) for i in some]
        squares = (replayed_courses(result, of, replay, off, held) - right) ** 2
        usual = np.isfinite(squares) & (squares < EXPLODED**2)
        variance += np.where(usual, squares, 0.0).sum(axis=0) / np.maximum(usual.sum(axis=0), 1)
    return np.asarray(np.sqrt(variance))


def _parameter_floor(models: Models, rollouts: Rollouts, replay: Replay, commands: Array) -> Array:
    """What the standard errors of the fitted values alone leave of each channel, (S + 1, 4): the median of the draws.

    Args:
        models: of which `drawn` is used.
        rollouts: of `models.named`.
        replay: runs a model in the physics engine.
        commands: of the rollouts, (n, S, k).
    """
    some = _some(rollouts)
    of, starts = [rollouts.recordings[i] for i in some], [rollouts.starts[i] for i in some]
    errors = [
        replayed_courses(replace(models.named, effects=effects), of, replay, starts, commands[some])
        - rollouts.courses[some]
        for effects in models.drawn
    ]
    squares = [np.nan_to_num(np.mean(each**2, axis=0), nan=np.inf, posinf=np.inf) for each in errors]
    found = np.sqrt(np.median(squares, axis=0))
    return np.where(np.isfinite(found), found, 0.0)  # where most draws cannot be simulated, they tell nothing


def _some(rollouts: Rollouts) -> Array:
    """Numbers of the starts from which floors are found."""
    count = len(rollouts.starts)
    return np.linspace(0, count - 1, min(count, _FLOOR_STARTS)).astype(int)


def _moved(start: ReplayStart, by: Array, radius: float) -> ReplayStart:
    """A start that is off in tilt, wheel angle, tilt rate and wheel speed."""
    tilt, wheel, tilt_rate, wheel_speed = by
    at = start.initial
    initial = InitialState(at.tilt + tilt, at.tilt_rate + tilt_rate, at.speed + radius * wheel_speed)
    turned = start.restart._replace(wheel_angle=start.restart.wheel_angle + wheel - tilt)
    return replace(start, initial=initial, restart=turned)


def _rms(errors: Array) -> float:
    return float(np.sqrt(np.mean(errors**2)))
