"""Motion along a line with limited speed, acceleration and jerk.

The fastest way from one speed to another holds the jerk at ± its limit, with a stretch of constant acceleration between
where that limit is met. The way to a place goes to some speed, keeps it, and goes to rest. This is the scheme of
Haschke, Weitnauer and Ritter, On-line planning of time-optimal, jerk-limited trajectories, IROS 2008; see also Kröger,
On-Line Trajectory Generation in Robotic Systems, 2010. All phases are cubic in time, so limits hold at every instant.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import copysign, sqrt
from typing import NamedTuple

from scipy.optimize import brentq

from twbal.core.motion_limits import MotionLimits

_ROUNDING = 1e-12  # of a place [m] or a speed [m/s]
STILL = 1e-9
"""A speed [m/s] or an acceleration [m/s²] of no more than this is none, but for rounding; in rad for angles."""


class Motion(NamedTuple):
    """Where something is on a line, and how it moves.

    Attributes:
        position: [m].
        speed: [m/s].
        acceleration: [m/s²].
    """

    position: float = 0.0
    speed: float = 0.0
    acceleration: float = 0.0

    @property
    def is_moving(self) -> bool:
        """Whether it has a speed."""
        return abs(self.speed) > STILL

    def after(self, time: float, jerk: float) -> "Motion":
        """The motion after `time` [s] of constant jerk [m/s³]."""
        position, speed, acceleration = self
        return Motion(
            position + time * (speed + time * (acceleration / 2 + time * jerk / 6)),
            speed + time * (acceleration + time * jerk / 2),
            acceleration + time * jerk,
        )


class Phase(NamedTuple):
    """A time of constant jerk.

    Attributes:
        duration: [s].
        jerk: [m/s³].
    """

    duration: float
    jerk: float


@dataclass(frozen=True)
class MotionProfile:
    """A motion over time; after its last phase it goes on with the acceleration that it has then, which is 0.

    Attributes:
        start: the motion at time 0.
        phases: what follows.
    """

    start: Motion
    phases: Sequence[Phase]

    @property
    def duration(self) -> float:
        """Of all phases [s]."""
        return sum(phase.duration for phase in self.phases)

    def at(self, time: float) -> Motion:
        """The motion at a time of 0 or more [s]."""
        motion = self.start
        for phase in self.phases:
            if time <= phase.duration:
                return motion.after(time, phase.jerk)
            motion, time = motion.after(*phase), time - phase.duration
        return Motion(motion.position + time * motion.speed, motion.speed)

    @property
    def end(self) -> Motion:
        """The motion after the last phase."""
        return self.at(self.duration)


def profile_to_speed(start: Motion, speed: float, limits: MotionLimits) -> MotionProfile:
    """The fastest way to a speed [m/s], which is cut to the limit; it ends without acceleration.

    Args:
        start: within the limits, and such that the speed limit can still be kept.
        speed: to go to.
        limits: of the motion.
    """
    target = min(max(speed, -limits.speed), limits.speed)
    jerk, now = limits.jerk, start.acceleration
    direction = copysign(1.0, target - (start.speed + now * abs(now) / (2 * jerk)))  # from the speed of levelling off
    now, gain = direction * now, direction * (target - start.speed)  # seen along that direction
    peak = sqrt(max(jerk * gain + now**2 / 2, 0.0))
    held = 0.0
    if peak > limits.acceleration:
        peak = limits.acceleration
        held = (gain - (2 * peak**2 - now**2) / (2 * jerk)) / peak
    steep = direction * jerk
    rise = max(peak - now, 0.0) / jerk
    return MotionProfile(start, (Phase(rise, steep), Phase(held, 0.0), Phase(peak / jerk, -steep)))


def profile_to_position(start: Motion, position: float, limits: MotionLimits) -> MotionProfile:
    """A way to a place [m] that ends there at rest; the fastest where it begins at rest.

    The place where the motion ends grows with the speed that it goes to before it stops, so that speed is found between
    the two limits; beyond them the speed is kept for some time.
    """

    def way(speed: float, kept: float = 0.0) -> MotionProfile:
        going = profile_to_speed(start, speed, limits)
        keeping = MotionProfile(going.start, (*going.phases, Phase(kept, 0.0)))
        stopping = profile_to_speed(going.end, 0.0, limits)
        return MotionProfile(start, (*keeping.phases, *stopping.phases))

    def beyond(speed: float) -> float:
        return way(speed).end.position - position

    for speed in (-limits.speed, limits.speed):
        short = -beyond(speed) / speed
        if short >= 0:
            return way(speed, short)
    return way(float(brentq(beyond, -limits.speed, limits.speed, xtol=_ROUNDING)))
