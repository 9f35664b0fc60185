"""The table of `python -m benchmarks.robustness`."""

from collections.abc import Mapping
from typing import Any

from twbal.algorithm.robustness import Robustness
from twbal.core.json_records import decoded
from twbal.viz.robustness_page import table_rows


def robustness(results: Mapping[str, Any]) -> list[str]:
    """A row for each method."""
    head, *rows = table_rows(decoded(Robustness, results, "robustness"))
    return [f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *rows)]
