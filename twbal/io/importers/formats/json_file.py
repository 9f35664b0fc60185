"""JSON: an object of lists, a list of objects, or a list of lists; within them objects may lie in others."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from twbal.io.importers.columns import file_data
from twbal.io.importers.nested_rows import columns_of

ENDINGS = (".json",)


def content(path: Path) -> Mapping[str, Any]:
    """The lists by name."""
    whole = json.loads(file_data(path))
    if isinstance(whole, list) and all(isinstance(row, list) for row in whole):
        return {"column": whole}
    if isinstance(whole, list) and all(isinstance(row, dict) for row in whole):
        return columns_of(whole)
    if not isinstance(whole, dict):
        raise ValueError("it is neither an object of lists nor a list of objects or lists")
    return {name: value for name, value in whole.items() if isinstance(value, list | dict)}
