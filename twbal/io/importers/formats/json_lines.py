"""JSON lines: one object a line, all with the same names; a last line that is cut off is left out."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from twbal.core.errors import LogError
from twbal.io.importers.columns import file_data
from twbal.io.importers.nested_rows import columns_of

ENDINGS = (".jsonl", ".ndjson")


def content(path: Path) -> Mapping[str, Any]:
    """The columns by name."""
    lines = [(k, line) for k, line in enumerate(file_data(path).split(b"\n"), start=1) if line.strip()]
    rows: list[dict[str, Any]] = []
    for number, line in lines:
        try:
            row = json.loads(line)
        except ValueError as error:
            if rows and number == lines[-1][0]:
                break
            raise LogError(f"Line {number} of {path} cannot be read as JSON ({error}).") from error
        if not isinstance(row, dict) or (rows and row.keys() != rows[0].keys()):
            raise LogError(f"Line {number} of {path} is no object with the names of the first line.")
        rows.append(row)
    return columns_of(rows)
