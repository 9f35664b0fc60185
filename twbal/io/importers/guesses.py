"""Mappings that are proposed for several files: which files share one, and where the others differ."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from twbal.io.importers.guess import Guess

_SAMPLED = "command_is_sample"


class Alike(NamedTuple):
    """Files for which the same mapping is proposed.

    Attributes:
        files: of them; the first one is that of the guess.
        guess: of the first.
        differs: one sentence for each entry that is not as in the mapping of the first file of all.
    """

    files: tuple[Path, ...]
    guess: Guess
    differs: tuple[str, ...]


def alike(found: Iterable[tuple[Path, Guess]]) -> list[Alike]:
    """Put files together that are mapped alike; comments and largest values may differ.

    Not every log of a robot shows that its loop may be faster (`command_is_sample`). Where one does, it is open for all
    that are mapped alike otherwise, and that one comes first.

    Args:
        found: files in the order in which they were given, at least one.
    """
    groups: list[tuple[list[Path], Guess, Mapping[str, Any]]] = []
    for path, guess in found:
        described = yaml.safe_load(guess.mapping)
        for number, (files, _, other) in enumerate(groups):
            if described == other or (_is_open(other) and _without(described) == _without(other)):
                files.append(path)
                break
            if _is_open(described) and _without(described) == _without(other):
                groups[number] = [path, *files], guess, described
                break
        else:
            groups.append(([path], guess, described))
    first, name = groups[0][2], groups[0][0][0].name
    return [
        Alike(tuple(files), guess, () if described is first else tuple(_differences(described, first, name)))
        for files, guess, described in groups
    ]


def _is_open(described: Mapping[str, Any]) -> bool:
    return bool(described[_SAMPLED] == "???")


def _without(described: Mapping[str, Any]) -> Mapping[str, Any]:
    return {key: entry for key, entry in described.items() if key != _SAMPLED}


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
