"""Nested settings by their dotted keys."""

from collections.abc import Iterator, Mapping
from typing import Any


def flattened(tree: Mapping[Any, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Every value that is no mapping (or an empty one), by its dotted key."""
    for name, value in tree.items():
        if isinstance(value, Mapping) and value:
            yield from flattened(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def ancestors(key: str) -> Iterator[str]:
    """The dotted keys that a key lies under, from the top."""
    names = key.split(".")
    return (".".join(names[:count]) for count in range(1, len(names)))
