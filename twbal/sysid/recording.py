"""What a diagnosis reads of an episode, checked."""

from collections import Counter
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from math import degrees

import numpy as np
from scipy.ndimage import uniform_filter1d

from twbal.core.episode import Episode, Provenance
from twbal.core.errors import DataError
from twbal.core.gaussian import Array, Mask
from twbal.core.plant import Observation
from twbal.core.robot_parameters import RobotParameters
from twbal.core.time_base import LATE, LoopJitter, evened, is_uneven, means_over_periods, pace_of, places_of
from twbal.sysid.uneven_loop import UnevenLoop, loop_of

MEASURED = ("tilt", "tilt_rate", "wheel_angle", "wheel_rate")
"""Channels whose prediction errors count, in this order."""

SAME_PERIOD = 1e-6
"""By which control periods may differ that are taken for the same [s]."""

_COLUMNS = [Observation._fields.index(name) for name in MEASURED]
_ANGLES = [MEASURED.index("tilt"), MEASURED.index("wheel_angle")]
_RATES = [MEASURED.index("tilt_rate"), MEASURED.index("wheel_rate")]
_TIME, _YAW = Observation._fields.index("time"), Observation._fields.index("yaw_rate")
_YAW_MEAN = 3  # instants over which the yaw rate is averaged; more would blur how far apart the wheels are
_ALIKE = 1e-9  # range of values that are all the same, in their unit
_SOME = 0.2  # s of a recording that are worth a word
_FEW = 10  # instants of which nothing is said
_DIFFERENCED = (
    ("tilt", "tilt_rate", 0.003),  # a filter adds up the gyro: only an exact difference was no gyro's
    ("wheel_angle", "wheel_rate", 0.1),
)  # share of a rate's changes by which it may differ from the difference of its angle to be that
_ODD = 0.05  # share of the samples that may be lost, or so late that they belong to another control period


@dataclass(frozen=True, eq=False)
class Recording:
    """T control periods of a robot, as a diagnosis needs them.

    Attributes:
        name: for reports.
        period: control period [s].
        commands: (T,) [N·m]; commands[t] acted between instants t and t + 1. Of an uneven loop, what acted then in the
            mean.
        measured: (T + 1, 4) in the order of `MEASURED`. Of an uneven loop, as an even one would have read it.
        yaw_rate: (T + 1,) [rad/s], with the gyro's noise smoothed away.
        usable: (T + 1,); False at instants whose prediction errors do not count: the robot turned too fast, or the row
            was lost.
        sensed: (4,); False for channels that no sensor measured: what stands there was worked out from others, and its
            errors do not count.
        run: number of the run of the robot that it is from, in which battery and floor stay what they are.
        uneven: what was commanded and read when; None: the loop was even.
    """

    name: str
    period: float
    commands: Array
    measured: Array
    yaw_rate: Array
    usable: Mask
    sensed: Mask
    uneven: UnevenLoop | None = None
    run: int = 0

    def __len__(self) -> int:
        return len(self.commands)

    @property
    def counted(self) -> int:
        """Control periods whose prediction errors count."""
        return int(self.usable[1:].sum())

    @property
    def heading(self) -> Array:
        """(T + 1,) angle by which the robot has turned since the first instant [rad]."""
        turns = 0.5 * self.period * (self.yaw_rate[:-1] + self.yaw_rate[1:])
        return np.concatenate([np.zeros(1), np.cumsum(turns)])

    def part(self, begin: int, end: int) -> "Recording":
        """What lies between two instants, which both belong to it."""
        instants = {name: getattr(self, name)[begin : end + 1] for name in ("measured", "yaw_rate", "usable")}
        loop = self.uneven.part(begin, end) if self.uneven else None
        return replace(self, commands=self.commands[begin:end], uneven=loop, **instants)

    def instants_until(self, share: float, rounded: Callable[[float], int] = round) -> int:
        """Of the beginning that holds a share of the instants that count, at least 1.

        Args:
            share: of these instants.
            rounded: makes a whole number of them.
        """
        counted = np.cumsum(self.usable[1:])
        return int(np.searchsorted(counted, rounded(share * int(counted[-1])))) + 1

    @property
    def readings(self) -> Array:
        """(T + 1, 4) as they were read, in the order of `MEASURED`, wherever their instants lie."""
        return self.measured if self.uneven is None else self.uneven.readings

    def even_states(self, states: Array) -> Array:
        """The predictor's states (T + 1, 19) at the instants of an even loop, at which `measured` is."""
        return states if self.uneven is None else self.uneven.even_states(states, self.period)

    def commands_over(self, parts: int) -> Array:
        """(T, parts) commands that acted in equal parts of each period; (T, 1) of an even loop, which held each."""
        return self.commands[:, None] if self.uneven is None else self.uneven.commands_over(self.period, parts)

    def commanded(self, change: Callable[[Array], Array]) -> "Recording":
        """The same with other commands, by what makes them (T,) of those that were sent (T,)."""
        if self.uneven is None:
            return replace(self, commands=change(self.commands))
        commands = change(self.uneven.commands)
        means = means_over_periods(commands, self.uneven.lateness)
        return replace(self, commands=means, uneven=self.uneven._replace(commands=commands))


