"""All numbers of the planar model: the data sheet's, and those of every effect."""

import sys
from collections import namedtuple
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, cast

from twbal.core.errors import ConfigError
from twbal.core.robot_parameters import RobotParameters
from twbal.core.threads import made_once
from twbal.effects.effect import Effect
from twbal.effects.library import is_diagnosed_separately, library, outside_digest
from twbal.effects.parameter import parameters_of

NOISE = "sensor_noise"
SHEET = (
    *("body_mass", "com_height", "com_offset", "body_inertia_pitch", "turn_inertia"),
    *("wheel_mass", "wheel_radius", "wheel_inertia", "track", "torque_limit"),
)
"""The first fields: those of `RobotParameters`; `turn_inertia` is its roll inertia less its yaw inertia."""
_CLASS = "Parameters"


class EffectFields(NamedTuple):
    """Where the parameters of an effect lie among all numbers.

    Attributes:
        kind: the effect.
        values: class of its parameters as a named tuple.
        first: field in which they begin.
        end: field after them.
    """

    kind: type[Effect]
    values: type
    first: int
    end: int


class PlanarParameters(tuple[float, ...]):
    """The data sheet, and `<effect>_<parameter>` of every effect of the library; angles in rad, all in SI units.

    A named tuple: kernels are compiled for its class, of which there is one for each library, so that they have just
    the terms of its effects.

    Attributes:
        effects: of the library.
        not_linear: neutral values of the effects that are no part of a linear model about the balance.
    """

    __slots__ = ()
    effects: ClassVar[tuple[EffectFields, ...]]
    not_linear: ClassVar[dict[str, float]]
    _field_defaults: ClassVar[dict[str, float]]

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> float: ...

        def _replace(self, **values: float) -> "PlanarParameters": ...


def planar_parameters(robot: RobotParameters, effects: Mapping[str, Mapping[str, float]]) -> PlanarParameters:
    """The planar model of a robot with effects.

    Args:
        robot: data sheet.
        effects: values by effect and by parameter, as the effects of the simulation take them. `sensor_noise` is no
            part of the motion and is passed over, as is an effect that a diagnosis asks for apart from all others.

    Raises:
        ConfigError: the planar model has no such effect or parameter.
    """
    turn_inertia = robot.body_inertia_roll - robot.body_inertia_yaw
    sheet = [turn_inertia if name == "turn_inertia" else float(getattr(robot, name)) for name in SHEET]
    return changed(cast(Any, parameters_class())(*sheet), effects)


def changed(planar: PlanarParameters, effects: Mapping[str, Mapping[str, float]]) -> PlanarParameters:
    """The model with other values of some effects' parameters.

    Raises:
        ConfigError: the planar model has no such effect or parameter.
    """
    values: dict[str, float] = {}
    for effect, parameters in effects.items():
        if effect == NOISE or is_diagnosed_separately(effect):
            continue
        for name, value in parameters.items():
            if field_of(effect, name) not in planar._field_defaults:
                known = ", ".join(planar._field_defaults)
                raise ConfigError(
                    f"The planar model has no parameter {name!r} of an effect {effect!r}; it has: {known}."
                )
            values[field_of(effect, name)] = float(value)
    return planar._replace(**values)


def linear_part(planar: PlanarParameters) -> PlanarParameters:
    """The model without the effects that are no part of a linear model about the balance."""
    return planar._replace(**planar.not_linear)


def field_of(effect: str, parameter: str) -> str:
    """The field in which a parameter of an effect lies."""
    return f"{effect}_{parameter}"


def parameters_class() -> type[PlanarParameters]:
    """The class of the numbers that goes with the library as it is now."""
    return _class_of(tuple(library().items()), outside_digest())


@made_once
def _class_of(effects: tuple[tuple[str, type[Effect]], ...], digest: str) -> type[PlanarParameters]:
    defaults = {
        field_of(name, key): known.neutral for name, kind in effects for key, known in parameters_of(kind).items()
    }
    fields, own = [*SHEET, *defaults], []
    first = len(SHEET)
    for _, kind in effects:
        end = first + len(parameters_of(kind))
        own.append(EffectFields(kind, namedtuple(f"{kind.__name__}Values", tuple(parameters_of(kind))), first, end))
        first = end
    # Machine code is kept by the name of this class, which therefore stands for the code of effects from outside.
    name = f"{_CLASS}{digest}"
    base = namedtuple(name, fields, defaults=tuple(defaults.values()))  # type: ignore[misc]
    not_linear = {field: defaults[field] for o in own if not o.kind.is_linear for field in fields[o.first : o.end]}
    said = {"__slots__": (), "__module__": __name__, "effects": tuple(own), "not_linear": not_linear}
    made = type(name, (base, PlanarParameters), said)
    setattr(sys.modules[__name__], name, made)
    return cast(type[PlanarParameters], made)


def __getattr__(name: str) -> Any:
    """A class for which machine code was kept, of a library that there is not in this process: never the class in use.

    Raises:
        AttributeError: the name is no such class's.
    """
    if name.startswith(_CLASS):
        return namedtuple(name, ())
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
