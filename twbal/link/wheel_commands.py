"""The two commands of a robot, sum and difference of what its wheels get, and what limits leave of them."""

from dataclasses import dataclass
from typing import NamedTuple

from twbal.core.motor import Motor

_FLOAT32_SLACK = 1e-6  # of a limit, which goes through float32 on its way


class WheelCommands(NamedTuple):
    """What both wheels get.

    Attributes:
        total: right plus left, positive drives forward [N·m, or V].
        difference: right minus left, positive turns to the left [N·m, or V].
    """

    total: float
    difference: float = 0.0

    def times(self, factor: float) -> "WheelCommands":
        """Both times `factor`."""
        return WheelCommands(factor * self.total, factor * self.difference)


@dataclass(frozen=True)
class WheelLimits:
    """The most that a robot does. Balancing goes first: a turn gets what is left of each wheel's half of `total`.

    Attributes:
        total: largest sum [N·m].
        difference: largest difference [N·m]; 0: it does not turn.
    """

    total: float
    difference: float

    def cut(self, asked: WheelCommands) -> WheelCommands:
        """What is done of what is asked."""
        total = min(max(asked.total, -self.total), self.total)
        left = min(self.difference, self.total - abs(total))
        return WheelCommands(total, min(max(asked.difference, -left), left))

    def allow(self, asked: WheelCommands) -> bool:
        """Whether nothing of what is asked is cut, but for rounding."""
        done, rounding = self.cut(asked), _FLOAT32_SLACK * self.total
        return abs(done.total - asked.total) <= rounding and abs(done.difference - asked.difference) <= rounding


def torque_per_voltage(motor: Motor) -> float:
    """Sum of the wheels' torques for each volt of the sum of their voltages, at a standstill [N·m/V].

    The same holds for the differences. `Motor` is that of both motors together, which get one voltage.
    """
    return 0.5 * motor.torque_per_volt
