"""The logs that `twbal import-log` is given: files, and neither folders nor patterns."""

import shlex
from collections import Counter
from collections.abc import Sequence
from glob import glob, has_magic
from pathlib import Path

from twbal.cli.commands import text
from twbal.core.errors import LogError
from twbal.io.importers.formats import formats

_TEXTS = (".csv", ".txt", ".tsv", ".log", ".dat")
_LISTED = 4  # files that are named one by one


def check_log_file(path: Path) -> None:
    """Refuse a folder and a pattern such as `logs/*.csv`, with the files to give in their place.

    Raises:
        LogError: it is one.
    """
    if path.is_dir():
        found = _logs_in(path)
        pattern = path / f"*{found[0].suffix}" if found else path / "*.csv"
        raise LogError(f"{path} is a folder; expected are files. {_advice(pattern, found, 'it has no logs in it')}")
    if has_magic(str(path)) and not path.exists():
        found = [Path(each) for each in sorted(glob(str(path)))]
        raise LogError(f"{path} is a pattern; expected are files. {_advice(path, found, 'nothing matches it')}")


def _logs_in(folder: Path) -> list[Path]:
    """The files of a folder that may be logs, of the ending that most of them have."""
    readable = {*_TEXTS, *formats()}
    files = [path for path in sorted(folder.iterdir()) if path.suffix.lower() in readable and path.is_file()]
    if not files:
        return []
    ((ending, _),) = Counter(path.suffix for path in files).most_common(1)
    return [path for path in files if path.suffix == ending]


def _advice(pattern: Path, found: Sequence[Path], none: str) -> str:
    """What to give: the files one by one, or, where they are many, a word by which bash lists them."""
    if not found:
        return f"Give each file by its path, as in 'files=[a.csv,b.csv]' ({none})."
    if len(found) <= _LISTED:
        return f"Give each by its path: {shlex.quote(f'files={text(list(map(str, found)))}')}."
    return f"Give each by its path; bash lists these {len(found)} by \"files=[$(echo {pattern} | tr ' ' ,)]\"."
