"""What is known of an effect's parameters before any data."""

from collections.abc import Iterable
from dataclasses import MISSING, field, fields
from enum import Enum
from math import inf, isfinite
from typing import Any, NamedTuple

from twbal.core.errors import ConfigError
from twbal.core.quantities import Change, Quantity
from twbal.core.robot_parameters import RobotParameters

_TORQUE_LIMIT, _CONTROL_PERIOD, _MASS = 20.0, 0.02, 12.0  # of the robot that ranges are written for [N·m], [s], [kg]


class Scale(Enum):
    """What the range of a parameter grows with."""

    NOTHING = "nothing"
    TORQUE = "the robot's torque limit over 20 N·m"
    PERIOD = "its control period over 20 ms"
    MASS = "the mass of the robot with its wheels over 12 kg"

    def of(self, torque_limit: float, control_period: float, mass: float) -> float:
        """Its size for a robot with this torque limit [N·m], control period [s] and mass with its wheels [kg]."""
        sizes = {
            Scale.TORQUE: torque_limit / _TORQUE_LIMIT,
            Scale.PERIOD: control_period / _CONTROL_PERIOD,
            Scale.MASS: mass / _MASS,
        }
        return sizes.get(self, 1.0)


class Parameter(NamedTuple):
    """What is known of a parameter before any data.

    Attributes:
        meaning: without the unit.
        unit: "" for a plain number.
        low: lowest value that a plausible robot has.
        high: highest.
        neutral: value at which the effect does nothing.
        start: a value at which data say something about it: at the neutral one many slopes are zero.
        value: that it has where the effect is put into a simulation and no other is given.
        scale: what `low`, `high`, `start` and `sd` grow with.
        least: value below which none can be.
        below: what every value is below.
        changes: of a robot's quantities that the parameter makes, for both engines.
        is_of_each_wheel: whether it is that of one wheel, not of both together.
        covers_all: whether its range holds all values that a robot can have, so that its ends are as good as any other.
        form: share of it (standard deviation) by which a value that was found is off on robots whose form of the effect
            is another, as far as benchmarks told.
        sd: standard deviation of its prior about the neutral value; infinite: all values of the range are as good.
    """

    meaning: str
    unit: str
    low: float
    high: float
    neutral: float
    start: float
    value: float
    scale: Scale
    least: float
    below: float
    changes: tuple[tuple[Quantity, Change], ...]
    is_of_each_wheel: bool
    covers_all: bool
    form: float
    sd: float

    def size(self, robot: RobotParameters) -> float:
        """What its range is to be multiplied by for a robot."""
        mass = robot.body_mass + 2.0 * robot.wheel_mass
        return self.scale.of(robot.torque_limit, robot.control_period, mass)


def parameter(
    meaning: str,
    unit: str,
    prior: tuple[float, float],
    *,
    start: float,
    value: float,
    neutral: float = 0.0,
    scale: Scale = Scale.NOTHING,
    least: float | None = None,
    below: float = inf,
    changes: Iterable[tuple[Quantity, Change]] = (),
    is_of_each_wheel: bool = False,
    covers_all: bool = False,
    form: float = 0.0,
    sd: float = inf,
    is_optional: bool = False,
) -> Any:  # Any: what dataclasses.field returns stands for a value of the field's own type
    """A field of an effect with what is known of it.

    Args: as of `Parameter`; `prior` is (low, high). `least` is 0 unless said, or -inf where `low` is negative. One that
    is optional may be left out, and is then `value`: files that were written before it was there are still read.

    Raises:
        ConfigError: an argument cannot be, or does not go with the others.
    """
    if not isinstance(meaning, str) or not meaning or not isinstance(unit, str):
        raise ConfigError(
            f"A parameter begins with its meaning and its unit, both of them texts (the unit may be ''); found "
            f"{meaning!r} and {unit!r}."
        )
    if not isinstance(prior, tuple) or len(prior) != 2 or not all(map(_is_number, prior)):
        raise _refused(meaning, f"prior={prior!r}", "the range of plausible robots, as (low, high)")
    if least is None:
        least = -inf if prior[0] < 0.0 else 0.0
    changes = changes if isinstance(changes, Quantity) else tuple(changes)
    if isinstance(changes, Quantity) or not all(map(_is_change, changes)):
        raise _refused(meaning, f"changes={changes!r}", "scales(Quantity.BODY_MASS), adds_to(...) or another of these")
    known = Parameter(
        *(meaning, unit, *prior, neutral, start, value, scale, least, below, changes),
        *(is_of_each_wheel, covers_all, form, sd),
    )
    _check(known)
    return field(default=value if is_optional else MISSING, metadata={"parameter": known})


