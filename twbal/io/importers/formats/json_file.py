"""JSON: an object of lists, or a list of objects."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from twbal.io.importers.columns import file_data

ENDINGS = (".json",)


def content(path: Path) -> Mapping[str, Any]:
    """The lists by name."""
    whole = json.loads(file_data(path))
    if isinstance(whole, list):
        whole = {name: [row[name] for row in whole] for name in whole[0]}
    return {name: value for name, value in whole.items() if isinstance(value, list)}
