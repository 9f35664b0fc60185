"""How far rollouts of a simulation stray from what was measured, over short horizons.

From many instants of a recording the physics engine starts at the motion that a model's filter makes of the data so
far and runs under the recorded commands. Longer rollouts of an unstable robot saturate: by half a second any model is
wrong.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array
from twbal.core.plant import Observation
from twbal.core.start_pose import InitialState
from twbal.diagnosis.findings import FilterResult, Trajectory
from twbal.diagnosis.record import Gap
from twbal.sim.replay import ReplayStart
from twbal.sim.restart_state import RestartState
from twbal.sysid.recording import MEASURED, Recording

Replay = Callable[[FilterResult, Sequence[ReplayStart], Array], Array]
"""Runs a model in the physics engine: from (n,) starts and (n, S) commands to (n, S + 1, 7) observations, no noise."""

_COLUMNS = [Observation._fields.index(name) for name in MEASURED]
_FLOOR_STARTS = 12  # from which the floor is found
_FLAT = 0.1  # share of the floor by which `before` must exceed it for a share of the gap to mean anything


class Models(NamedTuple):
    """The same recordings by three models."""

    nominal: FilterResult
    refitted: FilterResult
    named: FilterResult


class Stretches(NamedTuple):
    """Where rollouts begin.

    Attributes:
        history: control periods before each, which fill delays and lags.
        spacing: from one start to the next [control periods].
        most: starts in all.
        ahead: after each, for the longest rollout [control periods].
    """

    history: int
    spacing: int
    most: int
    ahead: int


def measure_gaps(
    models: Models,
    recordings: Sequence[Recording],
    replay: Replay,
    horizons: Sequence[int],
    stretches: Stretches,
    noise: Array,
    radius: float,
) -> tuple[Gap, ...]:
    """The gap of each measured channel over each horizon.

    The floor is what the sensors' noise leaves where the model is right: that of the measurement at the horizon's end,
    and that of the start, carried there by the named model (four rollouts from starts that are off by a little).

    Args:
        models: with the trajectories of these recordings.
        recordings: held out from all fitting.
        replay: runs a model in the physics engine.
        horizons: lengths of the rollouts [control periods], at most `stretches.ahead`.
        stretches: where they begin.
        noise: (4,) standard deviations of the sensors, in the order of `MEASURED`.
        radius: of the wheels [m].
    """
    places = _places(recordings, stretches.ahead, stretches)
    if not places:
        return ()
    commands = np.array([recordings[r].commands[t : t + stretches.ahead] for r, t in places])
    seen = np.array([recordings[r].measured[t : t + stretches.ahead + 1] for r, t in places])  # (n, S + 1, 4)
    errors: list[Array] = []  # (n, S + 1, 4) of each model
    starts: list[ReplayStart] = []
    courses = np.empty(0)
    before: FilterResult | None = None
    for result in models:
        if result is not before:  # where nothing was named, the last two are one
            starts = [_start(result.trajectories[r], recordings[r], t) for r, t in places]
            courses = replay(result, starts, commands)[:, :, _COLUMNS]
        errors.append(courses - seen)
        before = result
        if result.offsets:  # the engine knows of no offset that changes from recording to recording
            errors[-1][:, :, 0] += np.array([result.offsets[r] for r, _ in places])[:, None]
    floor = _floor(models.named, starts, courses, replay, commands, noise, radius)
    gaps = []
    for i in np.flatnonzero(recordings[0].sensed):
        for steps in horizons:
            nominal, refitted, after = (_rms(each[:, steps, i]) for each in errors)
            least = min(float(floor[steps, i]), after)
            closed = (nominal - after) / (nominal - least) if nominal > (1.0 + _FLAT) * least else None
            horizon = steps * recordings[0].period
            gaps.append(Gap(MEASURED[i], horizon, nominal, refitted, after, least, closed, float(floor[steps, i])))
    return tuple(gaps)


def rollout_error(
    result: FilterResult,
    recordings: Sequence[Recording],
    replay: Replay,
    gap: Gap,
    stretches: Stretches,
) -> float:
    """Root mean square error of rollouts of another model, in the channel and over the horizon of a gap.

    Arguments as of `measure_gaps`; the rollouts begin where its own do.
    """
    column, steps = MEASURED.index(gap.channel), round(gap.horizon / recordings[0].period)
    places = _places(recordings, stretches.ahead, stretches)
    starts = [_start(result.trajectories[r], recordings[r], t) for r, t in places]
    commands = np.array([recordings[r].commands[t : t + steps] for r, t in places])
    seen = np.array([recordings[r].measured[t + steps, column] for r, t in places])
    reached = replay(result, starts, commands)[:, -1, _COLUMNS[column]]
    if result.offsets and column == 0:
        reached = reached + np.array([result.offsets[r] for r, _ in places])
    return _rms(reached - seen)


def _places(recordings: Sequence[Recording], ahead: int, stretches: Stretches) -> list[tuple[int, int]]:
    """(recording, instant) of the starts, spread evenly, where all instants of the rollout are usable."""
    found = [
        (r, t)
        for r, recording in enumerate(recordings)
        for t in range(stretches.history, len(recording) - ahead, stretches.spacing)
        if recording.usable[t : t + ahead + 1].all()
    ]
    if len(found) <= stretches.most:
        return found
    return [found[int(i)] for i in np.linspace(0, len(found) - 1, stretches.most)]


def _start(trajectory: Trajectory, recording: Recording, t: int) -> ReplayStart:
    """The motion that a model's filter sees at an instant, with the past that its effects remember."""
    return ReplayStart(
        initial=InitialState(trajectory.tilt[t], trajectory.tilt_rate[t], trajectory.speed[t]),
        restart=RestartState(
            wheel_angle=trajectory.wheel_angle[t],
            heading=trajectory.heading[t],
            slip=trajectory.slip[t],
            yaw_rate=trajectory.yaw_rate[t],
            position=trajectory.position[t],
            rotor_ahead=trajectory.gap[t],
        ),
        past_commands=recording.commands[:t],
        past_motion=np.column_stack([trajectory.tilt, trajectory.tilt_rate, trajectory.speed])[:t],
    )


