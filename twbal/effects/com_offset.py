"""A centre of mass in front of or behind the body's axis."""

from dataclasses import dataclass

from twbal.core.quantities import Quantity
from twbal.effects.effect import BodyEffect
from twbal.effects.parameter import adds_to, parameter


@dataclass(frozen=True)
class ComOffset(BodyEffect):
    """The centre of mass, seen from the axle, lies further in front by `angle`: the robot balances at tilt -angle.

    It acts on the body. A tilt sensor mounted askew by the same angle is exactly the same to the robot's sensors. Where
    the robot never turns round, so is a slope together with a constant torque.
    """

    angle: float = parameter(
        "from the body's axis to the centre of mass, positive forward",
        "rad",
        (-0.15, 0.15),
        start=0.02,
        value=0.035,
        least=-1.5,
        below=1.5,
        changes=adds_to(Quantity.COM_OFFSET),
    )
    reference = (
        "F. Grasser, A. D'Arrigo, S. Colombi, A. C. Rufer: JOE: a mobile, inverted pendulum, "
        "IEEE Transactions on Industrial Electronics 49 (1), 2002, 107-114."
    )
    same_as = ("imu_mount_angle",)
    nearly_same_as = ("imu_mount_angle",)
    separate_by = "Find the tilt at which the robot balances, and measure the IMU against the body."
