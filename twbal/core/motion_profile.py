"""Motion along a line with limited speed, acceleration and jerk.

The fastest way from one speed to another holds the jerk at ± its limit, with a stretch of constant acceleration between
where that limit is met. The way to a place goes to some speed, keeps it, and goes to rest. This is the scheme of
Haschke, Weitnauer and Ritter, On-line planning of time-optimal, jerk-limited trajectories, IROS 2008; see also Kröger,
On-Line Trajectory Generation in Robotic Systems, 2010. All phases are cubic in time, so limits hold at every instant.
"""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import copysign, inf, sqrt
from typing import NamedTuple

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
    return way(zero_between(-limits.speed, limits.speed, beyond))


def zero_between(low: float, high: float, function: Callable[[float], float]) -> float:
    """Where a function is 0 between two arguments at which it has different signs, to `_ROUNDING`.

    This is Brent's method, with the same result as `scipy.optimize.brentq` to the last bit. That takes a third of a
    second to load, and every command needs this module.
    """
    before, now, across = low, high, low  # the last two, and the last one at which the sign is another than now
    at_before, at_now, at_across = function(before), function(now), 0.0
    if at_before == 0.0:
        return before
    last = step = 0.0
    while at_now != 0.0:
        if at_before != 0.0 and (at_before < 0.0) != (at_now < 0.0):
            across, at_across, last, step = before, at_before, now - before, now - before
        if abs(at_across) < abs(at_now):
            before, now, across = now, across, now
            at_before, at_now, at_across = at_now, at_across, at_now
        least, half = (_ROUNDING + 4 * sys.float_info.epsilon * abs(now)) / 2, (across - now) / 2
        if abs(half) < least:
            break
        tried = inf
        if abs(last) > least and abs(at_now) < abs(at_before):
            if before == across:  # by the secant
                tried = -at_now * (now - before) / (at_now - at_before)
            else:  # by an inverse parabola
                rise, other = (at_before - at_now) / (before - now), (at_across - at_now) / (across - now)
                below = other * rise * (at_across - at_before)
                tried = -at_now * (at_across * other - at_before * rise) / below if below else inf
        last, step = (step, tried) if 2 * abs(tried) < min(abs(last), 3 * abs(half) - least) else (half, half)
        before, at_before = now, at_now
        now += step if abs(step) > least else copysign(least, half)
        at_now = function(now)
    return now
