"""Typed records as JSON files: their annotations are the schema, so that no record is taken apart by hand.

A record is a dataclass or a NamedTuple of texts, numbers, truth values, `StrEnum`s, further records, tuples of one
type, mappings from texts, and unions of these with each other or None.
"""

import json
import sys
import types
from collections.abc import Mapping
from dataclasses import is_dataclass
from enum import StrEnum
from inspect import Parameter, signature
from pathlib import Path
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from twbal.core.errors import DataError
from twbal.core.files import read_json, write_atomically

Record = TypeVar("Record")


def write_record(path: Path, record: object) -> None:
    """Write a record as a JSON file.

    Raises:
        DataError: the file cannot be written.
        ValueError: a number in it is not finite.
    """
    write_atomically(path, json.dumps(encoded(record), indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def read_record(kind: type[Record], path: Path) -> Record:
    """The record of a type that is in a JSON file; fields with a default may be missing.

    Raises:
        FileNotFoundError: it is not there.
        DataError: it cannot be read, is not JSON, or does not hold the fields of such a record.
    """
    record: Record = decoded(kind, read_json(path), kind.__name__.lower())
    return record


def encoded(value: Any) -> Any:
    """A record as JSON has it: records become dicts, and tuples lists."""
    if is_dataclass(value) or hasattr(value, "_fields"):
        return {name: encoded(getattr(value, name)) for name in signature(type(value)).parameters}
    if isinstance(value, Mapping):
        return {name: encoded(each) for name, each in value.items()}
    return [encoded(each) for each in value] if isinstance(value, tuple | list) else value


def decoded(kind: Any, value: Any, where: str) -> Any:
    """Turn what JSON says into a type.

    Args:
        kind: the type.
        value: plain JSON.
        where: it stands, for messages.

    Raises:
        DataError: it is something else.
    """
    origin, inner = get_origin(kind), get_args(kind)
    if origin is types.UnionType:
        return _one_of(inner, value, where)
    if origin is tuple:
        if not isinstance(value, list):
            raise DataError(f"{where} must be a list; found {_shown(value)}.")
        return tuple(decoded(inner[0], each, f"{where}[{i}]") for i, each in enumerate(value))
    if origin is not None:  # a mapping
        return {name: decoded(inner[1], each, f"{where}.{name}") for name, each in _items(value, where).items()}
    if is_dataclass(kind) or hasattr(kind, "_fields"):
        return _decoded_record(kind, _items(value, where), where)
    if issubclass(kind, StrEnum):
        try:
            return kind(value)
        except ValueError:
            known = ", ".join(map(repr, map(str, kind)))
            raise DataError(f"{where} must be one of {known}; found {_shown(value)}.") from None
    accepted = (int, float) if kind is float else kind
    if (type(value) is bool) != (kind is bool) or not isinstance(value, accepted) or _is_beyond_floats(value):
        raise DataError(f"{where} must be a value of type {kind.__name__}; found {_shown(value)}.")
    return kind(value)


def _one_of(kinds: tuple[Any, ...], value: Any, where: str) -> Any:
    """The value as the first of some types that takes it; None where it is None and may be."""
    if value is None and types.NoneType in kinds:
        return None
    *others, last = (kind for kind in kinds if kind is not types.NoneType)
    for kind in others:
        try:
            return decoded(kind, value, where)
        except DataError:
            continue
    return decoded(last, value, where)


def _decoded_record(kind: type, value: dict[str, Any], where: str) -> Any:
    known = signature(kind).parameters
    lacking = {name for name, parameter in known.items() if parameter.default is Parameter.empty} - set(value)
    for problem, odd in (("lacks", lacking), ("has the unknown field", set(value) - set(known))):
        if odd:
            raise DataError(f"{where} {problem} {sorted(odd)[0]!r}; its fields are: {', '.join(known)}.")
    hints = get_type_hints(kind)
    return kind(**{name: decoded(hints[name], each, f"{where}.{name}") for name, each in value.items()})


def _items(value: Any, where: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise DataError(f"{where} must be a record; found {_shown(value)}.")
    return value


def _is_beyond_floats(value: object) -> bool:
    return isinstance(value, int) and abs(value) > sys.float_info.max


def _shown(value: object) -> str:
    return repr(value)[:80]
