"""All effects: the files of this folder, found and not listed."""

import importlib
import pkgutil
from collections.abc import Iterable
from dataclasses import asdict, is_dataclass
from functools import cache
from typing import Any, cast

import twbal.effects
from twbal.effects.effect import Effect, parameters_of


def library() -> dict[str, type[Effect]]:
    """The effects that a diagnosis can name, by name; what has no `parameter` (noise of the sensors) it cannot."""
    return {name: kind for name, kind in all_effects().items() if parameters_of(kind)}


@cache
def all_effects() -> dict[str, type[Effect]]:
    """Effects by name, which is that of their file and of their yaml in conf/effect/; in the order of the names."""
    names = (file.name for file in pkgutil.iter_modules(twbal.effects.__path__))
    return {name: kind for name in names if (kind := effect_kind(name)) is not None}


def effect_kind(name: str) -> type[Effect] | None:
    """The effect of one name, with no other loaded; None where the library has no such effect."""
    try:
        module = importlib.import_module(f"twbal.effects.{name}")
    except ModuleNotFoundError:
        return None
    return next((kind for kind in vars(module).values() if _is_effect_of(kind, module.__name__)), None)


def _is_effect_of(kind: object, module: str) -> bool:
    if not isinstance(kind, type) or kind.__module__ != module or not is_dataclass(kind):
        return False
    return issubclass(kind, Effect)


def values_of(effects: Iterable[Effect]) -> dict[str, dict[str, float]]:
    """Values by name of the effect and of its parameter, as the planar twin takes them."""
    return {effect_name(effect): asdict(cast(Any, effect)) for effect in effects}


def effect_name(effect: Effect) -> str:
    """The name of an effect, as in conf/effect/."""
    return type(effect).__module__.rpartition(".")[2]
