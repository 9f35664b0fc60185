"""A mapping's motor and voltages against its supply, and against the torque limit of the robot's data sheet."""

from collections.abc import Iterator

import numpy as np

from twbal.core.gaussian import Array
from twbal.core.motor import Motor
from twbal.io.importers.checks.doubt import Curves, Doubt, DoubtKind, LogPart
from twbal.io.importers.checks.implausible_values import BEYOND

_ROUNDED = 1.01  # times the supply, up to which a voltage is none beyond it: digits, a battery's charge
_CLIPPED = 0.03  # share of the voltages that may be clipped: a regulator may ask for more than there is
_FULL_DUTY = 1.1  # of a duty cycle in percent of the supply; no row of a log has more
_SHEET = 1.3  # factor by which the torque at standstill may differ from the sheet's limit: loads, batteries


def voltage_doubts(volts: Array, motor: Motor, is_duty: bool, period: float) -> Iterator[Doubt]:
    """A sentence on voltages that were clipped to the supply.

    Args:
        volts: of the whole log, (n,) [V].
        motor: whose supply it is.
        is_duty: whether the log has duty cycles in percent of it.
        period: between samples [s].
    """
    ratio = np.abs(volts) / motor.supply
    share, largest = float(np.mean(ratio > _ROUNDED)), float(ratio.max(initial=0.0))
    if share <= _CLIPPED and not (is_duty and largest > _FULL_DUTY):
        return
    count = f"{100.0 * share:.2g} % of the voltages were" if share > _CLIPPED else "some voltages were"
    advice = "the duty in other units (0.1 %, 0..255)" if is_duty else "the unit, the scale or the supply another"
    sentence = f"{count} beyond the supply (up to {100.0 * largest:.3g} % of it) and were clipped: is {advice}?"
    yield Doubt(DoubtKind.UNIT, "voltage", sentence, Curves(period, volts, "voltage before it was clipped [V]"))


def stall_doubts(part: LogPart, motor: Motor) -> Iterator[Doubt]:
    """A sentence on a motor whose torque at standstill, N K U / R, is not that of the robot's data sheet.

    A limit below it is right where the firmware limits the torque. Then no command of the log goes beyond that limit.
    """
    if part.robot is None:
        return
    stall, limit = motor.torque_per_volt * motor.supply, part.robot.torque_limit
    largest = float(np.abs(part.commands).max(initial=0.0))
    is_beyond = stall > _SHEET * limit and _SHEET < largest / limit <= BEYOND  # `torque_doubts` says what is more
    if stall * _SHEET >= limit and not is_beyond:
        return
    of_commands = f", and the commands reach {largest:.3g} N·m" if is_beyond else ""
    sentence = (
        f"the mapping's motor gives {stall:.3g} N·m at standstill (N K U / R, both motors as one), the sheet of robot "
        f"{part.robot.name!r} has a torque_limit of {limit:.3g} N·m{of_commands}: R must be half of one motor's where "
        "two are meant. Or are K, gear, supply or the sheet another?"
    )
    yield Doubt(DoubtKind.UNIT, "voltage", sentence, Curves(part.period, part.commands, "command [N·m]"))
