"""Names that fit below a figure."""

import re
from collections.abc import Collection, Mapping

_LONGEST = 18  # characters
_WORD_BEGINS = re.compile(r"(?<=[/_\-. ])")
_CUT = "…"


def short_names(names: Collection[str]) -> Mapping[str, str]:
    """A name of at most 18 characters for each, no two alike.

    Long names are cut: at their begin what all of them share, word by word, and at their end what is too long. Where
    that makes two of them alike, long names get a number.

    Args:
        names: no two alike.
    """
    long = [name for name in names if len(name) > _LONGEST]
    begin = _shared(min(long), max(long)) if len(long) > 1 else 0
    found = {name: _cut(name, begin) if name in long else name for name in names}
    if len(set(found.values())) < len(found):
        numbers = {name: f"{_CUT} {number}" for number, name in enumerate(names, 1)}
        for name in long:
            found[name] = found[name].rstrip(_CUT)[: _LONGEST - len(numbers[name])] + numbers[name]
    return found


def _shared(first: str, last: str) -> int:
    """Length of the words with which both names begin."""
    alike = next((k for k, (a, b) in enumerate(zip(first, last, strict=False)) if a != b), min(len(first), len(last)))
    return max((place.start() for place in _WORD_BEGINS.finditer(first[:alike])), default=0)


def _cut(name: str, begin: int) -> str:
    """The part of a name from `begin` on, as much as fits, with an ellipsis for each part that is left out."""
    short = _CUT + name[begin:] if begin else name
    return short if len(short) <= _LONGEST else short[: _LONGEST - 1] + _CUT
