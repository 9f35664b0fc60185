"""Whether the robot on a link is that of a data sheet, before it is armed."""

from collections.abc import Sequence

from twbal.core.check import Check, CheckStatus
from twbal.core.errors import ConfigError
from twbal.core.plant import Plant
from twbal.core.robot_parameters import RobotParameters
from twbal.link.protocol import Sensors
from twbal.link.serial_plant import SerialPlant

_OTHER_ROBOT = 3.0  # factor between two torque limits beyond which they are hardly of one robot


def is_of_another(limit: float, robots_limit: float) -> bool:
    """Whether the torque limit of a sheet is so far from that of a robot that it is hardly this robot's [N·m]."""
    return not robots_limit / _OTHER_ROBOT <= limit <= robots_limit * _OTHER_ROBOT


def limit_check(plant: SerialPlant, robot: RobotParameters) -> Check:
    """Whether the sheet can be that of the robot, and the robot's torque limit in N·m, before the robot is tried.

    Args:
        plant: the robot.
        robot: its sheet.
    """
    found = f"{robot.name!r}, torque limit {robot.torque_limit:g} N·m"
    if not is_of_another(robot.torque_limit, plant.torque_limit):
        return Check("sheet", CheckStatus.OK, found)
    advice = "It is hardly this robot's: choose its own by --config-dir=<folder> robot=<name>."
    if plant.torque_limit > robot.torque_limit:
        advice = f"{advice} Or does the firmware announce its limit in another unit than N·m?"
    return Check("sheet", CheckStatus.PROBLEM, found, f"about the robot's, {plant.torque_limit:g} N·m", advice)


def is_beyond(torque: float, limit: float) -> bool:
    """Whether a sheet's torque limit is more than a robot's, by more than single precision rounds [N·m]."""
    return not limit >= torque * (1 - 1e-6)


def check_robot(plant: Plant, robot: RobotParameters) -> None:
    """Raise ConfigError where a robot is not that of the sheet; only one on a link tells its name and its limit."""
    if not abs(plant.control_period - robot.control_period) <= 1e-6:
        which = f"robot {plant.robot_name!r} on the link" if isinstance(plant, SerialPlant) else "robot"
        raise ConfigError(
            f"The {which} has a control period of {plant.control_period} s; the data sheet {robot.name!r} says "
            f"{robot.control_period} s. Is it the right one (robot=...)?"
        )
    if isinstance(plant, SerialPlant) and is_beyond(robot.torque_limit, plant.torque_limit):
        raise ConfigError(
            f"The robot {plant.robot_name!r} on the link takes at most {plant.torque_limit:g} N·m; the data sheet "
            f"{robot.name!r} says {robot.torque_limit:g} N·m. Commands beyond would be recorded but not act. Is it the "
            f"right one (robot=...)? Or set robot.torque_limit={plant.torque_limit:g} throughout."
        )


def check_sensors(plant: Plant, channels: Sequence[str]) -> None:
    """Raise ConfigError where a robot on a link does not measure what a state of these channels needs."""
    if not isinstance(plant, SerialPlant):
        return
    for name in ("acceleration", "yaw_rate"):
        if name in channels and Sensors[name.upper()] not in plant.sensors:
            raise ConfigError(
                f"The robot {plant.robot_name!r} on the link does not measure its {name.replace('_', ' ')}, which is a "
                "channel of the state. Choose a state without it, such as state=default."
            )