def _check(p: Parameter) -> None:
    """Refuse what is known of a parameter where it cannot be true.

    Raises:
        ConfigError: it names the meaning, what was found, and what to write.
    """
    bounds = {"neutral": p.neutral, "least": p.least, "below": p.below, "sd": p.sd, "form": p.form}
    for name, number in {"start": p.start, "value": p.value, **bounds}.items():
        if not _is_number(number) or number != number or not (isfinite(number) or name in bounds):
            raise _refused(p.meaning, f"{name}={number!r}", "a number")
    if not p.low < p.high:
        raise _refused(p.meaning, f"prior=({p.low:g}, {p.high:g})", "low < high; swap them")
    found = f"prior=({p.low:g}, {p.high:g}), least={p.least:g} and below={p.below:g}"
    if not p.least <= p.low:
        raise _refused(p.meaning, found, "least <= low: no value can be less than `least`, so lower it, or raise low")
    if not p.high < p.below:
        raise _refused(p.meaning, found, "high < below: every value is less than `below`, so raise it, or lower high")
    for name, number in (("start", p.start), ("value", p.value)):
        if not p.low <= number <= p.high:
            what = "lies within the range of plausible robots; widen the range, or give another one"
            raise _refused(p.meaning, f"prior=({p.low:g}, {p.high:g}) and {name}={number:g}", f"a {name} that {what}")
    if not p.least <= p.neutral <= p.below:
        raise _refused(p.meaning, f"{found}, neutral={p.neutral:g}", "a neutral value from `least` to `below`")
    if not p.sd > 0.0 or p.form < 0.0:
        raise _refused(p.meaning, f"sd={p.sd:g} and form={p.form:g}", "sd > 0 (left out: no prior) and form >= 0")
    if not isinstance(p.scale, Scale):
        raise _refused(p.meaning, f"scale={p.scale!r}", "Scale.TORQUE, Scale.PERIOD, Scale.MASS or Scale.NOTHING")


def _refused(meaning: str, found: str, expected: str) -> ConfigError:
    return ConfigError(f"The parameter {meaning!r} has {found}; expected is {expected}.")


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_change(value: Any) -> bool:
    return isinstance(value, tuple) and len(value) == 2 and tuple(map(type, value)) == (Quantity, Change)


def adds_to(*quantities: Quantity) -> tuple[tuple[Quantity, Change], ...]:
    """The parameter is added to these."""
    return tuple((quantity, Change.ADD) for quantity in quantities)


def scales(*quantities: Quantity) -> tuple[tuple[Quantity, Change], ...]:
    """These are multiplied by the parameter."""
    return tuple((quantity, Change.SCALE) for quantity in quantities)


def reduces(*quantities: Quantity) -> tuple[tuple[Quantity, Change], ...]:
    """The parameter is the share that these lose."""
    return tuple((quantity, Change.REDUCE) for quantity in quantities)


def limits(*quantities: Quantity) -> tuple[tuple[Quantity, Change], ...]:
    """These are at most the parameter."""
    return tuple((quantity, Change.LIMIT) for quantity in quantities)


def replaces(*quantities: Quantity) -> tuple[tuple[Quantity, Change], ...]:
    """The parameter stands in the place of these."""
    return tuple((quantity, Change.REPLACE) for quantity in quantities)


def parameters_of(effect: type) -> dict[str, Parameter]:
    """What is known of each parameter of an effect, by name."""
    return {f.name: f.metadata["parameter"] for f in fields(effect)}
