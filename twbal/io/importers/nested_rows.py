"""Objects of rows that lie in one another, as columns."""

from collections.abc import Mapping, Sequence
from typing import Any

from twbal.core.errors import LogError


def columns_of(rows: Sequence[Mapping[str, Any]], of: str = "") -> Mapping[str, Any]:
    """The columns of rows that are objects of one form, by name; objects in objects stay so, with lists for values.

    Where a row has null in place of an object, all fields of that are null.

    Args:
        rows: the objects.
        of: name of the object in which they lie, for errors.

    Raises:
        LogError: a row has other names than the first.
    """
    names = rows[0].keys() if rows else ()
    for number, row in enumerate(rows, start=1):
        if row.keys() != names:
            which = f" of {of}" if of else ""
            raise LogError(
                f"Row {number} has the names{which} {', '.join(row) or '(none)'}; expected are those of the first row: "
                f"{', '.join(names)}."
            )
    return {name: _column([row[name] for row in rows], f"{of}.{name}" if of else name) for name in names}


def _column(values: Sequence[Any], name: str) -> Any:
    inner = next((value for value in values if isinstance(value, Mapping)), None)
    if inner is None or not all(value is None or isinstance(value, Mapping) for value in values):
        return values
    return columns_of([dict.fromkeys(inner) if value is None else value for value in values], name)
