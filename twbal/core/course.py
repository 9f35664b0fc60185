"""Where a robot is told to go: speeds and places, one after the other."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil, inf, isfinite, radians
from typing import NamedTuple, Self

from twbal.core.errors import ConfigError
from twbal.core.motion_limits import MotionLimits
from twbal.core.motion_profile import Motion, MotionProfile, profile_to_position, profile_to_speed
from twbal.core.robot_parameters import RobotParameters
from twbal.core.yielding import yields_to_pushes

GIVE_WAY = 0.3
"""By default the robot may be off as far as the fastest reference goes in this time [s]. Regulators of all packaged
sheets, without faults, lag by 0.17 to 0.28 s of it on ramps within the limits of their sheets."""
STANDING_GIVE_WAY = 1.0
"""The same for a robot that only stands [s]: it may start from a lean, and must not leave its place for that."""
BRAKING_LEAN = radians(10.0)
"""Of the body, in which a robot that was pushed off its place brakes, and comes back. It is twice that of a course, as
the robot is to be back soon; the rest of the tilt that it may have is for balancing."""
LONGEST = 10_000.0
"""Of a course [s]; a recording of it has half a million samples at 50 Hz."""
_SEGMENTS = (
    {"seconds", "speed"}, {"seconds", "share"}, {"seconds", "position"}, {"position"}, {"seconds", "radii"}, {"radii"},
    {"seconds", "turn"}, {"turn"},
)  # fmt: skip
_NEARLY = 1e-9  # of a control period: a time that is a whole number of them is not rounded up


class Target(NamedTuple):
    """What is asked for: a speed, or a place.

    Attributes:
        speed: [m/s]; None where a place is asked for.
        position: of that place, along the robot's way from where it was put [m].
        heading: about the vertical, from that with which the robot was put, positive to the left [rad].
    """

    speed: float | None
    position: float = 0.0
    heading: float = 0.0

    def profile(self, start: Motion, limits: MotionLimits) -> MotionProfile:
        """The way there."""
        if self.speed is None:
            return profile_to_position(start, self.position, limits)
        return profile_to_speed(start, self.speed, limits)


AT_REST = Target(speed=0.0)


@dataclass(frozen=True)
class Standing:
    """To stand where the robot was put.

    Attributes:
        limits: of the reference's motion, which moves only where it gives way to a robot that is pushed or held.
        give_way: how far the robot may be from the reference before that gives way [m].
    """

    limits: MotionLimits
    give_way: float

    @classmethod
    def of_robot(cls, robot: RobotParameters) -> Self:
        """By the limits of a robot's sheet, with `BRAKING_LEAN`."""
        limits = MotionLimits.of_robot(robot, lean=BRAKING_LEAN)
        return cls(limits, STANDING_GIVE_WAY * limits.speed)

    def target(self, time: float) -> Target:
        """The place where it was put, at any time."""
        return Target(None, 0.0)


