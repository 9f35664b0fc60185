"""A duty cycle as a torque without the data of a motor: the torque limit at full duty."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from twbal.core.robot_parameters import RobotParameters
from twbal.io.importers.all_columns import Column

_TIMERS = (255, 400, 511, 1000, 1023, 2047, 4095, 8191, 65535)  # full values that are usual
_USUAL = (255, 400, 1000, 1023, 4095, 65535)  # of them, those that a person is asked about
_ASKED = 3  # of these at once
_NEAR = 3  # steps of a timer by which the largest value of one that was at full duty may be below that
_UNIT = 2.0  # largest duty cycle that is one from -1 to 1


class FullDuty(NamedTuple):
    """What full duty is in a log.

    Attributes:
        value: of full duty, probably.
        is_certain: whether the log or its units tell that value.
        largest: value that was seen.
    """

    value: float
    is_certain: bool
    largest: float


def full_duty(columns: Sequence[Column], is_percent: bool, is_counted: bool) -> FullDuty:
    """The value of columns that is probably full duty.

    Args:
        columns: of a duty cycle.
        is_percent: whether it is one in percent.
        is_counted: whether it is in steps of a timer.
    """
    largest = max(float(np.nanmax(np.abs(column.values), initial=0.0)) for column in columns)
    if is_percent:
        return FullDuty(100.0, True, largest)
    if largest <= _UNIT and not is_counted:
        return FullDuty(1.0, True, largest)
    value = float(next((full for full in _TIMERS if largest <= full), np.ceil(largest)))
    return FullDuty(value, value in _TIMERS and largest >= value - _NEAR, largest)


def torque_way(sources: str, full: FullDuty, robot: RobotParameters) -> str:
    """Comments for a mapping: what to write in place of voltage and motor.

    Args:
        sources: of the columns of the duty cycle, as yaml.
        full: duty.
        robot: whose torque limit it is.
    """
    limit = robot.torque_limit
    scale, reason = f"{limit / full.value:.6g}", f"{limit:g} N·m / full duty {full.value:g}"
    if not full.is_certain:
        asked = [f"{each}?" for each in _USUAL if each >= full.largest][:_ASKED]
        said = f"full duty {' '.join(asked)} the" if asked else "the"
        scale, reason = "'???'", f"torque_limit ({limit:g} N·m) / full duty; {said} largest seen is {full.largest:g}"
    command = f"command: {{from: {sources}, unit: N·m, scale: {scale}}}"
    return (
        f"# Or without the data of a motor, if full duty gives the torque_limit of {robot.name} at standstill:\n"
        "# replace the lines of command and voltage above, and the block `motor` below, by these.\n"
        f"#   {command}  # {reason}\n"
        "#   voltage: null\n"
        "# motor: null\n"
    )
