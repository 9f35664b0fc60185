"""JSON: an object of lists, or a list of objects; within them objects may lie in others."""

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
    if isinstance(whole, list):
        return columns_of(whole)
    return {name: value for name, value in whole.items() if isinstance(value, list | dict)}
