"""Whether an effect is defined as twbal needs it: what it lacks or says wrongly, and what to write instead."""

import inspect
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import fields
from types import FunctionType
from typing import Any

from twbal.effects import effect as base
from twbal.effects.effect import Effect, Place
from twbal.effects.parameter import parameters_of

_SAID: Mapping[str, tuple[type, str]] = {
    "place": (
        Place,
        "`place = Place.<name>`, where it acts; `Place` of twbal/effects/effect.py has "
        f"{', '.join(place.name for place in Place)}",
    ),
    "reference": (str, '`reference = "..."`, a paper or book that describes it'),
    "is_linear": (bool, "`is_linear = True` or False: whether a linear model about the balance has it"),
    "separate_by": (str, '`separate_by = "..."`, the experiment that tells it from others'),
}
"""What every effect says of itself, without a default: its type, and what to add."""
_NAMES = ("same_as", "nearly_same_as", "never_beside", "acts_on")
"""What names other effects."""
_TERMS = (base.TorqueTerm, base.JointTerm, base.AxleTerm, base.SensorTerm)


def fault_of(kind: type) -> str:
    """What is wrong with the definition of an effect, and what to write; "" where nothing is.

    Names of other effects are not looked up (`unknown_names`).

    Args:
        kind: class that is meant to be an effect.
    """
    checks: tuple[Callable[[Any], Iterator[str]], ...] = (
        _of_dataclass,
        _of_methods,
        _of_fields,
        _of_attributes,
        _of_names,
    )
    return next((fault for check in checks for fault in check(kind)), "")


def unknown_names(kind: type[Effect], own: str, known: Iterable[str]) -> str:
    """What is wrong with the names of other effects that an effect gives; "" where they are all known.

    Args:
        kind: the effect.
        own: its name.
        known: names of all effects.
    """
    others = sorted(set(known) - {own})
    for word in _NAMES:
        for name in getattr(kind, word):
            if name not in others:
                found = "itself" if name == own else f"{name!r}, which is no effect"
                return f"its {word} names {found}. The others are: {', '.join(others)}."
    return ""


def _of_dataclass(kind: type) -> Iterator[str]:
    if not issubclass(kind, Effect):
        yield "it is not derived from a class of twbal/effects/effect.py, such as OutsideEffect."
    if "__dataclass_fields__" not in vars(kind):
        yield "it is no dataclass where it is registered: put @register above @dataclass(frozen=True)."
    elif not kind.__dataclass_params__.frozen:  # type: ignore[attr-defined]
        yield "it is not frozen: write @dataclass(frozen=True)."


def _of_methods(kind: type) -> Iterator[str]:
    """Those that are lacking, and those that take other arguments than those of the class they belong to."""
    for name in sorted(getattr(kind, "__abstractmethods__", ())):
        yield f"it lacks the method {_call(getattr(kind, name), name)} of {kind.__mro__[1].__name__}."
    for name, (owner, expected) in _inherited(kind).items():
        found = getattr(kind, name)
        count = len(_taken(expected))
        try:
            inspect.signature(found).bind(None, *[None] * count)
        except TypeError:
            yield (
                f"its method {_call(found, name)} takes other arguments than {_call(expected, name)} of "
                f"{owner.__name__}, which are needed in this order."
            )


def _inherited(kind: type) -> dict[str, tuple[type, Any]]:
    """Methods of the classes of effects by name, with the nearest class that has each."""
    found: dict[str, tuple[type, Any]] = {}
    for owner in kind.__mro__[1:]:
        if owner.__module__ == base.__name__:
            for name, method in vars(owner).items():
                if isinstance(method, FunctionType) and not name.startswith("_"):
                    found.setdefault(name, (owner, method))
    return found


def _taken(method: Any) -> list[str]:
    """Names of what a method is given."""
    return [name for name in inspect.signature(method).parameters if name != "self"]


def _call(method: Any, name: str) -> str:
    return f"{name}({', '.join(_taken(method))})"


def _of_fields(kind: type) -> Iterator[str]:
    for field in fields(kind):
        if "parameter" not in field.metadata:
            yield (
                f"its field {field.name} is not known as a parameter: write `{field.name}: float = parameter(meaning, "
                "unit, (low, high), start=..., value=...)`, or take it out."
            )


def _of_attributes(kind: type) -> Iterator[str]:
    text = kind.__doc__ or ""
    if not text.strip() or text.startswith(f"{kind.__name__}("):  # which dataclass writes where there is none
        yield "it has no docstring: say in it what the effect does; docs/effects.md shows that."
    absent = [word for word in _SAID if not hasattr(kind, word)]
    if absent:
        yield f"it does not say its {', '.join(absent)}. Add {'; '.join(_SAID[word][1] for word in absent)}."
    for word, (expected, advice) in _SAID.items():
        found = getattr(kind, word)
        if not isinstance(found, expected):
            yield f"its {word} is {found!r}; expected is {advice}."
    known = parameters_of(kind).values()
    is_planar = issubclass(kind, _TERMS) or any(parameter.changes for parameter in known)
    if known and is_planar and all(parameter.start == parameter.neutral for parameter in known):
        yield (
            "start equals neutral in each of its parameters, where it does nothing and a fit sees no slope: give one "
            "of them another start."
        )


def _of_names(kind: type) -> Iterator[str]:
    for word in _NAMES:
        found = getattr(kind, word)
        if isinstance(found, str):
            yield f"its {word} is the text {found!r}; expected are names in brackets with a comma: `({found!r},)`."
        elif not isinstance(found, tuple) or not all(isinstance(name, str) for name in found):
            yield f"its {word} is {found!r}; expected are names of effects, such as `('dead_zone',)`."
