"""How far rollouts of a simulation stray from what was measured, over short horizons.

From many instants of a recording the physics engine starts at the motion that a model's filter makes of the data so
far and runs under the recorded commands. Longer rollouts of an unstable robot saturate: by half a second any model is
wrong.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array, Mask
from twbal.core.plant import Observation
from twbal.core.start_pose import InitialState
from twbal.diagnosis.findings import Effects, FilterResult, Trajectory
from twbal.diagnosis.record import Gap
from twbal.planar.robot_distribution import TILT_FILTER
from twbal.sim.replay import ReplayStart
from twbal.sim.restart_state import RestartState
from twbal.sysid.recording import MEASURED, Recording

Replay = Callable[[FilterResult, Sequence[ReplayStart], Array], Array]
"""Runs a model in the physics engine: from (n,) starts and (n, S, k) commands, of k equal parts of each period, to
(n, S + 1, 7) observations, no noise.

Angles and rates of a start, and of an observation, are of one instant, but for what the model's sensors add.
"""

_COLUMNS = [Observation._fields.index(name) for name in MEASURED]
_FLOOR_STARTS = 12  # from which the floor is found
_DIVERGED = math.pi  # rad; a filter that sees a larger tilt, or no number, has diverged
_HISTORY = 5  # control periods before a rollout, for what a late IMU still shows
_ENOUGH = 10  # starts that are left without those that follow lost rows
_AT_MOST = 0.25  # share of a recording that goes by until its first rollout
_IMU_MEMORY = 1.0  # s; a late IMU shows nothing older
_FLAT = 0.1  # share of the floor by which `before` must exceed it for a share of the gap to mean anything


class Models(NamedTuple):
    """The same recordings by three models, and the last of them with values drawn by their standard errors."""

    nominal: FilterResult
    refitted: FilterResult
    named: FilterResult
    drawn: Sequence[Effects] = ()


class _Rollouts(NamedTuple):
    """Rollouts of one model.

    Attributes:
        starts: (n,) of them.
        courses: (n, S + 1, 4) that they take in the engine, in the order of `MEASURED`.
        errors: (n, S + 1, 4) predicted less measured.
        recordings: (n,) numbers of those that the starts are in.
    """

    starts: Sequence[ReplayStart]
    courses: Array
    errors: Array
    recordings: Sequence[int]


class _Given(NamedTuple):
    """What rollouts are given of the data.

    Attributes:
        recordings: held out from all fitting.
        commands: of each, (T, k), of k equal parts of each period.
        places: (recording, instant) at which rollouts begin.
    """

    recordings: Sequence[Recording]
    commands: Sequence[Array]
    places: Sequence[tuple[int, int]]

    def ahead(self, periods: int) -> Array:
        """The commands after each start, (n, S, k)."""
        return np.array([self.commands[r][t : t + periods] for r, t in self.places])


class RolloutStarts(NamedTuple):
    """Where rollouts begin.

    Attributes:
        settling: control periods from the beginning of a recording to the first, after which the filter knows the
            motion; of a short recording no more than a share of it.
        spacing: from one start to the next [control periods].
        most: starts in all.
        ahead: after each, for the longest rollout [control periods].
        parts: of a control period, in each of which the engine is given the mean of an uneven loop's commands.
    """

    settling: int
    spacing: int
    most: int
    ahead: int
    parts: int = 1


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
    places = _places(recordings, stretches, models[:3])
    if not places:
        return ()
    given = _Given(recordings, [recording.commands_over(stretches.parts) for recording in recordings], places)
    nominal, refitted = (
        _rollouts(model, given, replay, stretches.ahead) for model in (models.nominal, models.refitted)
    )
    named = refitted
    if models.named is not models.refitted:
        named = _rollouts(models.named, given, replay, stretches.ahead)
    floor = _floor(models.named, named, replay, given.ahead(stretches.ahead), noise, radius)
    gaps = list[Gap]()
    for i in np.flatnonzero(recordings[0].sensed):
        for steps in horizons:
            before, middle, after = (_rms(each.errors[:, steps, i]) for each in (nominal, refitted, named))
            least = min(float(floor[steps, i]), after)
            closed = (before - after) / (before - least) if before > (1.0 + _FLAT) * least else None
            horizon = steps * recordings[0].period
            better = nominal if before < middle else refitted
            excess = _excess(named.errors[:, steps, i], better.errors[:, steps, i])
            gaps.append(Gap(MEASURED[i], horizon, before, middle, after, least, closed, float(floor[steps, i]), excess))
    if not models.drawn or all(gap.is_near_floor(gap.after) for gap in gaps):
        return tuple(gaps)
    by_values = _parameter_floor(models, named, replay, given.ahead(stretches.ahead))
    places_of = [(round(gap.horizon / recordings[0].period), MEASURED.index(gap.channel)) for gap in gaps]
    return tuple(gap._replace(parameter_floor=float(by_values[at])) for gap, at in zip(gaps, places_of, strict=True))


def _excess(errors: Array, others: Array) -> float:
    """Mean square of errors (n,) less that of others from the same starts, in standard errors of the difference.

    0 where they are too few to tell, or all alike.
    """
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
    places = _places(recordings, stretches, [result])
    if not places:
        return math.inf
    given = _Given(recordings, [recording.commands_over(stretches.parts) for recording in recordings], places)
    return _rms(_rollouts(result, given, replay, steps).errors[:, -1, column])


def _rollouts(result: FilterResult, given: _Given, replay: Replay, ahead: int) -> _Rollouts:
    """Rollouts of a model over some control periods, and how far they stray from what was measured.

    A tilt offset of a recording is added here, as it is no effect. What a filter of the tilt shows is all that it
    remembers, so in a model that has one the tilt begins at what was measured. By as much
    as the engine's own filter shows something else there, it is off later, less what it forgets.
    """
    recordings = given.recordings
    remembered = _remembered(result, recordings[0].period)
    starts = [
        _start(result.trajectories[r], recordings[r], t, given.commands[r][:t], remembered, ahead)
        for r, t in given.places
    ]
    seen = np.array([recordings[r].measured[t : t + ahead + 1] for r, t in given.places])  # (n, S + 1, 4)
    of = [r for r, _ in given.places]
    courses = _replayed(result, of, replay, starts, given.ahead(ahead))
    errors = courses - seen
    if result.offsets:
        errors[:, :, 0] += np.array([result.offsets[r].tilt for r in of])[:, None]
    if result.filter_rate > 0.0:
        since = recordings[0].period * np.arange(ahead + 1)
        errors[:, :, 0] -= errors[:, :1, 0] * np.exp(-result.filter_rate * since)
    return _Rollouts(starts, courses, errors, of)


def _replayed(
    result: FilterResult, recordings: Sequence[int], replay: Replay, starts: Sequence[ReplayStart], commands: Array
) -> Array:
    """(n, S + 1, 4) courses of a model from starts in recordings, each with its own battery and ground."""
    found = np.empty((len(starts), commands.shape[1] + 1, len(_COLUMNS)))
    alike = all(result.effects_in(r) == result.effects for r in recordings)
    for each in (None,) if alike else sorted({*recordings}):
        rows = [i for i, r in enumerate(recordings) if each in (None, r)]
        own = replace(result, effects=result.effects_in(recordings[rows[0]]))
        found[rows] = replay(own, [starts[i] for i in rows], commands[rows])[:, :, _COLUMNS]
    return found


def _places(
    recordings: Sequence[Recording], stretches: RolloutStarts, results: Sequence[FilterResult]
) -> list[tuple[int, int]]:
    """(recording, instant) of the starts, spread evenly.

    All instants of the rollout are usable, and no filter has diverged. Where rows were lost, filters do not know what
    was commanded meanwhile: if enough starts are left, those go that follow sooner than a filter settles.
    """
    ahead = stretches.ahead
    found = [
        (r, t)
        for r, recording in enumerate(recordings)
        for t in range(_first(recording, stretches), len(recording) - ahead, stretches.spacing)
        if recording.usable[t : t + ahead + 1].all()
        and all(abs(each.trajectories[r].tilt[t]) < _DIVERGED for each in results)
    ]
    calm = [(r, t) for r, t in found if not _lost_rows(recordings[r])[max(t - stretches.settling, 0) : t].any()]
    if len(calm) >= min(_ENOUGH, len(found)):
        found = calm
    if len(found) <= stretches.most:
        return found
    return [found[int(i)] for i in np.linspace(0, len(found) - 1, stretches.most)]


def _lost_rows(recording: Recording) -> Mask:
    """(T + 1,) instants that do not count between others that do; not a beginning that was fitted, or left out."""
    lost = ~recording.usable
    lost[: int(np.argmax(recording.usable))] = False
    return lost


def _first(recording: Recording, stretches: RolloutStarts) -> int:
    """The instant from which on rollouts may begin.

    A filter begins at what the first measurement tells. Until it has settled it is off by several times what the floor
    says.
    """
    return max(min(stretches.settling, int(_AT_MOST * len(recording))), _HISTORY)


def _remembered(result: FilterResult, period: float) -> int | None:
    """Control periods of past motion that sensors of a model still know of at the start of a rollout; None for all.

    A filter of the tilt never quite forgets, but what it remembers is replaced by what was measured. One that follows
    no accelerometer (rate 0) forgets nothing.
    """
    if TILT_FILTER in result.effects and result.filter_rate == 0.0:
        return None
    return math.ceil(_IMU_MEMORY / period)


def _start(
    trajectory: Trajectory, recording: Recording, t: int, commands: Array, remembered: int | None, ahead: int
) -> ReplayStart:
    """The motion that a model's filter sees at an instant, with the past that its effects remember.

    From there on the robot turns for some control periods `ahead` as it was measured to.

    Args:
        trajectory: that the filter sees in the recording.
        recording: of the robot.
        t: the instant.
        commands: (t, k) before it, as of `Replay`.
        remembered: control periods of past motion that sensors still know of; None for all.
        ahead: control periods.
    """
    past = slice(0 if remembered is None else max(t - remembered, 0), t)
    return ReplayStart(
        initial=InitialState(trajectory.tilt[t], trajectory.tilt_rate[t], trajectory.speed[t]),
        restart=RestartState(
            wheel_angle=trajectory.wheel_angle[t],
            heading=trajectory.heading[t],
            slip=trajectory.slip[t],
            yaw_rate=trajectory.yaw_rate[t],
            position=trajectory.position[t],
            x=trajectory.x[t],
            y=trajectory.y[t],
            rotor_ahead=trajectory.gap[t],
            rotor_faster=trajectory.gap_rate[t],
            sway=trajectory.sway[t],
            sway_rate=trajectory.sway_rate[t],
            joints=(float(trajectory.dry[t, 0]), float(trajectory.dry[t, 1])),
            ground=(float(trajectory.dry[t, 2]), float(trajectory.dry[t, 3])),
        ),
        past_commands=commands,
        past_motion=np.column_stack([trajectory.tilt, trajectory.tilt_rate, trajectory.speed])[past],
        yaw_rates=recording.yaw_rate[t : t + ahead + 1],
    )


def _floor(
    result: FilterResult, rollouts: _Rollouts, replay: Replay, commands: Array, noise: Array, radius: float
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
        variance += np.mean((_replayed(result, of, replay, off, held) - right) ** 2, axis=0)
    return np.asarray(np.sqrt(variance))


def _parameter_floor(models: Models, rollouts: _Rollouts, replay: Replay, commands: Array) -> Array:
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
        _replayed(replace(models.named, effects=effects), of, replay, starts, commands[some]) - rollouts.courses[some]
        for effects in models.drawn
    ]
    squares = [np.nan_to_num(np.mean(each**2, axis=0), nan=np.inf, posinf=np.inf) for each in errors]
    found = np.sqrt(np.median(squares, axis=0))
    return np.where(np.isfinite(found), found, 0.0)  # where most draws cannot be simulated, they tell nothing


def _some(rollouts: _Rollouts) -> Array:
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
