"""What each robot is asked to do."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import chain
from math import radians
from typing import NamedTuple

from twbal.core.course import Course
from twbal.core.motion_limits import MotionLimits
from twbal.core.robot_parameters import RobotParameters

PAPER_SPEEDS = (0.3, 0.5, 1.0)  # [m/s]
NO_LOAD_SHARES = (0.15, 0.3, 0.5)
NO_LOAD_SPEEDS = {"regbot": 2.16, "balboa": 0.85, "esp32": 1.19}
"""At which the published motors run without load [m/s], by the name of the sheet: half the sheet's torque limit over
back-EMF and friction of a wheel, times its radius (3.4e-3 and 0.047 N·m·s/rad, see conf/robot); esp32: a JGB37-520 of
1320 ticks a turn, 11 · 4 · 30, is that of 333 turns a minute."""
SLOPE = radians(2.0)
STEADY = 14.0  # for which a reference keeps a speed; the integral of a policy needs 5 s to settle after a ramp [s]
_REST = 2.0  # for which it rests after a ramp [s]
_BEFORE_PUSH, _AFTER_PUSH = 3.0, 3.0  # of driving at a steady speed [s]
_STAND = {"seconds": 3.0, "speed": 0.0}
_SIDE = 7.0  # of the square, of sheets other than `paper` [wheel radii]


class Push(NamedTuple):
    """A push of 0.1 s at the axle.

    Attributes:
        time: at which it begins [s].
        impulse: forward [N·s].
    """

    time: float
    impulse: float


class Task(NamedTuple):
    """A course, and what happens on it.

    Attributes:
        name: of it: `ramp`, `turns`, `square`, `push` or `slope`.
        choice: which of those, such as a speed.
        course: to drive.
        push: on the way; None: none.
        slope: of the ground, in place of the robot's own [rad]; None: that.
    """

    name: str
    choice: str
    course: Course
    push: Push | None = None
    slope: float | None = None


def tasks(sheet: RobotParameters) -> Iterator[Task]:
    """All tasks for the robots of a sheet."""
    speeds = asked_speeds(sheet)
    limit = max(MotionLimits.of_robot(sheet).speed, *speeds)
    for speed in speeds:
        way = [*_ramp(sheet, speed, limit), *_ramp(sheet, -speed, limit)]
        yield Task("ramp", f"{speed:.3g} m/s", _course(sheet, limit, [_STAND, *way]))
    turns = [_STAND, {"turn": 90.0}, _STAND, {"turn": -180.0}, _STAND]
    yield Task("turns", "90° and -180°", _course(sheet, limit, turns))
    yield Task("square", f"{square_side(sheet):.3g} m", _course(sheet, limit, _square(square_side(sheet))))
    forth = _course(sheet, limit, [_STAND, *_ramp(sheet, speeds[1], limit, _BEFORE_PUSH + _AFTER_PUSH)])
    for words, sign in (("forward", 1.0), ("backward", -1.0)):
        push = Push(forth.segments[1].end - _AFTER_PUSH, sign * sheet.body_mass)  # 10 N·s · mass / 10 kg
        yield Task("push", words, forth, push)
    there_and_back = [{"seconds": 8.0, "speed": 0.0}, {"radii": _SIDE}, _STAND, {"radii": 0.0}, _STAND]
    for words, sign in (("up", 1.0), ("down", -1.0)):
        yield Task("slope", words, _course(sheet, limit, there_and_back), slope=sign * SLOPE)


def asked_speeds(sheet: RobotParameters) -> tuple[float, ...]:
    """Of the ramps [m/s]."""
    if sheet.name == "paper":
        return PAPER_SPEEDS
    return tuple(share * NO_LOAD_SPEEDS[sheet.name] for share in NO_LOAD_SHARES)


def square_side(sheet: RobotParameters) -> float:
    """Of the square [m]."""
    return 1.0 if sheet.name == "paper" else _SIDE * sheet.wheel_radius


def _ramp(sheet: RobotParameters, speed: float, limit: float, steady: float = STEADY) -> list[Mapping[str, float]]:
    """Up to a speed, which is kept for `steady` [s], and to rest."""
    limits = MotionLimits.of_robot(sheet, limit)
    ramp = abs(speed) / limits.acceleration + limits.acceleration / limits.jerk  # with its rounded ends
    return [{"seconds": ramp + steady, "speed": speed}, {"seconds": ramp + _REST, "speed": 0.0}]


def _square(side: float) -> list[Mapping[str, float]]:
    sides = ([{"position": number * side}, _STAND, {"turn": 90.0}, _STAND] for number in range(1, 5))
    return [_STAND, *chain.from_iterable(sides)]


def _course(sheet: RobotParameters, limit: float, segments: Sequence[Mapping[str, float]]) -> Course:
    return Course.from_settings(sheet, segments, speed_limit=limit)
