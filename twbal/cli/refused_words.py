"""Refuses words of the command line that Hydra would take, and that cannot be meant."""

import re
from collections.abc import Sequence
from pathlib import Path

from twbal.core.errors import ConfigError

HOME = "Write $HOME in its place, in double quotes or none, and the shell fills it in."


def refuse_words(words: Sequence[str]) -> None:
    """Refuse words that cannot be meant.

    Args:
        words: overrides and Hydra's flags.

    Raises:
        ConfigError: a folder for results has no name, or is called ~; dots stand where a name belongs; or Hydra would
            drop a word in silence: a second --config-dir, or the folder of what is not run.
    """
    shows = any(re.match(r"(--cfg|-c)(=|$)", word) for word in words)
    for word in words:
        if not shows:  # settings are shown of what need not be there
            _refuse_dots(word)
        if word.startswith(("hydra.run.dir=", "hydra.sweep.dir=")):
            _refuse_folder(word)
    _refuse_second_folder(words)
    _refuse_without_effect(words)


def _refuse_dots(word: str) -> None:
    """Refuse the dots by which help and documents leave out a name, unless a folder has that name."""
    values = re.split(r"[,=:{}'\"\[\]]", word.partition("=")[2])
    if not word.startswith("hydra.") and any(
        "..." in value.split("/") and not Path(value).exists() for value in values
    ):
        raise ConfigError(
            f"{word} has ... where the name of a folder or a value belongs. Write your own there; each command prints "
            "the folder that it made."
        )


def _refuse_folder(word: str) -> None:
    value = word.partition("=")[2]
    if not value:
        raise ConfigError(f"{word} names no folder. Is a variable of the shell empty?")
    if re.match(r"""['"]?~(/|['"]?$)""", value):
        raise ConfigError(f"{word} is in a folder that is called ~, and not in your home folder. {HOME}")


def _refuse_second_folder(words: Sequence[str]) -> None:
    if sum(bool(re.match(r"(--config-dir|-cd)(=|$)", word)) for word in words) > 1:
        raise ConfigError(
            "Hydra takes a single --config-dir. Give one, and the other folder by "
            "\"hydra.searchpath=['file:///<its absolute path>']\"."
        )


def _refuse_without_effect(words: Sequence[str]) -> None:
    if any(word.startswith("hydra.mode=") for word in words):
        return
    sweeps = bool({"-m", "--multirun"} & set(words))
    of_other, own = ("hydra.run.dir", "hydra.sweep.dir") if sweeps else ("hydra.sweep.dir", "hydra.run.dir")
    if any(word.startswith(f"{of_other}=") for word in words):
        what = "a sweep, by -m, has" if sweeps else "a single run, without -m, has"
        raise ConfigError(f"{of_other} has no effect here: {what} its folder by {own}=...")
