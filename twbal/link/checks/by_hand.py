"""Signs and scales of tilt, wheels and yaw rate, by a person who moves the robot at a command of exactly 0.

There no robot may drive a wheel, whatever it believes of its counts and gears (docs/protocol.md).
"""

from collections.abc import Callable, Sequence
from math import degrees, inf, pi, tau
from typing import NamedTuple

from twbal.core.check import Check, CheckStatus
from twbal.link.checks.telemetry_record import TelemetryRecord, record
from twbal.link.protocol import Sensors
from twbal.link.serial_plant import SerialPlant
from twbal.link.version_1 import VERSION_1
from twbal.link.wheel_commands import WheelCommands

SIGNS_BY_HAND = "signs by hand"
"""The row in place of those of the motions, where nobody makes them."""


class Helper(NamedTuple):
    """The person who holds the robot.

    Attributes:
        ask: tells what to do once the key is pressed, and returns when it is.
        again: shows what a motion came to, and says whether it is made once more.
        tell: shows a line.
    """

    ask: Callable[[str], None]
    again: Callable[[str], bool]
    tell: Callable[[str], None]


_LEAST_LEAN, _LEAST_TURN = 0.09, 0.5  # motion by which a sign is told [rad]
_RATIO = 0.7, 1.4  # of an angle's change to the integral of its rate
_TURN_RATIO = 0.75, 1.25  # of the angle of a turn by hand to a whole turn
_QUARTER_RATIO = 0.5, 1.5  # of the angle by which a robot was turned to a quarter turn


def by_hand_checks(plant: SerialPlant, seconds: float, helper: Helper) -> list[Check]:
    """Have the body leaned, each wheel and the robot turned, and compare signs; what came of each is told at once.

    Args:
        plant: the robot, held.
        seconds: that each motion may take [s].
        helper: makes it, and once more where it came to a problem and that person says so.

    Raises:
        LinkError: it does not arm, falls silent, or does not confirm that it has stopped.
    """
    count = round(seconds / plant.control_period)

    def watched(what: str) -> TelemetryRecord:
        helper.ask(f"Within {seconds:g} s after Enter: {what}")
        return record(plant, [WheelCommands(0.0)] * count)

    def tried(what: str, judge: Callable[[TelemetryRecord], Check]) -> Check:
        while (check := judge(watched(what))).verdict is CheckStatus.PROBLEM:
            if not helper.again(check.line(0)):
                return check
        helper.tell(check.line(0))
        return check

    turn = "wheel FORWARD by one whole turn, the body still"
    checks = [
        tried("lean the body FORWARD by about 20°, and keep it there", lean_check),
        tried(f"turn the LEFT {turn}", lambda seen: turn_check(plant, seen, "left")),
        tried(f"turn the RIGHT {turn}", lambda seen: turn_check(plant, seen, "right")),
    ]
    if Sensors.YAW_RATE in plant.sensors:
        quarter = "turn the whole robot TO THE LEFT by a quarter turn, seen from above, and keep it there"
        checks.append(tried(quarter, lambda seen: yaw_check(plant, seen)))
    return checks


def lean_check(lean: TelemetryRecord) -> Check:
    """Whether tilt and tilt rate are positive forward, and agree.

    Args:
        lean: recorded while the body was leaned forward.
    """
    name, expected = "tilt sign", "forward is positive, and the tilt is the integral of its rate"
    tilt, bias = lean.values("tilt"), lean.values("tilt_rate")[0]
    at = _farthest(tilt)
    change, integral = tilt[at] - tilt[0], _integral(lean, "tilt_rate", at)
    found = f"the tilt changed by {degrees(change):+.1f}°, its rate adds up to {degrees(integral):+.1f}°"
    if abs(change) < _LEAST_LEAN and abs(integral) < _LEAST_LEAN:
        return Check(
            name, CheckStatus.PROBLEM, found, expected, "Did you lean it? Once more; else check the IMU's axes."
        )
    if change < 0 and integral < 0:
        return Check(name, CheckStatus.PROBLEM, found, expected, "Turn the sign of both, or the IMU, around.")
    if not _RATIO[0] <= (change / integral if integral else inf) <= _RATIO[1]:
        advice = f"Check sign, axis, unit and range of gyro and accelerometer (rate at the start: {bias:+.3f} rad/s)."
        return Check(name, CheckStatus.PROBLEM, found, expected, advice)
    return Check(name, CheckStatus.OK, found)


