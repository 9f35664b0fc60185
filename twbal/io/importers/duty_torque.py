"""A duty cycle as a torque without the data of a motor: the torque limit at full duty."""

from collections.abc import Sequence

import numpy as np

from twbal.core.robot_parameters import RobotParameters
from twbal.io.importers.all_columns import Column

_TIMERS = (255, 400, 511, 1000, 1023, 2047, 4095, 8191, 65535)  # full values that are usual
_UNIT = 2.0  # largest duty cycle that is one from -1 to 1


def full_duty(columns: Sequence[Column], is_percent: bool, is_counted: bool) -> float:
    """The value of columns that is probably full duty.

    Args:
        columns: of a duty cycle.
        is_percent: whether it is one in percent.
        is_counted: whether it is in steps of a timer.
    """
    largest = max(float(np.nanmax(np.abs(column.values), initial=0.0)) for column in columns)
    if is_percent:
        return 100.0
    if largest <= _UNIT and not is_counted:
        return 1.0
    return float(next((full for full in _TIMERS if largest <= full), np.ceil(largest)))


def torque_way(sources: str, full: float, robot: RobotParameters) -> str:
    """Comments for a mapping: what to write in place of voltage and motor.

    Args:
        sources: of the columns of the duty cycle, as yaml.
        full: duty.
        robot: whose torque limit it is.
    """
    limit = robot.torque_limit
    command = f"command: {{from: {sources}, unit: N·m, scale: {limit / full:.6g}}}"
    return (
        f"# Or without the data of a motor, if full duty gives the torque_limit of {robot.name} at standstill:\n"
        "# replace the lines of command and voltage above, and the block `motor` below, by these.\n"
        f"#   {command}  # {limit:g} N·m / full duty {full:g}\n"
        "#   voltage: null\n"
        "# motor: null\n"
    )
