"""Where a person's input sends the references of a drive."""

from collections.abc import Callable
from typing import NamedTuple

from twbal.core.course import Target
from twbal.core.episode import Ending, Event, Outcome
from twbal.core.heading import HeadingSample
from twbal.core.motion_limits import MotionLimits
from twbal.core.motion_profile import STILL, Motion
from twbal.core.plant import Observation
from twbal.steering.limits import SteeringLimits
from twbal.steering.request import Key, Steering, SteeringRequest, Sticks
from twbal.steering.source import Source

SETTLING = 2.0
"""How long the reference has been at rest before a drive ends [s]: the robot comes to rest a little later."""


class Moment(NamedTuple):
    """A drive at an observation.

    Attributes:
        seen: by the sensors.
        asked: by the person.
        reference: along the way.
        heading: what its control knows; None where nothing controls it.
        command: that acted until then [N·m].
    """

    seen: Observation
    asked: SteeringRequest
    reference: Motion
    heading: HeadingSample | None
    command: float


class SteeredCourse:
    """Targets that a person sets while the robot drives: reads the input once in each control period.

    Args:
        limits: of the references, and how keys are answered.
        source: of the input.
        seconds: after which the drive comes to its end [s]; None: when the person ends it.
        before_reading: called with each observation's time [s], such as to wait until it is that late.
        show: called with each moment, such as to tell it.

    Attributes:
        steering: what was asked for.
    """

    def __init__(
        self,
        limits: SteeringLimits,
        source: Source,
        seconds: float | None = None,
        before_reading: Callable[[float], None] = lambda time: None,
        show: Callable[[Moment], None] = lambda moment: None,
    ) -> None:
        self.steering = Steering(limits.response)
        self._limits, self._source, self._seconds = limits, source, seconds
        self._before_reading, self._show = before_reading, show
        self._begun = False
        self._moved = 0.0  # time at which a reference was last seen to move [s]

    @property
    def limits(self) -> MotionLimits:
        """Of the reference's motion."""
        return self._limits.driving

    @property
    def give_way(self) -> float:
        """How far the robot may be from the reference before that gives way [m]."""
        return self._limits.give_way

    @property
    def headings(self) -> "SteeredHeading":
        """Where the heading goes."""
        return SteeredHeading(self._limits, self.steering)

    @property
    def events(self) -> tuple[Event, ...]:
        """What was more than a key."""
        return tuple(self.steering.events)

    def target(self, time: float) -> Target:
        """The speed that is asked for at a time since the drive began [s], by the input so far."""
        self._before_reading(time)
        self._read(time)
        return Target(self.steering.asked.speed * self.limits.speed)

    def watch(
        self, seen: Observation, reference: Motion, heading: HeadingSample | None, command: float
    ) -> Ending | None:
        """Show the moment, and tell whether the drive ends at it."""
        self._show(Moment(seen, self.steering.asked, reference, heading, command))
        if self.steering.stopped:
            return Ending(Outcome.STOPPED, self.steering.stopped)
        speeds = reference.speed, reference.acceleration, heading.reference_rate if heading else 0.0
        if max(map(abs, speeds)) > STILL:
            self._moved = seen.time
        if self.steering.ending and seen.time - self._moved >= SETTLING:
            return Ending(Outcome.COMPLETED, f"{self.steering.ending}, and the reference came to rest")
        return None

    def _read(self, time: float) -> None:
        for what in self._source.read(time):
            if self._begun or what is Key.STOP:  # what was pressed before the robot was armed is not for it
                self.steering.take(time, what)
            elif isinstance(what, Sticks):
                self.steering.pass_over(what)
        self._begun = True
        self.steering.wait(time)
        if self._source.lost:
            self.steering.end(time, f"the {self._source.name} was lost")
        if self._seconds is not None and time >= self._seconds:
            self.steering.end(time, f"{self._seconds:g} s were over")


class SteeredHeading:
    """The yaw rate that a person asks for, as targets of the heading's reference, in rad.

    Args:
        limits: of the references.
        steering: what is asked for.
    """

    def __init__(self, limits: SteeringLimits, steering: Steering) -> None:
        self._limits, self._steering = limits, steering

    @property
    def limits(self) -> MotionLimits:
        """Of the heading's reference."""
        return self._limits.turning

    @property
    def give_way(self) -> float:
        """How far the heading may be from its reference before that gives way [rad]."""
        return self._limits.turning_give_way

    def target(self, time: float) -> Target:
        """The yaw rate that is asked for."""
        return Target(self._steering.asked.turn * self.limits.speed)