@dataclass(frozen=True)
class Usability:
    """What recordings must have.

    Attributes:
        min_length: periods of an episode that count, below which it is left out.
        min_samples: periods of all episodes together that count.
        max_yaw_rate: yaw rate beyond which instants do not count [rad/s].
        max_tilt: tilt at which a recording is cut off, as the robot has fallen [rad].
        needs_tilt: whether a tilt or its rate must have been measured; not where the robot lies and its wheels turn in
            the air.
    """

    min_length: int
    min_samples: int
    max_yaw_rate: float
    max_tilt: float
    needs_tilt: bool = True


def read_recordings(
    episodes: Sequence[Episode], names: Sequence[str], robot: RobotParameters, usability: Usability
) -> tuple[Recording, ...]:
    """What a diagnosis of `robot` reads of measured episodes.

    Args:
        episodes: measured, of one robot.
        names: of the episodes, for reports and errors.
        robot: data sheet, whose control period must be that of the episodes.
        usability: what recordings must have.

    Raises:
        DataError: the episodes cannot be used; the message says which, why, and what to try.
    """
    if not episodes:
        raise DataError("A diagnosis needs at least one measured episode; found none.")
    for episode, name in zip(episodes, names, strict=True):
        _check_episode(episode, name, robot)
    uneven = is_uneven([_pace(episode, usability) for episode in episodes])
    found = [
        replace(_read(episode, name, robot, usability, uneven), run=run)
        for episode, name, run in zip(episodes, names, _runs(episodes), strict=True)
    ]
    recordings = tuple(recording for recording in found if recording.counted >= max(usability.min_length, 1))
    total, needed = sum(recording.counted for recording in recordings), max(usability.min_samples, 1)
    if total < needed:
        not_used = what_is_not_used(episodes, names, [recording.name for recording in recordings], usability)
        cut = "".join(f"{said[0].upper()}{said[1:]}. " for said in not_used)
        raise DataError(
            f"Needed are {needed} control periods ({needed * robot.control_period:.3g} s) in episodes of at least "
            f"{max(usability.min_length, 1)}, upright and not turning fast; found {total} in {len(recordings)} of "
            f"{len(episodes)} episodes. "
            f"{cut}Record longer: twbal real-rollout experiment=excite; if the robot falls, with "
            "policy.command_width=0.1."
        )
    sensed = np.all([recording.sensed for recording in recordings], axis=0)  # by some of them only: by none
    recordings = tuple(replace(recording, sensed=sensed) for recording in recordings)
    check_signals(recordings, usability.needs_tilt)
    return recordings


def commands_of(episode: Episode, robot: RobotParameters) -> Array:
    """Commands (T,) of an episode, within what the motors of a robot can give by its data sheet [N·m]."""
    return np.clip(episode.commands, -robot.torque_limit, robot.torque_limit)


