"""What a robot can announce and measure; beyond it something is broken, and no motor is driven by it.

The ranges are generous on purpose: each lies several times beyond what two-wheeled robots do, from 30 g to 100 kg, and
beyond what their sensors can tell. `docs/protocol.md` has them as a table.
"""

import math
from collections.abc import Mapping
from functools import cache

from twbal.core.errors import ConfigError
from twbal.link.protocol import NEEDED, WATCHDOG, Clock, PoseReport, Sensors, Telemetry, Welcome

CONTROL_PERIOD_US = 500, 1_000_000
"""Shortest and longest control period that a robot may announce [µs]."""

REAL_TIME_PERIOD_US = 80_000
"""Longest control period in real time [µs]: two commands, a period apart, must come within the watchdog's 100 ms, and
line and host are not always equally late."""

MAX_TORQUE = 1000.0
"""Largest torque limit that a robot may announce [N·m]."""

MAX_VOLTAGE = 1000.0
"""Largest voltage of a motor that a robot may announce [V]."""

MAX_CLOCK_STEP_US = 10_000_000
"""How far a robot's clock may go from one telemetry that is used to the next [µs]."""

MAX_TIMEOUT = 3600.0
"""Longest time for which an answer may be waited for [s]."""

MAX_TRIAL = 2**32 - 1
"""Largest number of a rollout; it travels as 32 bits."""

MEASURED = {
    "tilt": (4 * math.pi, "rad"),
    "tilt_rate": (200.0, "rad/s"),  # gyros of hobby robots end at 35 rad/s
    "acceleration": (1000.0, "m/s²"),
    "wheel_angle": (1e6, "rad"),  # float32 resolves 0.06 rad there
    "wheel_rate": (5000.0, "rad/s"),
    "wheel_difference": (2e6, "rad"),
    "difference_rate": (10_000.0, "rad/s"),
    "yaw_rate": (200.0, "rad/s"),
    "heading": (1e4, "rad"),
    "battery": (MAX_VOLTAGE, "V"),
}
"""Largest size of each measured value, and its unit."""

POSE = {"x": (1e5, "m"), "y": (1e5, "m"), "heading": (1e4, "rad"), "tilt": (4 * math.pi, "rad")}
"""Largest size of each value of a true pose, and its unit; float32 resolves 8 mm at 100 km."""


def odd_announcement(welcome: Welcome) -> str:
    """What a robot announces that cannot be, as part of a sentence; empty where all can."""
    shortest, longest = CONTROL_PERIOD_US
    if not shortest <= welcome.control_period_us <= longest:
        return f"a control period of {welcome.control_period_us} µs (expected {shortest} to {longest})"
    if welcome.clock is Clock.REAL_TIME and welcome.control_period_us > REAL_TIME_PERIOD_US:
        return (
            f"a control period of {welcome.control_period_us} µs in real time (expected at most {REAL_TIME_PERIOD_US}: "
            f"a command comes once in a period, and its watchdog stops it {1e3 * WATCHDOG:g} ms after the last)"
        )
    if not 0 < welcome.torque_limit <= MAX_TORQUE:
        return f"a torque limit of {welcome.torque_limit:g} N·m (expected more than 0, at most {MAX_TORQUE:g})"
    if not 0 <= welcome.difference_limit <= 2 * MAX_TORQUE:
        return f"a limit of {welcome.difference_limit:g} N·m for the difference (expected 0 to {2 * MAX_TORQUE:g})"
    if not (math.isnan(welcome.voltage_limit) or 0 < welcome.voltage_limit <= MAX_VOLTAGE):
        return f"a voltage limit of {welcome.voltage_limit:g} V (expected NaN, or more than 0, at most {MAX_VOLTAGE:g})"
    if lacking := NEEDED & ~welcome.sensors:
        names = ", ".join(str(sensor.name).lower().replace("_", " ") for sensor in lacking)
        return f"no {names}, without which it cannot be balanced"
    return ""


def odd_values(seen: Telemetry | PoseReport, sensors: Sensors) -> str:
    """Which measured values cannot be, as part of a sentence; empty where all can.

    Args:
        seen: what the robot says.
        sensors: that it has; others are not looked at.
    """
    ranges = _measured_by(sensors) if isinstance(seen, Telemetry) else POSE
    if all([abs(getattr(seen, name)) <= most for name, (most, _) in ranges.items()]):  # not so of a NaN
        return ""
    values = {name: getattr(seen, name) for name in ranges}
    broken = [name for name, value in values.items() if not math.isfinite(value)]
    if broken:
        return f"values that are not finite numbers ({', '.join(broken)})"
    beyond = [
        f"{name} {values[name]:.3g} {unit}, at most {most:.4g}"
        for name, (most, unit) in ranges.items()
        if abs(values[name]) > most
    ]
    return f"values beyond what any robot does ({'; '.join(beyond)})"


@cache
def _measured_by(sensors: Sensors) -> Mapping[str, tuple[float, str]]:
    """The part of `MEASURED` that a robot with these sensors has; asked for in each control period."""
    return {name: most for name, most in MEASURED.items() if Sensors[name.upper()] & sensors}


def check_timeouts(**seconds: float) -> None:
    """Check times for which an answer is waited for.

    Raises:
        ConfigError: one is not positive, or so long that a silent robot would never be noticed.
    """
    for name, value in seconds.items():
        if not 0 < value <= MAX_TIMEOUT:
            raise ConfigError(f"link.{name} must be more than 0 and at most {MAX_TIMEOUT:g} s; found {value}.")
