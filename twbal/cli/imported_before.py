"""Logs that an earlier call of import-log has imported already, into a folder beside this one or into its own."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import yaml

from twbal.cli.manifest import MANIFEST, Manifest, read_manifest
from twbal.core.episode import Episode
from twbal.core.errors import DataError
from twbal.io.importers.duplicates import duplicated
from twbal.io.logs import read_episode

_NEWEST = 50  # folders that are looked through
_MOST = 100  # of their recordings that are read


class ImportedBefore(NamedTuple):
    """What an earlier import has of this one.

    Attributes:
        sentence: that says it.
        is_expected: whether a file was imported again with another mapping, as who mends the mapping does.
    """

    sentence: str
    is_expected: bool


def imported_before(manifest: Manifest, out: Path) -> Iterator[ImportedBefore]:
    """Sentences on files, or on rows of them, that lie in other folders of imports beside `out`.

    Args:
        manifest: of the import that was done.
        out: its run folder.
    """
    others = _others(out)
    before = [(folder, other, {r.sha256: r.path for r in other.inputs.get("files", ())}) for folder, other in others]
    known = set()
    for record in manifest.inputs.get("files", ()):
        if found := [(folder, other, paths) for folder, other, paths in before if record.sha256 in paths]:
            known.add(Path(record.path).stem)
            more = len(found) - 1
            and_others = f" and {more} other folder{'s' if more > 1 else ''}" if more else ""
            sentence = (
                f"{record.path} has been imported before, into {found[0][0]}{and_others}: give later stages one of "
                "them or this one, as recordings that count twice make a diagnosis too certain"
            )
            is_expected = all(
                paths[record.sha256] == record.path and _differ_by_mapping(other, manifest) for _, other, paths in found
            )
            yield ImportedBefore(sentence, is_expected)
    mine = {
        name: episode
        for name, episode in _episodes(out, manifest)
        if not any(name == k or name.startswith(f"{k}_") for k in known)
    }
    if mine:
        yield from (ImportedBefore(sentence, False) for sentence in _same_rows(mine, others))


def _differ_by_mapping(one: Manifest, other: Manifest) -> bool:
    """Whether the settings of two imports differ by their mapping, and by nothing else."""
    ours, theirs = (dict(yaml.safe_load(each.settings)) for each in (one, other))
    return bool(ours.pop("import", None) != theirs.pop("import", None) and ours == theirs)


def _same_rows(mine: dict[str, Episode], others: list[tuple[Path, Manifest]]) -> Iterator[str]:
    """Recordings that were cut or renamed since: most of their rows are in an earlier one."""
    theirs = [(f"{folder}/{name}", e) for folder, other in others for name, e in _episodes(folder, other)][:_MOST]
    for name, episode in mine.items():
        for other_name, other in theirs:
            yield from duplicated([other, episode], [other_name, name])


def _others(out: Path) -> list[tuple[Path, Manifest]]:
    """The newest complete imports beside a folder."""
    beside = out.resolve().parent.glob(f"*/{MANIFEST}")
    files = [path for path in beside if path.parent.resolve() != out.resolve()]
    found = []
    for path in sorted(files, key=lambda path: path.stat().st_mtime, reverse=True)[:_NEWEST]:
        try:
            manifest = read_manifest(path.parent)
        except DataError:  # of another version; it has nothing to do with what is imported now
            continue
        if manifest is not None and manifest.stage == "import-log" and manifest.complete:
            found.append((out.parent / path.parent.name, manifest))
    return found


def _episodes(folder: Path, manifest: Manifest) -> Iterator[tuple[str, Episode]]:
    for made in manifest.outputs:
        path = folder / made.path
        if path.suffix == ".mcap" and path.exists():
            try:
                yield path.stem, read_episode(path)
            except DataError:  # damaged since
                continue
