"""Rollouts of a model in the physics engine, from many instants of recordings, under the recorded commands."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array, Mask
from twbal.core.plant import Observation
from twbal.core.start_pose import InitialState
from twbal.diagnosis.findings import FilterResult, Trajectory
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
_DIVERGED = math.pi  # rad; a filter that sees a larger tilt, or no number, has diverged
EXPLODED = 1e6
"""In the unit of a channel: error of a rollout that ends in what is no number, and the largest one of any."""

_HISTORY = 5  # control periods before a rollout, for what a late IMU still shows
_ENOUGH = 10  # starts that are left without those that follow lost rows
_AT_MOST = 0.25  # share of a recording that goes by until its first rollout
_IMU_MEMORY = 1.0  # s; a late IMU shows nothing older


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


class RolloutInputs(NamedTuple):
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


class Rollouts(NamedTuple):
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


def rollouts_of(result: FilterResult, given: RolloutInputs, replay: Replay, ahead: int) -> Rollouts:
    """Rollouts of a model over some control periods, and how far they stray from what was measured.

    A tilt offset of a recording is added here, as it is no effect. What a filter of the tilt shows is all that it
    remembers, so in a model that has one the tilt begins at what was measured. By as much as the engine's own filter
    shows something else there, it is off later, less what it forgets.

    Args:
        result: of the model, with its trajectories of the recordings.
        given: recordings, commands and starts.
        replay: runs a model in the physics engine.
        ahead: control periods.
    """
    recordings = given.recordings
    remembered = _remembered(result, recordings[0].period)
    starts = [
        _start(result.trajectories[r], recordings[r], t, given.commands[r][:t], remembered, ahead)
        for r, t in given.places
    ]
    seen = np.array([recordings[r].measured[t : t + ahead + 1] for r, t in given.places])  # (n, S + 1, 4)
    of = [r for r, _ in given.places]
    courses = replayed_courses(result, of, replay, starts, given.ahead(ahead))
    errors = courses - seen
    if result.offsets:
        errors[:, :, 0] += np.array([result.offsets[r].tilt for r in of])[:, None]
    if result.filter_rate > 0.0:
        since = recordings[0].period * np.arange(ahead + 1)
        errors[:, :, 0] -= errors[:, :1, 0] * np.exp(-result.filter_rate * since)
    errors = np.clip(np.nan_to_num(errors, nan=EXPLODED), -EXPLODED, EXPLODED)
    return Rollouts(starts, courses, errors, of)


def replayed_courses(
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


def start_places(
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
