"""The moving place that a robot follows in a rollout."""

import math
from typing import Protocol

from twbal.core.course import AT_REST, Target
from twbal.core.episode import Event
from twbal.core.motion_limits import MotionLimits
from twbal.core.motion_profile import Motion, profile_to_speed
from twbal.core.push_detector import PushDetector

_AHEAD = 0.3  # s; how far ahead the robot's distance is foreseen
_RETURNED = 0.5  # of the greatest distance: the robot has come back, and the reference goes on
_FREE, _FREE_TIME = 0.8, 1.0  # of that, s: a robot that stays nearer for so long is not held, and it goes on, too
LARGEST_SLIP = 0.5
"""Share of the speed limit by which a robot that is pushed may be faster or slower than its reference."""

FASTEST_TAKEN = 1.5
"""Times its speed limit that a reference on its way takes on at most, as a course may ask for little; faster wheels
slip. That of a robot that is to stand takes on its limit, as it has to come back."""


class Targets(Protocol):
    """Where a reference is to go: a course, or what else says so while the robot drives."""

    @property
    def limits(self) -> MotionLimits:
        """Of the reference's motion."""

    @property
    def give_way(self) -> float:
        """How far the robot may be from the reference before that gives way [m]."""

    def target(self, time: float) -> Target:
        """What is asked for at a time since the rollout began [s]."""


class Reference:
    """Moves to the targets within the limits, and gives way to a robot that cannot follow.

    Where the robot is farther behind than `give_way`, or soon will be, the reference goes to rest within its limits,
    and its place is dragged along so that the robot is no farther off. Once the robot has come back to half of that, or
    has stayed within four fifths of it for a second, the reference goes on to its target from where it is. So a robot
    that is held meets no growing error, and is not thrown over when it is let go; and one that needs the integral of
    its error to come nearer, as on a slope, gets it.

    A robot that overtakes a reference with a speed for its target is not held: only the place is dragged along. Going
    to rest, the reference would ask a robot that is too fast already to stop, which must then speed up again, and so
    on. On the way to a place it is so as long as the robot is far from that: farther than the reference needs to come
    to rest, and `give_way` beside. Nearer, the reference rests, if not told otherwise: a robot that balances has to
    lean back there, and comes to its place more surely from rest.

    A push (`PushDetector`) gives a robot a speed that its policy would brake at once, by a lean from which some robots
    fall. Where that is asked for, the reference takes on speed from it, until the robot is faster or slower by no more
    than `LARGEST_SLIP` of the speed limit. From there the reference goes on to its target within its limits, and the
    robot with it.

    Args:
        targets: where it goes.
        name: by which events speak of it.
        leads_all_the_way: whether a robot that overtakes it near its place is led on, too, as long as it is not there.
        most_taken: speed that it takes on at most from a robot that is pushed, in times its speed limit; 0: none.

    Attributes:
        motion: at the last observation.
        gives_way: whether it gives way.
        events: when it began to, and when it went on.
    """

    def __init__(
        self, targets: Targets, name: str = "reference", leads_all_the_way: bool = False, most_taken: float = 0.0
    ) -> None:
        self.motion = Motion()
        self._name = name
        self.gives_way = False
        self.events: list[Event] = []
        self._targets, self._leads_all_the_way, self._most_taken = targets, leads_all_the_way, most_taken
        self._pushes = PushDetector(targets.limits.speed)
        self._was_pushed = False
        self._goal: Target | None = None  # that the profile goes to
        self._profile = profile_to_speed(self.motion, 0.0, targets.limits)
        self._begun = 0.0  # time at which the profile begins [s]
        self._free_since = 0.0  # from which on the robot has been near enough not to be held [s]

    def follow(self, time: float, position: float, speed: float) -> Motion:
        """The reference at a time.

        Args:
            time: since the rollout began, no earlier than that of the call before [s].
            position: of the robot, from where it was put [m].
            speed: of the robot [m/s].
        """
        self.motion = self._profile.at(time - self._begun)
        target = self._targets.target(time)
        takes_speed = self._most_taken > 0.0 and self._take_speed(time, speed)
        off, slip = position - self.motion.position, speed - self.motion.speed
        is_dragged = self._give_way(time, off, slip, self._side_ahead(target, position)) or takes_speed
        goal = AT_REST if self.gives_way else target
        if is_dragged or goal != self._goal:
            self._goal, self._begun = goal, time
            self._profile = goal.profile(self.motion, self._targets.limits)
        return self.motion

    def _take_speed(self, time: float, speed: float) -> bool:
        """Take on speed from a robot that is pushed, by its speed [m/s]; returns whether it did."""
        is_pushed, was_pushed = self._pushes.follow(time, speed), self._was_pushed
        self._was_pushed = is_pushed
        if is_pushed and not was_pushed:
            self.events.append(Event(time, f"the {self._name} takes on speed from the robot, which is pushed"))
        limit, slip = self._targets.limits.speed, speed - self.motion.speed
        most, fastest = LARGEST_SLIP * limit, self._most_taken * limit
        if not is_pushed or abs(slip) <= most:
            return False
        taken = min(max(speed - math.copysign(most, slip), -fastest), fastest)  # wheels that slip are faster
        self.motion = Motion(self.motion.position, taken)
        return True

    def _side_ahead(self, target: Target, position: float) -> float:
        """Side, ±1, where a robot at `position` [m] overtakes the reference; 0: it rests for a robot on either side."""
        if not self.motion.is_moving:
            return 0.0
        side = math.copysign(1.0, self.motion.speed)
        if target.speed is not None:
            return side if target.speed else 0.0
        braking = self.motion.speed**2 / (2.0 * self._targets.limits.acceleration)  # way to rest, but for the jerk [m]
        near = 0.0 if self._leads_all_the_way else braking + self._targets.give_way
        return side if (target.position - position) * side > near else 0.0

    def _give_way(self, time: float, off: float, slip: float, ahead: float) -> bool:
        """Begin, go on with, or end giving way.

        Args:
            time: of the observation [s].
            off: of the robot, from the reference [m].
            slip: rate of that [m/s].
            ahead: see `_side_ahead`.

        Returns:
            Whether the place was dragged along.
        """
        most, farthest = self._targets.give_way, max(off, off + _AHEAD * slip, key=abs)
        if abs(farthest) > _FREE * most:
            self._free_since = time
        is_far, overtakes = abs(farthest) > most, farthest * ahead > 0.0
        if is_far and not overtakes:
            self._tell(time, True)
        elif self.gives_way and (is_far or abs(farthest) < _RETURNED * most or time - self._free_since > _FREE_TIME):
            self._tell(time, False)
        is_dragged = abs(off) > most
        if is_dragged:
            dragged = self.motion.position + off - min(max(off, -most), most)
            self.motion = self.motion._replace(position=dragged)
        return is_dragged

    def _tell(self, time: float, gives_way: bool) -> None:
        if gives_way != self.gives_way:
            self.gives_way = gives_way
            self.events.append(Event(time, f"the {self._name} {'gives way' if gives_way else 'goes on'}"))
