"""Objects of rows that lie in one another, as columns."""

from collections.abc import Mapping, Sequence
from typing import Any


def columns_of(rows: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
    """The columns of rows that are objects of one form, by name; objects in objects stay so, with lists for values.

    A field of the first row that a later one lacks raises KeyError.
    """
    found: dict[str, Any] = {}
    for name, first in rows[0].items() if rows else ():
        values = [row[name] for row in rows]
        is_nested = isinstance(first, Mapping) and all(isinstance(value, Mapping) for value in values)
        found[name] = columns_of(values) if is_nested else values
    return found
