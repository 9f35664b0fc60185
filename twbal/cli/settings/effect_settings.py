"""Settings of effects, from what the effects' own classes say of their parameters."""

from collections.abc import Iterator

from twbal.cli.settings.kinds import Below, Number, Setting, Span
from twbal.effects.effect import Effect
from twbal.effects.parameter import Parameter, parameters_of

_BEYOND = 10.0  # times the range of plausible robots, from which on a value must be a slip


def effect_settings(
    place: str, kind: type[Effect], torque_limit: float, control_period: float, mass: float, drawn: bool = False
) -> Iterator[Setting]:
    """A row for each parameter of an effect.

    Args:
        place: key under which its parameters stand.
        kind: the effect.
        torque_limit: of the robot at hand [N·m].
        control_period: of the robot at hand [s].
        mass: of the robot at hand with its wheels [kg].
        drawn: each parameter is a range, from which values are drawn.
    """
    for key, parameter in parameters_of(kind).items():
        number = accepted(parameter, parameter.scale.of(torque_limit, control_period, mass))
        yield Setting(f"{place}.{key}", Span(number) if drawn else number, parameter.meaning)


def accepted(parameter: Parameter, scale: float) -> Number:
    """What a parameter may be: far more than plausible robots have, and the value at which it does nothing.

    It is cut at `least` and `below`, beyond which the effect itself takes none.

    Args:
        parameter: what is known of it.
        scale: what its range is multiplied by.
    """
    low, high = scale * parameter.low, scale * parameter.high
    least = min(_BEYOND * low if low < 0 else low / _BEYOND, parameter.neutral)
    most = max(_BEYOND * high, parameter.neutral)
    kind = Number if most < parameter.below or most == parameter.neutral else Below
    return kind(max(least, parameter.least), min(most, parameter.below), parameter.unit)
