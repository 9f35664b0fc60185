"""What the acceleration of a reference needs of a robot, told ahead so that it need not fall behind to get it.

For small leans and without friction the equations of motion of docs/notation.md, a φ̈ + b θ̈ = u and
b φ̈ + c θ̈ - m g l θ = -u, add up to d²/dt² ((a + b) φ + (b + c) θ) = m g l θ. What stands in the outer brackets is a
flat output: its derivatives tell lean, way and torque (Fliess, Lévine, Martin and Rouchon, Flatness and defect of
non-linear systems, International Journal of Control 61, 1995). So a point at the height r (b + c) / (a + b) above the
axle moves as the reference does, with acceleration v̇, if

    θ = (a + b) v̇ / (r m g l),  the axle is r (b + c) / (a + b) θ behind it,  and  u = a v̇ / r

but for θ̈, which is 0 while the acceleration grows or falls at a steady rate, as that of a jerk-limited reference does.
"""

from math import radians
from typing import NamedTuple, Self

from twbal.core.mobility import falling_time, inertias, leaning_acceleration
from twbal.core.motion_limits import RAMP_TIME
from twbal.core.robot_parameters import GRAVITY, RobotParameters

LARGEST_LEAN = radians(20.0)
"""Four times that of a course within the sheet's limits, twice that of a robot that comes back from a push [rad]. What
needs more is a jump, as of a reference that comes to rest on a robot whose host has fallen silent, and is left to the
policy."""


class FeedForwardOffset(NamedTuple):
    """State and torque that go with a reference's acceleration; all 0 where that keeps its speed.

    Attributes:
        tilt: [rad].
        tilt_rate: [rad/s].
        acceleration: [m/s²].
        position: of the axle, from that of the reference [m].
        speed: likewise [m/s].
        torque: of both wheels [N·m].
    """

    tilt: float = 0.0
    tilt_rate: float = 0.0
    acceleration: float = 0.0
    position: float = 0.0
    speed: float = 0.0
    torque: float = 0.0


NO_OFFSET = FeedForwardOffset()


class FeedForward(NamedTuple):
    """What a robot's sheet tells of it.

    Attributes:
        lean: per acceleration, (a + b) / (r m g l) [rad·s²/m].
        height: by which the axle is behind per lean, r (b + c) / (a + b) [m].
        torque: per acceleration, a / r [kg·m].
        acceleration: largest that is fed forward [m/s²].
        jerk: likewise [m/s³].
    """

    lean: float
    height: float
    torque: float
    acceleration: float
    jerk: float

    @classmethod
    def of_robot(cls, robot: RobotParameters) -> Self:
        """That of a robot's sheet."""
        a, b, c = inertias(robot)
        largest = leaning_acceleration(robot, LARGEST_LEAN)
        return cls(
            lean=(a + b) / (robot.wheel_radius * robot.body_mass * GRAVITY * robot.com_height),
            height=robot.wheel_radius * (b + c) / (a + b),
            torque=a / robot.wheel_radius,
            acceleration=largest,
            jerk=largest / (RAMP_TIME * falling_time(robot)),
        )

    def offset(self, acceleration: float, jerk: float) -> FeedForwardOffset:
        """For an acceleration [m/s²] and its rate [m/s³]."""
        if acceleration == jerk == 0.0:
            return NO_OFFSET
        acceleration = acceleration if abs(acceleration) <= self.acceleration else 0.0
        jerk = jerk if abs(jerk) <= self.jerk else 0.0
        tilt, rate = self.lean * acceleration, self.lean * jerk
        return FeedForwardOffset(
            tilt, rate, acceleration, -self.height * tilt, -self.height * rate, self.torque * acceleration
        )


NO_FEED_FORWARD = FeedForward(0.0, 0.0, 0.0, 0.0, 0.0)
"""Of a robot that is told of place and speed alone."""


def added(command: float, torque: float, most: float) -> float:
    """A policy's command with the torque of an offset, within ± `most` [N·m]."""
    return command if torque == 0.0 else min(max(command + torque, -most), most)


class FeedForwardGenerator:
    """Makes the offsets of a rollout from the speeds of its reference, as they come.

    The acceleration is the difference of the last two speeds over their time, the jerk that of the last two
    accelerations: a policy on board of the robot is told no more than place and speed, and does the same.

    Args:
        feed_forward: of the robot's sheet.

    Attributes:
        offsets: of all observations so far.
    """

    def __init__(self, feed_forward: FeedForward) -> None:
        self.offsets: list[FeedForwardOffset] = []
        self._feed_forward = feed_forward
        self._speed = self._acceleration = 0.0

    def follow(self, speed: float, duration: float) -> FeedForwardOffset:
        """Take the reference's next speed.

        Args:
            speed: [m/s].
            duration: since the one before [s]; 0 at the first.
        """
        acceleration = (speed - self._speed) / duration if duration > 0.0 else 0.0
        jerk = (acceleration - self._acceleration) / duration if duration > 0.0 else 0.0
        self._speed, self._acceleration = speed, acceleration
        self.offsets.append(self._feed_forward.offset(acceleration, jerk))
        return self.offsets[-1]
