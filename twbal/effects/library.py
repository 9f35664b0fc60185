"""All effects: the files of this folder, found and not listed, and those from outside the package.

An effect from outside is registered by `register`, which serves as a decorator of its class. The command line finds it
where an installed package lists its module in the entry point group `twbal.effects`, or where the environment variable
TWBAL_EFFECTS names it (several are parted by commas).
"""

import hashlib
import importlib
import inspect
import os
import pkgutil
import re
from collections.abc import Iterable, Mapping
from dataclasses import asdict, is_dataclass
from functools import cache
from importlib.metadata import entry_points
from typing import Any, TypeVar, cast

import twbal.effects
from twbal.core.errors import ConfigError
from twbal.effects.effect import AxleTerm, Effect, JointTerm, SensorTerm, TorqueTerm, refuse_twice
from twbal.effects.parameter import parameters_of

GROUP, VARIABLE = "twbal.effects", "TWBAL_EFFECTS"
_TERMS = (TorqueTerm, JointTerm, AxleTerm, SensorTerm)
_SAID = ("place", "reference", "is_linear", "separate_by")  # of every effect, without a default

Kind = TypeVar("Kind", bound=type[Effect])
_registered: dict[str, type[Effect]] = {}


def library() -> dict[str, type[Effect]]:
    """The effects that a diagnosis can name, by name: those that the planar model has."""
    return {name: kind for name, kind in all_effects().items() if is_planar(kind)}


def all_effects() -> dict[str, type[Effect]]:
    """Effects by name: those of twbal in the order of their names, then those from outside as they were registered."""
    _load_from_outside()
    return {**_built_in(), **_registered}


def register(kind: Kind) -> Kind:
    """Make an effect from outside the package known; returns it, so that it serves as a decorator.

    Raises:
        ConfigError: it is not complete, or its name is taken.
    """
    name = effect_name(kind)
    if "__dataclass_fields__" not in vars(kind) or inspect.isabstract(kind):
        raise ConfigError(f"{name} is no effect: expected a frozen dataclass with all methods of its kind.")
    absent = [word for word in _SAID if not hasattr(kind, word)]
    if absent:
        raise ConfigError(
            f"Effect {name} does not say its {', '.join(absent)}; `twbal.effects.effect.Effect` has them."
        )
    known = {**_built_in(), **_registered}
    other = known.get(name)
    if other is not None and _target(other) != _target(kind):
        raise ConfigError(f"There is an effect {name!r} already ({_target(other)}); give the class another name.")
    _registered[name] = kind
    return kind


def effect_name(effect: Effect | type[Effect]) -> str:
    """The name of an effect: `dead_zone` of `DeadZone`."""
    kind = effect if isinstance(effect, type) else type(effect)
    return re.sub(r"(?<!^)(?=[A-Z])", "_", kind.__name__).lower()


def is_planar(kind: type[Effect]) -> bool:
    """Whether the planar model has an effect: by a term, or as quantities that its parameters change."""
    changes = any(parameter.changes for parameter in parameters_of(kind).values())
    return not kind.diagnosed_separately and (issubclass(kind, _TERMS) or changes)


def is_diagnosed_separately(name: str) -> bool:
    """Whether a diagnosis asks for an effect apart from all others: the planar model passes it over."""
    kind = all_effects().get(name)
    return kind is not None and kind.diagnosed_separately


def values_of(effects: Iterable[Effect]) -> dict[str, dict[str, float]]:
    """Values by name of the effect and of its parameter, as the planar model takes them.

    Raises:
        ConfigError: an effect is there twice.
    """
    effects = tuple(effects)
    refuse_twice(effects)
    return {effect_name(effect): asdict(cast(Any, effect)) for effect in effects}


def effects_from(values: Mapping[str, Mapping[str, float]]) -> list[Effect]:
    """Effects by such values; names that are no effects' are passed over."""
    known = all_effects()
    return [known[name](**own) for name, own in values.items() if name in known]


def nodes() -> Mapping[str, dict[str, Any]]:
    """For each effect, what configures it: its class and the values that it has where no others are given."""
    return {
        name: {"_target_": _target(kind), **{key: known.value for key, known in parameters_of(kind).items()}}
        for name, kind in all_effects().items()
    }


def effect_of(target: str) -> type[Effect] | None:
    """The effect that a `_target_` of a configuration stands for; None where it is none."""
    return next((kind for kind in all_effects().values() if _target(kind) == target), None)


def outside_digest() -> str:
    """Stands for the source code of all effects from outside; "" where there are none."""
    sources = [source_of(kind) for kind in all_effects().values() if kind in _registered.values()]
    return hashlib.sha256("\0".join(sources).encode()).hexdigest()[:16] if sources else ""


@cache
def source_of(kind: type[Effect]) -> str:
    """Source code of the module of an effect; something new in each process where there is none to be read."""
    try:
        return inspect.getsource(importlib.import_module(kind.__module__))
    except (OSError, TypeError, ImportError):
        return os.urandom(16).hex()


@cache
def _built_in() -> dict[str, type[Effect]]:
    names = [file.name for file in pkgutil.iter_modules(twbal.effects.__path__)]
    modules = [importlib.import_module(f"twbal.effects.{name}") for name in names]
    kinds = [kind for module in modules for kind in vars(module).values() if _is_effect_of(kind, module.__name__)]
    return {effect_name(kind): kind for kind in kinds}


@cache
def _load_from_outside() -> None:
    """Import the modules of effects from outside, which register what they have."""
    for entry in entry_points(group=GROUP):
        found = entry.load()
        if isinstance(found, type):
            register(found)
    for name in filter(None, os.environ.get(VARIABLE, "").split(",")):
        try:
            importlib.import_module(name.strip())
        except ModuleNotFoundError as error:
            raise ConfigError(
                f"{VARIABLE} names a module {name.strip()!r} that cannot be imported ({error}). "
                "Is its folder in PYTHONPATH?"
            ) from error


def _is_effect_of(kind: object, module: str) -> bool:
    return isinstance(kind, type) and kind.__module__ == module and is_dataclass(kind) and issubclass(kind, Effect)


def _target(kind: type[Effect]) -> str:
    return f"{kind.__module__}.{kind.__qualname__}"
