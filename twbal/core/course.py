"""Where a robot is told to go: speeds and places, one after the other."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil, inf, isfinite
from typing import NamedTuple, Self

from twbal.core.errors import ConfigError
from twbal.core.motion_limits import MotionLimits
from twbal.core.motion_profile import Motion, MotionProfile, profile_to_position, profile_to_speed
from twbal.core.robot_parameters import RobotParameters

GIVE_WAY = 0.3
"""By default the robot may be off as far as the fastest reference goes in this time [s]. Regulators of all packaged
sheets, without faults, lag by 0.17 to 0.28 s of it on ramps within the limits of their sheets."""
_SEGMENTS = ({"seconds", "speed"}, {"seconds", "share"}, {"seconds", "position"}, {"position"})
_NEARLY = 1e-9  # of a control period: a time that is a whole number of them is not rounded up


class Target(NamedTuple):
    """What is asked for: a speed, or a place.

    Attributes:
        speed: [m/s]; None where a place is asked for.
        position: of that place, from where the robot was put [m].
    """

    speed: float | None
    position: float = 0.0

    def profile(self, start: Motion, limits: MotionLimits) -> MotionProfile:
        """The way there."""
        if self.speed is None:
            return profile_to_position(start, self.position, limits)
        return profile_to_speed(start, self.speed, limits)


AT_REST = Target(speed=0.0)


class Segment(NamedTuple):
    """A part of a course.

    Attributes:
        target: what is asked for.
        begin: since the rollout began [s].
        end: [s].
    """

    target: Target
    begin: float
    end: float


@dataclass(frozen=True)
class Course:
    """Targets over time, and how a reference moves between them.

    Attributes:
        segments: one after the other, from time 0 on.
        limits: of the reference's motion.
        give_way: how far the robot may be from the reference before that gives way [m].
    """

    segments: tuple[Segment, ...]
    limits: MotionLimits
    give_way: float

    @classmethod
    def from_settings(
        cls,
        robot: RobotParameters,
        segments: Sequence[Mapping[str, float]],
        speed_limit: float | None = None,
        acceleration_limit: float | None = None,
        jerk_limit: float | None = None,
        give_way: float = GIVE_WAY,
    ) -> Self:
        """The course that a user gives.

        Args:
            robot: its sheet.
            segments: each `{seconds, speed}`, `{seconds, share}`, `{seconds, position}` or `{position}`, in s, m/s,
                shares of the speed limit, and m. A place without a time takes as long as the reference needs.
            speed_limit: [m/s]; None: from the sheet, as the next two.
            acceleration_limit: [m/s²].
            jerk_limit: [m/s³].
            give_way: time in which a reference at the speed limit goes as far as the robot may be off [s].

        Raises:
            ConfigError: a segment or a limit cannot be right.
        """
        limits = MotionLimits.of_robot(robot, speed_limit, acceleration_limit, jerk_limit)
        if not segments or not 0 < give_way < inf:
            raise ConfigError(
                f"A course needs at least one segment and a positive, finite give_way; found {list(segments)} and "
                f"{give_way}."
            )
        return cls(_planned(segments, limits), limits, give_way * limits.speed)

    @property
    def duration(self) -> float:
        """Of all segments [s]."""
        return self.segments[-1].end

    def steps(self, control_period: float) -> int:
        """Control periods that the course takes, of `control_period` [s] each."""
        return ceil(self.duration / control_period - _NEARLY)

    def target(self, time: float) -> Target:
        """What is asked for at a time [s]; after the end, what was asked for last."""
        return next((segment for segment in self.segments if time < segment.end), self.segments[-1]).target


def _planned(segments: Sequence[Mapping[str, float]], limits: MotionLimits) -> tuple[Segment, ...]:
    """The segments with their times, where the reference never gives way."""
    planned: list[Segment] = []
    motion, time = Motion(), 0.0
    for number, segment in enumerate(segments):
        target = _target(number, segment, limits)
        profile = target.profile(motion, limits)
        seconds = float(segment.get("seconds", profile.duration))
        motion = profile.at(seconds)
        planned.append(Segment(target, time, time + seconds))
        time += seconds
    return tuple(planned)


def _target(number: int, segment: Mapping[str, float], limits: MotionLimits) -> Target:
    """What a segment asks for; raises ConfigError where that cannot be told."""
    if set(segment) not in _SEGMENTS or not all(map(_is_number, segment.values())) or segment.get("seconds", 1) <= 0:
        raise ConfigError(
            f"Segment {number} of the course is {dict(segment)}; expected numbers for {{seconds, speed}}, {{seconds, "
            "share}, {seconds, position} or {position}, with seconds above 0."
        )
    if "position" in segment:
        return Target(None, float(segment["position"]))
    speed = float(segment["speed"] if "speed" in segment else segment["share"] * limits.speed)
    if abs(speed) > limits.speed:
        raise ConfigError(
            f"Segment {number} of the course asks for {speed:g} m/s; the limit is {limits.speed:.3g} m/s. Give a "
            "higher course.speed_limit if the robot can drive so fast."
        )
    return Target(speed)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and isfinite(value)
