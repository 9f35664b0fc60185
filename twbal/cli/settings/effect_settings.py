"""Settings of effects, from what the effects' own classes say of their parameters."""

import inspect
import re
from collections.abc import Iterator, Mapping

from twbal.cli.settings.kinds import Number, Span
from twbal.cli.settings.robot_settings import SENSORS
from twbal.cli.settings.setting import Setting
from twbal.effects.effect import Effect, Parameter, parameters_of
from twbal.effects.library import effect_kind

NOISE = "sensor_noise"
_BEYOND = 10.0  # times the range of plausible robots, from which on a value must be a slip


def effect_settings(place: str, name: str, scales: Mapping[str, float], drawn: bool = False) -> Iterator[Setting]:
    """A row for each parameter of an effect; none where the library does not have it.

    Args:
        place: key under which its parameters stand.
        name: of the effect.
        scales: what the robot at hand has of `Parameter.scale`.
        drawn: each parameter is a range, from which values are drawn.
    """
    if name == NOISE:
        for sensor, unit in SENSORS.items():
            yield Setting(f"{place}.{sensor}", Number(0.0, 1e4, unit), "standard deviation of the sensor's noise")
        return
    kind = effect_kind(name)
    if kind is None:
        return
    said = meanings(kind)
    for key, parameter in parameters_of(kind).items():
        number = accepted(parameter, scales.get(parameter.scale, 1.0))
        yield Setting(f"{place}.{key}", Span(number) if drawn else number, said[key])


def accepted(parameter: Parameter, scale: float) -> Number:
    """What a parameter may be: far more than plausible robots have, and the value at which it does nothing.

    Args:
        parameter: what is known of it.
        scale: what its range grows with.
    """
    low, high = scale * parameter.low, scale * parameter.high
    least = _BEYOND * low if low < 0 else low / _BEYOND
    return Number(min(least, parameter.none), max(_BEYOND * high, parameter.none), parameter.unit)


def meanings(kind: type[Effect]) -> dict[str, str]:
    """What an effect's docstring says of each parameter, without the unit, or else of the effect."""
    first, _, attributes = (inspect.getdoc(kind) or "").partition("Attributes:\n")
    entries = re.findall(r"^    (\w+): (.*(?:\n {8}.*)*)", attributes, flags=re.MULTILINE)
    said = {name: re.sub(r"\s*\[[^]]*\][.;]?", "", " ".join(text.split())).strip(" .") for name, text in entries}
    whole = first.strip().splitlines()[0].rstrip(".") if first.strip() else kind.__name__
    return {name: said.get(name) or whole for name in parameters_of(kind)}
