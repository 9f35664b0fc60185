"""What the telemetry of a robot says: what it measured, and why its motors are off."""

import math

from twbal.core.plant import Observation
from twbal.link.message import Message
from twbal.link.protocol import Sensors, Status, Telemetry
from twbal.link.version_1 import VERSION_1


def observation_of(seen: Telemetry, sensors: Sensors, time: float) -> Observation:
    """What a robot measured.

    Args:
        seen: its telemetry.
        sensors: those that it has; what it does not measure is 0.
        time: since the rollout began [s].
    """
    return Observation(
        time=time,
        tilt=seen.tilt,
        tilt_rate=seen.tilt_rate,
        acceleration=seen.acceleration if sensors & Sensors.ACCELERATION else 0.0,
        wheel_angle=seen.wheel_angle,
        wheel_rate=seen.wheel_rate,
        yaw_rate=seen.yaw_rate if sensors & Sensors.YAW_RATE else 0.0,
    )


def is_telemetry(answer: Message) -> bool:
    """Whether an answer is telemetry."""
    return isinstance(answer, Telemetry)


def says_off(answer: Message) -> bool:
    """Whether an answer is telemetry of a robot whose motors are off."""
    return isinstance(answer, Telemetry) and not answer.status & Status.ARMED


def why_stopped(seen: Telemetry) -> str:
    """Why the motors are off, as part of a sentence."""
    if seen.status & Status.TILT_STOPPED:
        return f"its tilt of {math.degrees(seen.tilt):.0f}° is beyond its own limit"
    if seen.status & Status.SENSOR_STOPPED:
        values = {name: getattr(seen, name) for name in ("tilt", "tilt_rate", "wheel_angle", "wheel_rate")}
        broken = [name.replace("_", " ") for name, value in values.items() if not math.isfinite(value)]
        which = f" ({', '.join(broken)})" if broken else ""
        return f"a sensor that it is balanced by fell silent, or said what is no number{which}"
    if seen.status & Status.WATCHDOG_STOPPED:
        return "it had no command for too long (its watchdog)"
    return "it was stopped at its own side"


def advice_on_arming(seen: Telemetry) -> str:
    """What to do with a robot that does not arm, as a sentence."""
    if seen.status & Status.SENSOR_STOPPED:
        return "Are its IMU and its encoders plugged in?"
    if seen.status & Status.WATCHDOG_STOPPED:
        return "Is this computer busy, or the line slow? `twbal doctor` and `twbal check-link` look at both."
    return "Place it at its start."


def advice_on_silence(before: Telemetry, seen: Telemetry, version: int) -> str:
    """What to do where the watchdog stopped a robot; empty where something else did.

    Args:
        before: the telemetry that the host answered too late.
        seen: the one that says that the motors are off.
        version: of the protocol; in version 1 a robot does not say when it took the last command.
    """
    if not seen.status & Status.WATCHDOG_STOPPED:
        return ""
    if version == VERSION_1:
        since, silence = before.time_us, "passed until a measurement was answered"
    else:
        since, silence = seen.command_us, "passed from the last command that it took to the next one"
    passed = (seen.time_us - since) % 2**32 * 1e-3
    return (
        f" By its clock {passed:.0f} ms {silence}. If the line is sound, the host was late: close other programs, or "
        "allow real-time priority (`twbal doctor` says how)."
    )