def turn_check(plant: SerialPlant, turn: TelemetryRecord, side: str) -> Check:
    """Whether the angle of one wheel is positive forward, of the right size, and that of this wheel.

    Args:
        plant: the robot.
        turn: recorded while that wheel was turned forward by a whole turn.
        side: `left` or `right`.
    """
    name, expected = f"{side} wheel sign", f"forward is positive, and the {side} wheel turns by 360°"
    mean = turn.values("wheel_angle")
    at = _farthest(mean)
    change, integral = mean[at] - mean[0], _integral(turn, "wheel_rate", at)
    wheels = _sides(plant, turn, at, change)
    found = ", ".join(f"the {which} wheel turned by {degrees(angle):+.0f}°" for which, angle in wheels.items())
    own = wheels.get(side, 2.0 * change)
    if max(map(abs, wheels.values())) < _LEAST_TURN:
        return Check(name, CheckStatus.PROBLEM, found, expected, "Did you turn it? Once more; else check the encoder.")
    if abs(own) < max(map(abs, wheels.values())) / 2:
        advice = f"Was it the {side} wheel that you turned, as seen from behind? If so, swap left and right encoder."
        return Check(name, CheckStatus.PROBLEM, found, expected, advice)
    if own < 0:
        return Check(name, CheckStatus.PROBLEM, found, expected, "Swap the encoder's channels, or its sign.")
    if not _RATIO[0] <= (change / integral if integral else inf) <= _RATIO[1]:
        off = f"{found}; its rate adds up to {degrees(2.0 * integral):+.0f}°"
        return Check(name, CheckStatus.PROBLEM, off, expected, "Check sign, unit and filter of the wheel rates.")
    if not _TURN_RATIO[0] <= own / tau <= _TURN_RATIO[1]:
        advice = "If you turned it once: check ticks a turn, and the gear's ratio."
        return Check(name, CheckStatus.WARNING, found, expected, advice)
    return Check(name, CheckStatus.OK, found)


def yaw_check(plant: SerialPlant, turn: TelemetryRecord) -> Check:
    """Whether the yaw rate is positive to the left, and adds up to the angle.

    Args:
        plant: the robot.
        turn: recorded while the robot was turned to the left by a quarter turn.
    """
    name, expected = "yaw rate sign", "to the left is positive, and it adds up to 90°"
    if plant.version == VERSION_1 and not any(turn.values("yaw_rate")):  # which cannot say that it does not measure it
        return Check(name, CheckStatus.SKIPPED, "it is always 0: the robot does not measure it")
    angle = _integral(turn, "yaw_rate", len(turn.seen) - 1)
    found = f"the yaw rate adds up to {degrees(angle):+.0f}° (at first it was {turn.values('yaw_rate')[0]:+.3f} rad/s)"
    if abs(angle) < _LEAST_TURN:
        return Check(
            name, CheckStatus.PROBLEM, found, expected, "Did you turn it? Once more; else check the gyro's axes."
        )
    if angle < 0:
        return Check(name, CheckStatus.PROBLEM, found, expected, "Turn the sign of the yaw rate around.")
    if angle > 2.0 * pi:
        return Check(name, CheckStatus.PROBLEM, found, expected, "Check the gyro's unit: it must be rad/s.")
    if not _QUARTER_RATIO[0] <= angle / (pi / 2) <= _QUARTER_RATIO[1]:
        advice = "If it was a quarter turn: check the gyro's unit and range."
        return Check(name, CheckStatus.WARNING, found, expected, advice)
    return Check(name, CheckStatus.OK, found)


def _farthest(values: Sequence[float]) -> int:
    """Where a value is farthest from its first."""
    return max(range(len(values)), key=lambda k: abs(values[k] - values[0]))


def _integral(recording: TelemetryRecord, rate: str, to: int) -> float:
    """Of a rate, by trapezoids, from the arming to an instant."""
    times, rates = recording.elapsed(), recording.values(rate)
    return sum((times[k] - times[k - 1]) * (rates[k] + rates[k - 1]) / 2 for k in range(1, to + 1))


def _sides(plant: SerialPlant, turn: TelemetryRecord, at: int, mean: float) -> dict[str, float]:
    """By which angle each wheel turned [rad]; where the robot does not tell them apart, as if one alone had."""
    apart = turn.values("wheel_difference")
    half = (apart[at] - apart[0]) / 2
    sends_mean = plant.version == VERSION_1 and half == 0.0  # which cannot say that it does not know the difference
    if sends_mean or not plant.sensors & Sensors.WHEEL_DIFFERENCE:
        return {"turned": 2.0 * mean}
    return {"left": mean - half, "right": mean + half}
