"""Motors of unequal strength."""

from dataclasses import dataclass

from twbal.core.quantities import Quantity
from twbal.effects.effect import DriveEffect
from twbal.effects.parameter import adds_to, parameter


@dataclass(frozen=True)
class UnequalMotors(DriveEffect):
    """The right motor gives 1 + `share` times the torque of the mean of both, the left one 1 - `share` times.

    So each command turns the robot, to the left where the right motor is the stronger one. Along its way nothing
    changes: the planar model, which drives straight ahead, does without it. A diagnosis tells it from the yaw rate.
    """

    share: float = parameter(
        "by which the right motor is stronger than the mean of both",
        "",
        (-0.4, 0.4),
        start=0.05,
        value=0.1,
        least=-1.0,
        below=1.0,
        changes=adds_to(Quantity.IMBALANCE),
    )
    reference = (
        "J. Borenstein, L. Feng: Measurement and correction of systematic odometry errors in mobile robots, IEEE "
        "Transactions on Robotics and Automation 12 (6), 1996, 869-880."
    )
    is_linear = True
    diagnosed_separately = True
    separate_by = "Lift the robot and compare how fast both wheels come up to speed under the same command."
