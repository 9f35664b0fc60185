"""Which robots yield to pushes."""

from twbal.core.mobility import com_speed_ratio
from twbal.core.robot_parameters import RobotParameters

MIN_COM_SPEED_RATIO = 0.5
"""Speed of the centre of mass, per speed of the axle, after a push at the axle, from which on a robot had better yield.
Of the packaged sheets, `balboa` and `tumbller` have 0.79, the others 0.2 to 0.4."""


def yields_to_pushes(asked: bool | None, robot: RobotParameters) -> bool:
    """Whether the reference of a robot takes on speed from it where it is pushed: as asked, or by its sheet.

    To brake, a robot must lean back. A push at the axle tips a body back whose centre of mass is high above the axle:
    it leans as it must, and yielding would waste that. Where the centre of mass is near the axle, the push carries the
    body along upright. Then the wheels must first run ahead to tip it, the faster the harder the policy brakes.
    """
    return com_speed_ratio(robot) > MIN_COM_SPEED_RATIO if asked is None else asked
