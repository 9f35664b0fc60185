"""A free-form effect as `diagnosis.json` keeps it, and in a sentence."""

from collections.abc import Sequence
from typing import NamedTuple


class FreeForm(NamedTuple):
    """A smooth function of one variable that explains a part of what no effect of the library does.

    Attributes:
        quantity: that it adds to: torque in the joints (of both wheels together), force at the axle, or tilt reading.
        unit: of the quantity.
        variable: that it depends on.
        variable_unit: its unit.
        gain: in log evidence over the best set of effects, over the autocorrelation that is left [nats].
        p_value: probability of such a gain in any candidate if there is no such function.
        share: of the mean square error of predictions over about 0.15 s on held-out data that goes with it.
        in_place_of: effects of the best set that it takes the place of, sorted.
        alike: other functions that do about as well, as "force at the axle over the speed".
        shape: what can be measured of its form, in words.
        grid: (n,) values of the variable within the range that the data cover.
        mean: (n,) of the function there, less its mean over the data.
        low95: (n,) lower ends of 95 % intervals.
        high95: (n,) upper ends.
    """

    quantity: str
    unit: str
    variable: str
    variable_unit: str
    gain: float
    p_value: float
    share: float
    in_place_of: tuple[str, ...]
    alike: tuple[str, ...]
    shape: str
    grid: tuple[float, ...]
    mean: tuple[float, ...]
    low95: tuple[float, ...]
    high95: tuple[float, ...]

    @property
    def text(self) -> str:
        """As sentences: what depends on what, how much that explains, its size and its shape."""
        place = f" in place of {', '.join(self.in_place_of).replace('_', ' ')}" if self.in_place_of else ""
        alike = f" ({', or '.join(self.alike)}, does about as well)" if self.alike else ""
        return (
            f"What remains goes with one variable: an added {self.quantity} that depends on the {self.variable}{place}"
            f" takes away {self.share:.0%} of the mean square error of predictions over about 0.15 s on held-out"
            f" data{alike}."
            f" It lies between {min(self.mean):.2g} and {max(self.mean):.2g} {self.unit} for a {self.variable} from"
            f" {self.grid[0]:.2g} to {self.grid[-1]:.2g} {self.variable_unit}. The figure has the curve, whose form may"
            f" tell what it is: {self.shape}."
        )


def on_free_forms(found: Sequence[FreeForm]) -> str:
    """What is said where something remains."""
    if found:
        return found[0].text
    return "No added torque, force or tilt reading that is a smooth function of one variable explains what remains."
