"""Columns that are filled in some rows alone, as by slower sensors: the commands of the other rows, and what to say."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from twbal.core.errors import ConfigError
from twbal.core.gaussian import Array, Mask
from twbal.io.importers.checks.doubt import Doubt, DoubtKind
from twbal.io.importers.columns import Columns
from twbal.io.importers.mapping import Mapping, QuantitySource

COMMANDS = "command", "voltage"
"""Quantities that act until the next row, and are no measurements."""

_MANY = 0.05  # share of the rows that are left out, from which on that is no fault now and then


class MeanCommands(NamedTuple):
    """The columns with the mean commands of slower samples.

    Attributes:
        values: (n, k) as `Columns.values`; other rows than kept ones are as they were.
        rows: of a sample; 1 where most samples are one row.
        are_means: whether commands of other rows are in those of kept rows; else they are as they were.
    """

    values: Array
    rows: int
    are_means: bool


def sources_of_columns(mapping: Mapping) -> list[tuple[str, QuantitySource, int]]:
    """The quantity and the source of each column that a mapping takes, in order, and its place in that source."""
    return [(name, source, own) for name, source in mapping.quantities.items() for own in range(len(source.columns))]


def mean_commands(columns: Columns, kept: Mask, usable: NDArray[np.bool_], mapping: Mapping) -> MeanCommands:
    """The command of each kept row as the mean over the time for which it stands.

    A sample has as many rows as there are from one kept row to the next in the median. Where more are missing, samples
    are missing between, and a command stands for its own alone. Commands act after their row, or before it where the
    mapping says so; samples of a faster loop run straight from one row to the next, and become means after their row.

    Args:
        columns: that the mapping takes, n rows.
        kept: (n,) whether a row is kept; at least one is.
        usable: (n, k) whether a field is a number.
        mapping: of the log.
    """
    numbers = columns.rows[kept]
    apart = np.diff(numbers)
    rows = max(int(np.round(np.median(apart))), 1) if len(apart) else 1
    places = [(k, *each) for k, each in enumerate(sources_of_columns(mapping)) if each[0] in COMMANDS]
    if rows == 1 or not any(usable[~kept, k].any() for k, *_ in places):
        return MeanCommands(columns.values, rows, False)
    counts = np.where(np.round(apart / rows) <= 1, apart, rows)
    values = columns.values.copy()
    for k, name, source, own in places:
        there = usable[:, k]
        each = columns.values[there, k]
        if name == "voltage" and mapping.motor is not None:  # clipped before means are taken
            ends = (np.array([-1.0, 1.0]) * mapping.motor.supply - source.offset) / source.factors[own]
            each = np.clip(each, ends.min(), ends.max())
        values[kept, k] = _means(each, columns.rows[there], numbers, counts, mapping)
    return MeanCommands(values, rows, True)


def _means(values: Array, rows: NDArray[np.int64], kept: NDArray[np.int64], counts: Array, mapping: Mapping) -> Array:
    """Mean command of each kept row, (m,); that of the last one, or of the first, is its own.

    Args:
        values: (c,) commands.
        rows: (c,) numbers of their rows.
        kept: (m,) numbers of the kept rows, all of which have a command.
        counts: (m - 1,) rows for which the command of a kept row stands, or that of the next where it acts before it.
        mapping: that says when commands act.
    """
    own = values[np.searchsorted(rows, kept)]
    if mapping.command_is_sample:
        steps = 0.5 * (values[1:] + values[:-1]) * np.diff(rows)
        area = np.concatenate([[0.0], np.cumsum(steps)])
        found = (np.interp(kept[:-1] + counts, rows, area) - np.interp(kept[:-1], rows, area)) / counts
        return np.append(found, own[-1])
    summed = np.concatenate([[0.0], np.cumsum(values)])
    before = mapping.command_before_sample
    last = kept[1:] + 1 if before else kept[:-1] + counts  # one beyond
    begin, end = np.searchsorted(rows, last - counts), np.searchsorted(rows, last)
    found = (summed[end] - summed[begin]) / (end - begin)
    return np.concatenate([own[:1], found]) if before else np.append(found, own[-1])


def empty_doubts(usable: NDArray[np.bool_], kept: Mask, rows: int, mapping: Mapping) -> Iterator[Doubt]:
    """A sentence on columns for whose empty fields many rows are left out.

    Args:
        usable: (n, k) whether a field is a number.
        kept: (n,) whether a row is kept.
        rows: of a sample.
        mapping: of the log, with k columns.
    """
    if np.mean(~kept) <= _MANY:
        return
    shares = 1.0 - usable.mean(axis=0)
    least = min(_MANY, float(shares.max()))  # where each is empty seldom, that which is most often
    columns = [(name, source.columns[own]) for name, source, own in sources_of_columns(mapping)]
    empty = [(*each, share) for each, share in zip(columns, shares, strict=True) if share >= least]
    said = " and ".join(f"{name} (column {column!r})" for name, column, _ in empty)
    span = " to ".join(dict.fromkeys(f"{end(share for *_, share in empty):.0%}" for end in (min, max)))
    are, them, their = ("is", "it", "its") if len(empty) == 1 else ("are", "them", "their")
    what = f", and a sample is of {rows} rows, with the mean of the commands that they have" if rows > 1 else ""
    sentence = (
        f"{said} {are} empty in {span} of the rows, which are left out{what}. Log {them} in each row; or "
        f"{_instead([name for name, *_ in empty], them, their, mapping)}"
    )
    yield Doubt(DoubtKind.ROW, empty[0][0], sentence)


def _instead(names: Sequence[str], them: str, their: str, mapping: Mapping) -> str:
    """What to do where columns cannot be logged in each row."""
    if all(name in COMMANDS for name in names):
        return f"fill {their} empty fields with the value before, where a command acts until the next one"
    rest = {name: source for name, source in mapping.quantities.items() if name not in names}
    with suppress(ConfigError):
        replace(mapping, quantities=rest)
        nulls = " ".join(f"++import.quantities.{name}=null" for name in dict.fromkeys(names))
        return f"leave {them} out, so that all rows stay ({nulls})"
    return f"fill {their} empty fields in the file by straight lines between {their} values"
