"""Whether a small torque turns the wheels the right way, both of them, and after how long."""

from collections.abc import Sequence
from math import ceil, degrees, sqrt
from statistics import fmean, linear_regression, pstdev
from typing import NamedTuple

from twbal.core.check import Check, CheckStatus, Measurement
from twbal.link.checks.telemetry_record import TelemetryRecord
from twbal.link.protocol import VERSION, Clock, Sensors
from twbal.link.serial_plant import SerialPlant
from twbal.link.wheel_commands import WheelCommands

LONGEST_PULSE = 0.3
"""Of a pulse [s]."""

_MOTION = 0.01  # least angle that counts as motion [rad]
_SIGMAS = 6.0
_FEW = 3  # samples of a motion, below which its begin is not known
_EARLY = 1.0  # control periods by which the begin that is found may lie before the command
_ON_LINE = 4  # samples by which the begin of a motion is found
_LONG = 4.0  # control periods of dead time


class Pulse(NamedTuple):
    """The same stretch of time without and with a pulse; of a simulated robot with the same start and noise.

    Attributes:
        command: during the pulse [N·m].
        without: no torque.
        during: the pulse, which lasts to its end.
    """

    command: WheelCommands
    without: TelemetryRecord
    during: TelemetryRecord

    def moved(self, name: str) -> list[float]:
        """How much further a wheel value went by the pulse, at each instant that both have [rad]."""
        before, after = self.without.values(name), self.during.values(name)
        return [(b - after[0]) - (a - before[0]) for a, b in zip(before, after, strict=False)]

    def least(self, name: str) -> float:
        """What counts as motion, beyond the noise without torque [rad]."""
        values = self.without.values(name)
        bends = [a - 2 * b + c for a, b, c in zip(values, values[1:], values[2:], strict=False)]
        noise = pstdev(bends) / sqrt(6.0) if len(bends) > 1 else 0.0  # second differences have six times the variance
        return max(_MOTION, _SIGMAS * noise)


def pulse_commands(command: WheelCommands, seconds: float, period: float) -> list[WheelCommands]:
    """A pulse as commands, one each control period.

    Args:
        command: during it [N·m].
        seconds: how long it lasts, at most `LONGEST_PULSE` [s].
        period: control period [s].
    """
    return [command] * max(1, ceil(min(seconds, LONGEST_PULSE) / period - 1e-9))


def torque_check(plant: SerialPlant, pulse: Pulse) -> Check:
    """Whether a positive sum turns both wheels forward.

    Args:
        plant: the robot.
        pulse: of a positive sum.
    """
    name, turned = "torque sign", pulse.moved("wheel_angle")[-1]
    asked = f"{pulse.command.total:.3g} N·m"
    wheels = _each_wheel(plant, pulse, turned)
    found = f"{asked} turned {_turns_in_words(wheels)}"
    least, expected = pulse.least("wheel_angle"), "forward, both"
    if all(abs(angle) < least for angle in wheels.values()):
        alone = " Or does one of them run backward?" if len(wheels) == 1 else ""
        advice = f"Are the motors powered? Against dry friction, try a larger pulse=.{alone}"
        return Check(name, CheckStatus.PROBLEM, f"{found}: no motion", f"more than {degrees(least):.1f}°", advice)
    if all(angle < -least for angle in wheels.values()):
        advice = "Swap the leads of both motors, or their sign in the firmware; or the sign of the encoders is wrong."
        return Check(name, CheckStatus.PROBLEM, f"{found}: backward", expected, advice)
    if not all(angle > least for angle in wheels.values()):
        advice = " ".join(_against(wheel, angle, least) for wheel, angle in wheels.items() if not angle > least)
        return Check(name, CheckStatus.PROBLEM, found, expected, advice)
    return Check(name, CheckStatus.OK, found)


