"""Mappings that are proposed for several files: which files share one, and where the others differ."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from twbal.io.importers.guess import Guess


class Alike(NamedTuple):
    """Files for which the same mapping is proposed.

    Attributes:
        files: of them, the first one first.
        guess: of the first.
        differs: one sentence for each entry that is not as in the mapping of the first file of all.
    """

    files: tuple[Path, ...]
    guess: Guess
    differs: tuple[str, ...]


def alike(found: Iterable[tuple[Path, Guess]]) -> list[Alike]:
    """Put files together that are mapped alike; comments and largest values may differ.

    Args:
        found: files in the order in which they were given, at least one.
    """
    groups: list[tuple[list[Path], Guess, Mapping[str, Any]]] = []
    for path, guess in found:
        described = yaml.safe_load(guess.mapping)
        for files, _, other in groups:
            if described == other:
                files.append(path)
                break
        else:
            groups.append(([path], guess, described))
    first, name = groups[0][2], groups[0][0][0].name
    return [
        Alike(tuple(files), guess, () if described is first else tuple(_differences(described, first, name)))
        for files, guess, described in groups
    ]


def _differences(described: Mapping[str, Any], first: Mapping[str, Any], name: str) -> Iterable[str]:
    """Sentences on entries of a mapping that are others than in the first one, which is of the file `name`."""
    pairs = [(described, first, key) for key in dict.fromkeys((*described, *first)) if key != "quantities"]
    quantities = described["quantities"], first["quantities"]
    pairs += [(*quantities, key) for key in dict.fromkeys((*quantities[0], *quantities[1]))]
    for here, there, key in pairs:
        if here.get(key) != there.get(key):
            yield f"{key}: {_shown(here.get(key))}; in {name}: {_shown(there.get(key))}"


def _shown(entry: Any) -> str:
    """An entry in one line."""
    text: str = yaml.safe_dump(entry, default_flow_style=True, allow_unicode=True, width=10_000)
    return text.strip().removesuffix("...").strip()
