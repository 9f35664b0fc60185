"""What the sensors make of the twin's motion."""

from math import floor
from typing import NamedTuple

from twbal.core.compiled import kernel
from twbal.core.gaussian import Array
from twbal.planar.motion import TwinState
from twbal.planar.parameters import TwinParameters


class Reading(NamedTuple):
    """What is measured at an instant, without noise.

    Attributes:
        tilt: [rad].
        tilt_rate: [rad/s].
        wheel_angle: relative to the body [rad].
        wheel_rate: [rad/s].
    """

    tilt: float
    tilt_rate: float
    wheel_angle: float
    wheel_rate: float


@kernel()
def read_sensors(p: TwinParameters, s: TwinState, imu: Array, steps: int, step: float, lead: float) -> Reading:
    """Read the sensors.

    Between physics steps what the IMU sees is interpolated; before the rollout it saw what it sees at its start.

    Args:
        p: the twin.
        s: state now.
        imu: (N, 2), a ring: row i % N holds tilt and tilt rate after i physics steps, `steps` being now.
        steps: physics steps since the rollout began.
        step: of the physics [s].
        lead: time by which the integrator's angles run ahead of the truth [s]; 0 to read what the integrator has.
    """
    back = p.imu_delay_delay / step
    whole = floor(back)
    share = back - whole
    near, far = max(steps - whole, 0) % len(imu), max(steps - whole - 1, 0) % len(imu)
    tilt = (1.0 - share) * imu[near, 0] + share * imu[far, 0]
    rate = (1.0 - share) * imu[near, 1] + share * imu[far, 1]
    relative = s.wheel_speed - s.tilt_rate
    return Reading(
        tilt - lead * rate + p.imu_mount_angle_angle,
        p.gyro_scale_factor * rate + p.gyro_bias_rate,
        s.wheel - s.tilt - lead * relative,
        relative,
    )
