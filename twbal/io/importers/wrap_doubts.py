"""What to say of wheels whose column jumps by the range of its numbers, and whose mapping does not tell that range."""

from collections.abc import Sequence

import numpy as np

from twbal.core.gaussian import Array
from twbal.io.importers.checks.doubt import Curves, Doubt, DoubtKind
from twbal.io.importers.columns import Columns
from twbal.io.importers.mapping import Mapping
from twbal.io.importers.slow_columns import sources_of_columns
from twbal.io.importers.wraps import counter_wrap, wraps_round

_QUANTITIES = "wheel_angle", "distance"


def with_ranges(found: Sequence[Doubt], columns: Columns, mapping: Mapping) -> list[Doubt]:
    """Doubts, of which one on wheels that jump names the range of their column, where the column tells it.

    Args:
        found: by the checks, which know the angle of the wheels alone.
        columns: that the mapping takes, in their own numbers.
        mapping: of the log.
    """
    ranges: dict[str, Doubt] = {}
    for k, (quantity, source, own) in enumerate(sources_of_columns(mapping)):
        if quantity not in _QUANTITIES or source.wraps is not None or quantity in ranges:
            continue
        values, name = columns.values[:, k], source.columns[own]
        turn = 2.0 * np.pi / abs(source.factors[own])
        wrap = counter_wrap(values) or (turn if quantity == "wheel_angle" and wraps_round(values, turn) else None)
        if wrap is not None:
            ranges[quantity] = _doubt(quantity, name, values, wrap)
    if not ranges:
        return list(found)
    others = [doubt for doubt in found if doubt.kind is not DoubtKind.JUMP or doubt.quantity not in _QUANTITIES]
    return [*ranges.values(), *others]


def _doubt(quantity: str, column: str | int, values: Array, wrap: float) -> Doubt:
    plain = f"{wrap:.10g}"
    sentence = (
        f"{quantity} jumps where column {column!r} begins anew at the end of its range, {plain}: tell that range in "
        f"the mapping (++import.quantities.{quantity}.wraps={plain})"
    )
    return Doubt(DoubtKind.JUMP, quantity, sentence, Curves(1.0, values, f"column {column}, by its rows"))
