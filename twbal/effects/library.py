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
import traceback
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any, TypeVar, cast

import twbal.effects
from twbal.core.errors import ConfigError
from twbal.effects.definition import fault_of, unknown_names
from twbal.effects.effect import AxleTerm, Effect, JointTerm, SensorTerm, TorqueTerm, refuse_twice
from twbal.effects.parameter import parameters_of

GROUP, VARIABLE = "twbal.effects", "TWBAL_EFFECTS"
_TERMS = (TorqueTerm, JointTerm, AxleTerm, SensorTerm)

Kind = TypeVar("Kind", bound=type[Effect])
_registered: dict[str, type[Effect]] = {}


def library() -> dict[str, type[Effect]]:
    """The effects that a diagnosis can name, by name: those that the planar model has."""
    return {name: kind for name, kind in all_effects().items() if is_planar(kind)}


def all_effects() -> dict[str, type[Effect]]:
    """Effects by name: those of twbal in the order of their names, then those from outside as they were registered.

    Raises:
        ConfigError: one cannot be loaded, is not defined as it must be, or names another one that there is not.
    """
    _load_from_outside()
    known = {**_built_in(), **_registered}
    _refuse_unknown_names(tuple(known.values()))
    return known


def register(kind: Kind) -> Kind:
    """Make an effect from outside the package known; returns it, so that it serves as a decorator.

    Raises:
        ConfigError: it is not complete, says something that cannot be, or its name is taken.
    """
    _refuse_wrong(kind)
    name = effect_name(kind)
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
    modules = [_loaded(f"twbal.effects.{name}", importlib.import_module, f"twbal.effects.{name}") for name in names]
    kinds = [kind for module in modules for kind in vars(module).values() if _is_effect_of(kind, module.__name__)]
    for kind in kinds:
        _refuse_wrong(kind)
    return {effect_name(kind): kind for kind in kinds}


def _refuse_wrong(kind: type) -> None:
    """Raise ConfigError where the definition of an effect is not complete, or not right."""
    if fault := fault_of(kind):
        raise ConfigError(f"The effect {kind.__name__} of {_file_of(kind)} is not defined as it must be: {fault}")


@cache
def _refuse_unknown_names(kinds: tuple[type[Effect], ...]) -> None:
    """Raise ConfigError where one of all effects names another one that there is not."""
    names = [effect_name(kind) for kind in kinds]
    for kind, name in zip(kinds, names, strict=True):
        if fault := unknown_names(kind, name, names):
            raise ConfigError(f"The effect {kind.__name__} of {_file_of(kind)} is not defined as it must be: {fault}")


def _file_of(kind: type) -> str:
    try:
        return inspect.getfile(kind)
    except (OSError, TypeError):  # it was made where there is no file
        return kind.__module__


@cache
def _load_from_outside() -> None:
    """Import the modules of effects from outside, which register what they have."""
    for entry in entry_points(group=GROUP):
        found = _loaded(f"the entry point {entry.name!r} of {GROUP}", entry.load)
        if isinstance(found, type):
            register(found)
    for name in filter(None, map(str.strip, os.environ.get(VARIABLE, "").split(","))):
        _loaded(f"{name!r}, which {VARIABLE} names,", importlib.import_module, name)


def _loaded(what: str, load: Callable[..., Any], *name: str) -> Any:
    """What `load` imports.

    Args:
        what: is imported, in words.
        load: imports it.
        name: of the module, if `load` has to be told.

    Raises:
        ConfigError: it cannot be imported, with the line at which that ended.
    """
    try:
        return load(*name)
    except Exception as error:  # whatever the code of a person raises
        if isinstance(error, ModuleNotFoundError) and name and error.name in (name[0], name[0].partition(".")[0]):
            advice = f"{error}. Is its folder in PYTHONPATH?"
        else:
            said = error.msg if isinstance(error, SyntaxError) else error
            reason = str(error) if isinstance(error, ConfigError) else f"{type(error).__name__}: {said}."
            advice = f"{_where(error)}: {reason} CONTRIBUTING.md shows a whole effect."
        raise ConfigError(f"The module {what} cannot be imported: {advice}") from error


def _where(error: Exception) -> str:
    """File and line at which the import of a module ended: the last ones that are neither Python's nor this folder's.

    A file of this folder is meant where it is an effect's.
    """
    if isinstance(error, SyntaxError) and error.filename:
        return f"{error.filename}, line {error.lineno}"
    of_others = {str(Path(__file__).with_name(name)) for name in ("library.py", "parameter.py", "definition.py")}
    frames = [(frame.f_code.co_filename, line) for frame, line in traceback.walk_tb(error.__traceback__)]
    own = [(file, line) for file, line in frames if file not in of_others and not _is_of_python(file)]
    file, line = (own or frames)[-1]
    return f"{file}, line {line}"


def _is_of_python(file: str) -> bool:
    is_installed = "site-packages" in file or "dist-packages" in file
    return file.startswith("<") or (Path(file).is_relative_to(Path(os.__file__).parent) and not is_installed)


def _is_effect_of(kind: object, module: str) -> bool:
    """Whether something in a module is an effect that it defines, if only in part."""
    if not isinstance(kind, type) or not issubclass(kind, Effect) or kind.__module__ != module:
        return False
    return module != Effect.__module__ and not kind.__name__.startswith("_")


def _target(kind: type[Effect]) -> str:
    return f"{kind.__module__}.{kind.__qualname__}"
