"""Hydra's flags among the words of a command."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

CONFIG_DIR, CONFIG_PATH = ("--config-dir", "-cd"), ("--config-path", "-cp")
_WITH_A_VALUE = (
    *("--cfg", "-c", "--info", "-i", "--package", "-p", "--config-name", "-cn"),
    *(*CONFIG_PATH, *CONFIG_DIR, "--experimental-rerun"),
)


class Word(NamedTuple):
    """A word, and what it is of a flag: `--flag value` or `--flag=value`.

    Attributes:
        text: the word itself.
        flag: that it is, or is the value of; "" of an override.
        value: of the flag, where this word has it.
    """

    text: str
    flag: str
    value: str | None


def with_flags(words: Sequence[str]) -> Iterator[Word]:
    """The words, each with what it is of a flag."""
    for before, word in zip(["", *words], words, strict=False):
        flag, equals, value = word.partition("=")
        if before in _WITH_A_VALUE:
            yield Word(word, before, word)
        elif word.startswith("-"):
            yield Word(word, flag, value if equals else None)
        else:
            yield Word(word, "", None)
