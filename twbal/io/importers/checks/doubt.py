"""What checks look at, and what they find."""

from collections.abc import Mapping
from enum import StrEnum
from typing import NamedTuple

from twbal.core.gaussian import Array
from twbal.core.robot_parameters import RobotParameters


class DoubtKind(StrEnum):
    """What seems to be wrong."""

    SIGN = "sign"
    UNIT = "unit"
    COLUMN = "column"
    TIME = "time"
    ROW = "row"
    SIDES = "sides"
    REPEATED = "repeated"
    UNINFORMATIVE = "uninformative"
    LYING = "lying"
    JUMP = "jump"
    UNTOLD = "untold"
    """Nothing seems wrong, but the log does not tell; said as a note and no warning."""


class Curves(NamedTuple):
    """Two curves of which one should follow the other, or one curve alone.

    Attributes:
        period: between samples [s].
        found: (n,) what the log says.
        found_name: with its unit.
        expected: (n,) what it should be; None where there is nothing to compare with.
        expected_name: with its unit.
    """

    period: float
    found: Array
    found_name: str
    expected: Array | None = None
    expected_name: str = ""


class Doubt(NamedTuple):
    """One thing that a person should look at.

    Attributes:
        kind: of what seems wrong.
        quantity: of the mapping, whose source it seems to be; "" where that is not clear.
        sentence: that says it.
        evidence: for a picture; None where there is nothing to draw.
    """

    kind: DoubtKind
    quantity: str
    sentence: str
    evidence: Curves | None = None


class LogPart(NamedTuple):
    """The longest part of a log without a gap, as mapped: n samples, evenly spaced, in SI units.

    Attributes:
        period: between samples [s].
        signals: measured quantities by name, (n,); `wheel_angle` also where it was a distance or a pose.
        commands: (n - 1,) torque between samples [N·m].
        sides: left and right by quantity, (n,) each, where the mapping names two columns.
        is_sampled: whether the commands were worked out of samples of a faster loop.
        comes_before: whether the mapping takes a row's command for one that acted before the row's sample.
        robot: data sheet; None where sizes are not to be compared with one.
        has_tilt: whether the log has a tilt; else the one among the signals was worked out from `tilt_rate`.
    """

    period: float
    signals: Mapping[str, Array]
    commands: Array
    sides: Mapping[str, tuple[Array, Array]]
    is_sampled: bool
    comes_before: bool
    robot: RobotParameters | None
    has_tilt: bool = True

    @property
    def measured(self) -> dict[str, Array]:
        """Signals but for time, and for a tilt that was worked out."""
        return {
            name: self.signals[name] for name in self.signals if name != "time" and (name != "tilt" or self.has_tilt)
        }
