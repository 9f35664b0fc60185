"""Formats of foreign logs that are no text of columns: one file each, found and not listed.

A format is a module with

- `ENDINGS`, a tuple of file endings in small letters, such as `(".json",)`, and
- `content(path)`, which returns the columns by name: numbers as lists or arrays, (n,) or (n, k). It takes the bytes
  from `columns.file_data`, raises what it likes at a damaged file, and a `LogError` that names the file where it has
  advice.

`twbal.io.importers.arrays` does the rest: entries that are no numbers or of another length are passed over, and
all other errors become one that names the file.
"""

import importlib
import pkgutil
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

Content = Callable[[Path], Mapping[str, Any]]


@cache
def formats() -> dict[str, Content]:
    """What reads a file, by the file's ending."""
    names = [module.name for module in pkgutil.iter_modules(__path__)]
    modules = [importlib.import_module(f"{__name__}.{name}") for name in names]
    return {ending: module.content for module in modules for ending in module.ENDINGS}


def reader_of(path: Path) -> Content | None:
    """What reads a file, in whatever letters its ending is; None: it may be text."""
    return formats().get(path.suffix.lower())


def readable() -> str:
    """All that can be read, for messages."""
    return f"Text and files that end in {', '.join(formats())} can be read"