def _floor(
    result: FilterResult,
    starts: Sequence[ReplayStart],
    courses: Array,
    replay: Replay,
    commands: Array,
    noise: Array,
    radius: float,
) -> Array:
    """What noise alone leaves of each channel after each number of periods, (S + 1, 4).

    Args:
        result: of the model that is taken to be right.
        starts: of rollouts.
        courses: that they take, (n, S + 1, 4).
        replay: runs the model in the physics engine.
        commands: of the rollouts, (n, S).
        noise: as of `measure_gaps`.
        radius: as of `measure_gaps`.
    """
    some = np.linspace(0, len(starts) - 1, min(len(starts), _FLOOR_STARTS)).astype(int)
    held, right = commands[some], courses[some]
    values, vectors = np.linalg.eigh(result.posterior_covariance)
    variance = np.tile(noise**2, (right.shape[1], 1))
    for value, direction in zip(values, vectors.T, strict=True):
        off = [_moved(starts[i], np.sqrt(max(value, 0.0)) * direction, radius) for i in some]
        variance += np.mean((replay(result, off, held)[:, :, _COLUMNS] - right) ** 2, axis=0)
    return np.asarray(np.sqrt(variance))


def _moved(start: ReplayStart, by: Array, radius: float) -> ReplayStart:
    """A start that is off in tilt, wheel angle, tilt rate and wheel speed."""
    tilt, wheel, tilt_rate, wheel_speed = by
    at = start.initial
    initial = InitialState(at.tilt + tilt, at.tilt_rate + tilt_rate, at.speed + radius * wheel_speed)
    turned = start.restart._replace(wheel_angle=start.restart.wheel_angle + wheel - tilt)
    return replace(start, initial=initial, restart=turned)


def _rms(errors: Array) -> float:
    return float(np.sqrt(np.mean(errors**2)))