def standing_targets(yields: bool | None, robot: RobotParameters, channels: Sequence[str]) -> Standing | None:
    """Those of a robot that is to stand and yields to pushes; None for one that resists.

    Args:
        yields: whether it does; None: by its sheet (`yields_to_pushes`).
        robot: its sheet.
        channels: of the state; without `position` a policy does not see where the reference is, and the robot resists.
    """
    return Standing.of_robot(robot) if "position" in channels and yields_to_pushes(yields, robot) else None


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
        heading: where the heading is to go; None: nothing controls it.
    """

    segments: tuple[Segment, ...]
    limits: MotionLimits
    give_way: float
    heading: "HeadingCourse | None" = None

    @classmethod
    def from_settings(
        cls,
        robot: RobotParameters,
        segments: Sequence[Mapping[str, float]],
        speed_limit: float | None = None,
        acceleration_limit: float | None = None,
        jerk_limit: float | None = None,
        give_way: float = GIVE_WAY,
        control_heading: bool = True,
        yaw_rate_limit: float | None = None,
        yaw_acceleration_limit: float | None = None,
    ) -> Self:
        """The course that a user gives.

        Args:
            robot: its sheet.
            segments: each `{seconds, speed}`, `{seconds, share}`, `{seconds, position}`, `{seconds, radii}` or
                `{seconds, turn}`, in s, m/s, shares of the speed limit, m, wheel radii, and degrees to the left on the
                spot. Places and turns need no time: they then take as long as the reference does.
            speed_limit: [m/s]; None: from the sheet, as the next two.
            acceleration_limit: [m/s²].
            jerk_limit: [m/s³].
            give_way: time in which a reference at the speed limit goes as far as the robot may be off [s].
            control_heading: whether the heading is controlled, where the robot can be turned.
            yaw_rate_limit: [rad/s]; None: from the sheet, as the next.
            yaw_acceleration_limit: [rad/s²].

        Raises:
            ConfigError: a segment or a limit cannot be right.
        """
        limits = MotionLimits.of_robot(robot, speed_limit, acceleration_limit, jerk_limit)
        if not segments or not 0 < give_way < inf:
            raise ConfigError(
                f"A course needs at least one segment and a positive, finite give_way; found {list(segments)} and "
                f"{give_way}."
            )
        turning = MotionLimits.of_turning(robot, limits.speed, yaw_rate_limit, yaw_acceleration_limit)
        planned = _Plan(limits, turning, robot.wheel_radius).of(segments)
        if not planned[-1].end <= LONGEST:
            raise ConfigError(
                f"The course lasts {planned[-1].end:.4g} s; expected at most {LONGEST:g} s. Give its segments fewer "
                "seconds, and places that are nearer."
            )
        heading = HeadingCourse(planned, turning, give_way * turning.speed) if control_heading else None
        return cls(planned, limits, give_way * limits.speed, heading)

    @property
    def duration(self) -> float:
        """Of all segments [s]."""
        return self.segments[-1].end

    def steps(self, control_period: float) -> int:
        """Control periods that the course takes, of `control_period` [s] each."""
        return ceil(self.duration / control_period - _NEARLY)

    @property
    def turns(self) -> bool:
        """Whether it asks for another heading than that with which the robot was put."""
        return any(segment.target.heading != 0.0 for segment in self.segments)

    def target(self, time: float) -> Target:
        """What is asked for at a time [s]; after the end, what was asked for last."""
        return _at(self.segments, time).target._replace(heading=0.0)  # a turn alone changes nothing along the way


@dataclass(frozen=True)
class HeadingCourse:
    """The headings of a course, as targets of a reference of their own, in rad.

    Attributes:
        segments: of the course.
        limits: of the heading's reference.
        give_way: how far the robot may be from it before it gives way [rad].
    """

    segments: tuple[Segment, ...]
    limits: MotionLimits
    give_way: float

    def target(self, time: float) -> Target:
        """The heading that is asked for at a time [s]."""
        return Target(None, _at(self.segments, time).target.heading)


def _at(segments: tuple[Segment, ...], time: float) -> Segment:
    return next((segment for segment in segments if time < segment.end), segments[-1])


class _Plan:
    """Plans a course segment by segment, by a robot that is always where its reference is."""

    def __init__(self, limits: MotionLimits, turning: MotionLimits, wheel_radius: float) -> None:
        self._limits, self._turning, self._wheel_radius = limits, turning, wheel_radius
        self._motion, self._heading, self._time = Motion(), 0.0, 0.0
        self._planned: list[Segment] = []

    def of(self, segments: Sequence[Mapping[str, float]]) -> tuple[Segment, ...]:
        """All segments in order, with the times at which they begin and end."""
        for number, segment in enumerate(segments):
            _check(number, segment)
            if "turn" in segment:
                self._turn(segment)
            else:
                self._drive(self._target(number, segment), segment.get("seconds"))
        return tuple(self._planned)

    def _drive(self, target: Target, seconds: float | None) -> None:
        profile = target.profile(self._motion, self._limits)
        seconds = profile.duration if seconds is None else float(seconds)
        self._motion = profile.at(seconds)
        self._add(target, seconds)

    def _turn(self, segment: Mapping[str, float]) -> None:
        """On the spot: the robot comes to rest first, if it is not."""
        if self._motion.is_moving:
            self._drive(AT_REST._replace(heading=self._heading), None)
        begun = self._heading
        self._heading += radians(segment["turn"])
        needed = profile_to_position(Motion(begun), self._heading, self._turning).duration
        self._add(AT_REST._replace(heading=self._heading), float(segment.get("seconds", needed)))

    def _add(self, target: Target, seconds: float) -> None:
        self._planned.append(Segment(target, self._time, self._time + seconds))
        self._time += seconds

    def _target(self, number: int, segment: Mapping[str, float]) -> Target:
        """What a segment asks for; raises ConfigError where the robot may not drive so fast."""
        if "position" in segment or "radii" in segment:
            place = segment["position"] if "position" in segment else segment["radii"] * self._wheel_radius
            return Target(None, float(place), self._heading)
        speed = float(segment["speed"] if "speed" in segment else segment["share"] * self._limits.speed)
        if abs(speed) > self._limits.speed:
            raise ConfigError(
                f"Segment {number} of the course asks for {speed:g} m/s; the limit is {self._limits.speed:.3g} m/s. "
                "Give a higher course.speed_limit if the robot can drive so fast."
            )
        return Target(speed, heading=self._heading)


def _check(number: int, segment: Mapping[str, float]) -> None:
    """Raise ConfigError where a segment cannot be understood."""
    if set(segment) not in _SEGMENTS or not all(map(_is_number, segment.values())) or segment.get("seconds", 1) <= 0:
        raise ConfigError(
            f"Segment {number} of the course is {dict(segment)}; expected numbers for {{seconds, speed}}, {{seconds, "
            "share}, {seconds, position}, {seconds, radii} or {seconds, turn}, with seconds above 0; the last three "
            "may go without seconds."
        )


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and isfinite(value)