def dead_time_check(plant: SerialPlant, pulse: Pulse) -> Check:
    """How long after the command the wheels begin to move.

    A wheel at rest that gets a constant torque turns by θ = a (t - t₀)² / 2: the square root of its angle is a line,
    whose zero is the begin t₀ of the motion, whatever the wheel's inertia.

    Args:
        plant: the robot.
        pulse: of a positive sum.
    """
    least, began = pulse.least("wheel_angle"), _began(plant, pulse.during)
    moved = zip(pulse.during.elapsed(), map(abs, pulse.moved("wheel_angle")), strict=False)
    seen = [(time - began, sqrt(angle)) for time, angle in moved if angle > least][:_ON_LINE]
    larger = "Against dry friction, try a larger pulse=."
    if len(seen) < _FEW:
        return Check("dead time", CheckStatus.SKIPPED, "the wheels hardly moved", "", larger)
    line = linear_regression(*zip(*seen, strict=True))
    late = -line.intercept / line.slope if line.slope > 0 else -1.0
    off = _error_of_zero(seen, line.slope, line.intercept) if late >= 0.0 else 0.0
    if late < -_EARLY * plant.control_period or off > plant.control_period:
        found = f"the wheels began to move too slowly to tell: they were seen to move after {seen[0][0] * 1e3:.0f} ms"
        return Check("dead time", CheckStatus.SKIPPED, found, "", larger)
    late = max(late, 0.0)
    periods = late / plant.control_period
    found = (
        f"{late * 1e3:.0f} ms, {periods:.1f} control periods, from the command to the wheels' motion, which was seen "
        f"after {seen[0][0] * 1e3:.0f} ms"
    )
    measured = (Measurement("dead time", late, "s"),)
    if periods > _LONG:
        advice = "Balancing needs less: look for filters, slow motor drivers and a busy line."
        return Check("dead time", CheckStatus.WARNING, found, f"at most {_LONG:g} control periods", advice, measured)
    return Check("dead time", CheckStatus.OK, found, measured=measured)


def _error_of_zero(points: Sequence[tuple[float, float]], slope: float, intercept: float) -> float:
    """Standard error of where a line that was fitted to points is 0, in the unit of their first coordinate."""
    times = [time for time, _ in points]
    middle, zero = fmean(times), -intercept / slope
    left = sum((value - intercept - slope * time) ** 2 for time, value in points) / max(len(points) - 2, 1)
    spread = sum((time - middle) ** 2 for time in times)
    return sqrt(left * (1.0 / len(points) + (zero - middle) ** 2 / spread)) / slope


def turning_check(pulse: Pulse) -> Check:
    """Whether a positive difference turns the right wheel ahead of the left one.

    Args:
        pulse: of a positive difference.
    """
    apart, least = pulse.moved("wheel_difference")[-1], pulse.least("wheel_difference")
    found = f"{pulse.command.difference:.3g} N·m turned the right wheel {degrees(apart):+.0f}° ahead of the left one"
    if abs(apart) < least:
        advice = "Against dry friction, try a larger pulse=."
        return Check("difference sign", CheckStatus.PROBLEM, f"{found}: no motion", "ahead", advice)
    if apart < 0:
        advice = "Left and right are swapped, of the motors or of the encoders."
        return Check("difference sign", CheckStatus.PROBLEM, found, "ahead", advice)
    return Check("difference sign", CheckStatus.OK, found)


def _each_wheel(plant: SerialPlant, pulse: Pulse, mean: float) -> dict[str, float]:
    """Angle by which each wheel turned [rad]; both as one where the robot does not tell them apart."""
    if not plant.sensors & Sensors.WHEEL_DIFFERENCE:
        return {"the wheels": mean}
    half = pulse.moved("wheel_difference")[-1] / 2
    return {"the left wheel": mean - half, "the right wheel": mean + half}


def _against(wheel: str, angle: float, least: float) -> str:
    """What to do with one wheel that does not turn forward, as a sentence."""
    if angle < -least:
        return (
            f"Swap the leads of the motor of {wheel}, or its sign in the firmware; or, where you see it run forward, "
            "the sign of its encoder."
        )
    return f"Of {wheel}, which does not turn, check motor, leads and encoder."


def _turns_in_words(wheels: dict[str, float]) -> str:
    return ", ".join(f"{name} by {degrees(angle):+.1f}°" for name, angle in wheels.items())


def _began(plant: SerialPlant, recording: TelemetryRecord) -> float:
    """When the robot took the first command, since arming [s]; 0 where it does not say."""
    seen: Sequence[object] = recording.seen
    if plant.clock is Clock.LOCKSTEP or plant.version != VERSION or len(seen) < 2:
        return 0.0
    return ((recording.seen[1].command_us - recording.seen[0].time_us) % 2**32) * 1e-6