def commands_over(recordings: Sequence[Recording], parts: int) -> list[Array]:
    """Commands (T, k) of each recording in k equal parts of each period; 1 where all loops are even, else `parts`."""
    found = [recording.commands_over(parts) for recording in recordings]
    most = max((commands.shape[1] for commands in found), default=1)
    return [np.repeat(commands, most // commands.shape[1], axis=1) for commands in found]


def are_of_several_runs(recordings: Sequence[Recording]) -> bool:
    """Whether recordings are of more than one run of the robot."""
    return len({recording.run for recording in recordings}) > 1


def _runs(episodes: Sequence[Episode]) -> list[int]:
    """Number of the run of each episode: the trials of one run differ in their number alone, and each has its own."""
    times, numbers = Counter[Provenance](), dict[tuple[Provenance, int], int]()
    found = list[int]()
    for source in (episode.provenance for episode in episodes):
        found.append(numbers.setdefault((replace(source, trial=0), times[source]), len(numbers)))
        times[source] += 1
    return found


def check_episodes(episodes: Sequence[Episode], names: Sequence[str], robot: RobotParameters) -> None:
    """Raise where nothing of a robot can be learned from episodes, however long they are.

    Args: as of `read_recordings`.

    Raises:
        DataError: an episode has another control period than the robot, a value that is no number, or no clock; or the
            robot lies in all of them, a sensor was off, or the torque never varied.
    """
    everything = Usability(0, 0, np.inf, np.inf)
    for episode, name in zip(episodes, names, strict=True):
        _check_episode(episode, name, robot)
    _check_stands(episodes)
    recordings = [_read(e, name, robot, everything, False) for e, name in zip(episodes, names, strict=True)]
    sensed = np.all([recording.sensed for recording in recordings], axis=0)
    if sum(map(len, recordings)) >= _FEW:
        check_signals([replace(recording, sensed=sensed) for recording in recordings], needs_tilt=True)


def _check_stands(episodes: Sequence[Episode]) -> None:
    """Raise where the robot lies in all episodes."""
    least = min((float(np.abs(episode.observations[:, _COLUMNS[0]]).min()) for episode in episodes), default=0.0)
    if least > 0.5 * np.pi:
        raise DataError(
            f"The robot stands in none of {len(episodes)} episodes: its tilt is {degrees(least):.3g}° and more. Is the "
            "tilt in rad, and 0 where the robot stands upright?"
        )


def what_is_not_used(
    episodes: Sequence[Episode],
    names: Sequence[str],
    read: Collection[str],
    usability: Usability,
    robot: RobotParameters | None = None,
) -> list[str]:
    """What is not read of episodes: from where on the robot has fallen, what turns too fast, and what is too short.

    And commands that are cut, where they are many.

    Args:
        episodes: that were to be read.
        names: of them.
        read: names of those of which something was read.
        usability: by which.
        robot: to whose torque limit commands are cut; None: they are not looked at.
    """
    found = list[str]()
    for episode, name in zip(episodes, names, strict=True):
        times, tilts = episode.observations[:, _TIME], episode.observations[:, _COLUMNS[0]]
        fallen = np.flatnonzero(np.abs(tilts) > usability.max_tilt)
        is_fast = np.abs(episode.observations[: _end(episode, usability), _YAW]) > usability.max_yaw_rate
        fast = float(np.mean(is_fast)) if len(is_fast) else 0.0
        at, whole = times[fallen[0] if len(fallen) else -1] - times[0], times[-1] - times[0]
        if len(fallen) and (name not in read or whole - at > _SOME):
            used = f"only its first {at:.3g} s of {whole:.3g} s are used" if name in read else "it is left out"
            first = f"the tilt of episode {name} is {degrees(tilts[fallen[0]]):.3g}° at {at:.3g} s"
            found.append(f"{first}, beyond the limit of {degrees(usability.max_tilt):.3g}°: {used}")
        elif name not in read and fast == 0.0:
            found.append(f"episode {name} is left out: it has {len(episode)} samples of {max(usability.min_length, 1)}")
        if fast > _ODD:
            found.append(
                f"episode {name} turns faster than {usability.max_yaw_rate:.3g} rad/s in {fast:.0%} of its samples, "
                f"which do not count{'' if name in read else ', and is left out'} (is its yaw rate in rad/s?)"
            )
        if robot is not None and len(episode):
            cut = float(np.mean(np.abs(episode.commands) > (1.0 + _ODD) * robot.torque_limit))
            if cut > _ODD:
                found.append(
                    f"WARNING: {cut:.0%} of the commands of episode {name} are beyond the torque limit of "
                    f"{robot.torque_limit:.3g} N·m, and are cut to it; is their unit N·m, of both wheels together?"
                )
    return found


def _check_episode(episode: Episode, name: str, robot: RobotParameters) -> None:
    """Raise where an episode has another control period than the robot, a value that is no number, or no clock."""
    if abs(episode.control_period - robot.control_period) > SAME_PERIOD:
        raise DataError(
            f"Episode {name} has a control period of {episode.control_period} s, robot {robot.name!r} one of "
            f"{robot.control_period} s. Choose the robot by robot=..., or set its period by "
            f"robot.control_period={episode.control_period!r}."
        )
    seen = episode.observations
    if not np.isfinite(seen).all() or not np.isfinite(episode.commands).all():
        raise DataError(f"Episode {name} has values that are not finite numbers. Leave it out.")
    _check_clock(seen[:, _TIME], name, robot.control_period)


def _end(episode: Episode, usability: Usability) -> int:
    """Instants of an episode up to that at which the robot has fallen."""
    fallen = np.flatnonzero(np.abs(episode.observations[:, _COLUMNS[0]]) > usability.max_tilt)
    return int(fallen[0]) if len(fallen) else len(episode.observations)


def _pace(episode: Episode, usability: Usability) -> LoopJitter:
    """What one episode tells of whether the loop is as uneven as its stamps."""
    seen = episode.observations[: _end(episode, usability)]
    return pace_of(seen[:, _TIME], seen[:, _COLUMNS][:, _ANGLES], episode.control_period)


def _read(episode: Episode, name: str, robot: RobotParameters, usability: Usability, uneven: bool) -> Recording:
    """One episode, up to the instant at which the robot has fallen."""
    seen, end = episode.observations, _end(episode, usability)
    measured = seen[:, _COLUMNS]
    commands = commands_of(episode, robot)[: max(end - 1, 0)]
    worked_out = {channel for channel, _ in episode.estimated}
    worked_out |= differenced_rates(measured[:end], seen[:end, _TIME])
    sensed = np.array([channel not in worked_out for channel in MEASURED])
    values = seen[:end, [*_COLUMNS, _YAW]]
    even = evened(seen[:end, _TIME], values, commands, robot.control_period, _ANGLES, _RATES, uneven)
    usable = even.measured & (np.abs(even.values[:, -1]) <= usability.max_yaw_rate)
    smooth = uniform_filter1d(even.values[:, -1], _YAW_MEAN, mode="nearest")
    loop = loop_of(even, seen[:end, _TIME], measured[:end], robot.control_period)
    return Recording(name, robot.control_period, even.commands, even.values[:, :-1], smooth, usable, sensed, loop)


def differenced_rates(measured: Array, times: Array) -> set[str]:
    """Rates that are the changes of their angles over the control period before, and so tell nothing that these do not.

    Their errors are those of two angles, one of which the rate before has, too, and they are late by half a period. A
    filter that takes them for a sensor's own would find errors that remember.

    Args:
        measured: (T + 1, 4) in the order of `MEASURED`.
        times: (T + 1,) [s].
    """
    found = set[str]()
    if len(times) < _FEW:
        return found
    for angle, rate, most in _DIFFERENCED:
        angles, rates = (measured[:, MEASURED.index(name)] for name in (angle, rate))
        left = rates[1:] - np.diff(angles) / np.diff(times)
        if np.std(left) < most * np.std(np.diff(rates)):
            found.add(rate)
    return found


def _check_clock(times: Array, name: str, period: float) -> None:
    """Raise where the clock runs backwards, or samples do not come once in a control period."""
    steps = np.diff(times)
    if len(steps) and steps.min() <= 0:
        k = int(np.argmin(steps))
        raise DataError(f"The clock of episode {name} runs backwards between samples {k} and {k + 1}. Leave it out.")
    numbers, late = places_of(times, period)
    lost = 1.0 - len(times) / (numbers[-1] + 1)
    odd = float(np.mean(np.abs(late) > LATE * period))
    if max(lost, odd) > _ODD:
        found = f"{lost:.0%} of the samples are missing" if lost > odd else f"{odd:.0%} are over half a period late"
        raise DataError(
            f"In episode {name}, for a control period of {period} s, {found}. Samples were lost, or the robot's period "
            "is another: set it by robot.control_period=..., or record again."
        )


def stuck_sensors(recordings: Sequence[Recording]) -> list[str]:
    """What does not change in some of several recordings, a sentence each: a plug may have been loose there."""
    return [
        f"WARNING: {channel} is {recording.measured[0, i]:.6g} throughout {recording.name}, and changes in others. "
        "If its sensor was off, leave that recording out."
        for recording in recordings
        for i, channel in enumerate(MEASURED)
        if len(recordings) > 1 and recording.sensed[i] and np.ptp(recording.measured[:, i]) <= _ALIKE
    ]


def check_signals(recordings: Sequence[Recording], needs_tilt: bool) -> None:
    """Whether something can be learned from recordings.

    Args:
        recordings: which all have the same channels.
        needs_tilt: whether that takes a tilt or its rate.

    Raises:
        DataError: no channel of the tilt or of the wheels is left, one does not change, or the torque never varied.
    """
    measured = np.concatenate([recording.measured for recording in recordings])
    sensed = recordings[0].sensed
    if (needs_tilt and not sensed[:2].any()) or not sensed[2:].any():
        raise DataError("Needed are a measured tilt or tilt rate, and wheels whose angle or rate is measured.")
    for i, channel in enumerate(MEASURED):
        if sensed[i] and np.ptp(measured[:, i]) <= _ALIKE:
            raise DataError(
                f"Channel {channel} is {measured[0, i]:.6g} throughout {len(measured)} samples: its sensor was off, "
                "or is not logged. `twbal import-log` works a rate out that was not measured."
            )
    commands = np.concatenate([recording.commands for recording in recordings])
    if np.ptp(commands) <= _ALIKE:
        raise DataError(
            f"The command is {commands[0]:.6g} N·m throughout {len(commands)} control periods; needed is one that "
            "varies. Record with twbal real-rollout experiment=excite."
        )
