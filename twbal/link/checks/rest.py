"""What the sensors say of a robot that is held still."""

from math import degrees
from statistics import fmean, pstdev

from twbal.core.check import Check, CheckStatus, Measurement
from twbal.link.checks.telemetry_record import TelemetryRecord

_MOVED = 0.05  # tilt, from lowest to highest, beyond which it was not at rest [rad]
_TURNED = 0.1  # wheel angle, the same [rad]
_BIAS = 0.05  # of a gyro that was calibrated [rad/s]
_RATE_NOISE, _TILT_NOISE = 0.1, 0.01  # standard deviations [rad/s], [rad]
_ENOUGH = 20  # samples


def rest_check(rest: TelemetryRecord, is_held: bool) -> Check:
    """Bias and noise of the gyro, and noise of the tilt.

    Args:
        rest: recorded without torque.
        is_held: whether somebody holds the robot still; a virtual one falls.
    """
    name = "sensors at rest"
    tilt, rate = rest.values("tilt"), rest.values("tilt_rate")
    moved, turned = (max(values) - min(values) for values in (tilt, rest.values("wheel_angle")))
    if len(tilt) < _ENOUGH or moved > _MOVED or turned > _TURNED:
        found = f"it moved: tilt by {degrees(moved):.1f}°, wheels by {degrees(turned):.1f}°, in {len(tilt)} samples"
        if not is_held:
            return Check(name, CheckStatus.SKIPPED, f"{found}; nobody holds a virtual robot")
        return Check(
            name, CheckStatus.PROBLEM, found, "no motion", "Hold or clamp it still, near upright, wheels in the air."
        )
    bias, noise, wobble = fmean(rate), pstdev(rate), pstdev(tilt)
    found = (
        f"gyro bias {bias:+.4f} rad/s, noise {noise:.4f} rad/s; tilt {degrees(fmean(tilt)):+.2f}°, noise "
        f"{degrees(wobble):.3f}° ({len(tilt)} samples)"
    )
    measured = (
        Measurement("gyro bias", bias, "rad/s"),
        Measurement("gyro noise", noise, "rad/s"),
        Measurement("tilt noise", wobble, "rad"),
    )
    if abs(bias) > _BIAS:
        advice = "Let the firmware measure the gyro's bias at rest when it starts."
        return Check(name, CheckStatus.PROBLEM, found, f"a bias within {_BIAS:g} rad/s", advice)
    if noise > _RATE_NOISE or wobble > _TILT_NOISE:
        expected = f"noise within {_RATE_NOISE:g} rad/s and {degrees(_TILT_NOISE):.1f}°"
        return Check(name, CheckStatus.PROBLEM, found, expected, "Fasten the IMU; check its range and its filter.")
    if noise == 0.0:
        advice = "A real gyro's last digits change: is it read in each period?"
        return Check(name, CheckStatus.WARNING, found, "some noise", advice, measured)
    return Check(name, CheckStatus.OK, found, measured=measured)
