"""Rows of a foreign log with a number in each column that a mapping takes."""

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from twbal.core.errors import LogError
from twbal.core.gaussian import Mask
from twbal.core.text import counted
from twbal.io.importers.checks.doubt import Doubt
from twbal.io.importers.columns import Columns
from twbal.io.importers.mapping import Mapping
from twbal.io.importers.slow_columns import empty_doubts, mean_commands

_LARGEST = 1e30  # of a number in a log, whose square is one, too


class UsableRows(NamedTuple):
    """The rows that are left.

    Attributes:
        columns: of these rows; commands are means where a sample is of several rows.
        mapping: of these columns: means of a faster loop's samples are no samples any more.
        has_means: whether commands are means over several rows.
        notes: what is to be said of the rows that were left out.
        doubts: about columns for which many were.
    """

    columns: Columns
    mapping: Mapping
    has_means: bool = False
    notes: tuple[str, ...] = ()
    doubts: tuple[Doubt, ...] = ()


def usable_rows(path: Path, columns: Columns, mapping: Mapping) -> UsableRows:
    """The columns without rows that have an empty field, no finite number, or one so large that its square is none.

    Where most rows are left out, as of a sensor that is slower than the log, the command of a row that stays is the
    mean of those that act until the next one.

    Args:
        path: of the log, for errors.
        columns: that the mapping takes.
        mapping: of the log.

    Raises:
        LogError: no row is left; the message names the columns without any number.
    """
    usable = np.abs(columns.values) <= _LARGEST  # not so of a NaN
    good: Mask = np.all(usable, axis=1)
    if good.all():
        return UsableRows(columns, mapping)
    if not good.any():
        why = _why_none(usable, mapping)
        raise LogError(f"{path} has no row with a number in each of the mapping's columns: {why}")
    first = columns.lines[np.argmin(good)]
    count = int((~good).sum())
    are = "is" if count == 1 else "are"
    what = f"{counted(count, 'row')} with an empty field, NaN, infinity or more than {_LARGEST:g} {are} left out"
    means = mean_commands(columns, good, usable, mapping)
    kept = columns._replace(values=means.values[good], lines=columns.lines[good], rows=columns.rows[good])
    return UsableRows(
        kept,
        replace(mapping, command_is_sample=False) if means.are_means else mapping,
        means.are_means,
        (f"{what}, the first in {columns.row} {first}",),
        tuple(empty_doubts(usable, good, means.rows, mapping)),
    )


def _why_none(usable: NDArray[np.bool_], mapping: Mapping) -> str:
    """Why no row has a number in each column.

    Args:
        usable: (n, k) whether a field is one.
        mapping: whose k columns these are.
    """
    sources = [(name, column) for name, source in mapping.quantities.items() for column in source.columns]
    have_some: NDArray[np.bool_] = np.any(usable, axis=0)
    empty = [each for each, has_some in zip(sources, have_some, strict=True) if not has_some]
    if not empty:
        return "its sensors are logged in different rows. Fill each column with its last value before the import."
    said = ", ".join(f"{column!r} ({name})" for name, column in empty)
    which = f"column {said} has" if len(empty) == 1 else f"columns {said} have"
    return (
        f"{which} none in any row. Map another column; or null, where the log does not have the quantity "
        f"(++import.quantities.{empty[0][0]}=null)."
    )
