"""A robot by the path of its sheet: `robot=my_conf/robot/my_robot.yaml` for `--config-dir=my_conf robot=my_robot`."""

import re
from collections.abc import Sequence
from pathlib import Path

from twbal.cli.commands import text
from twbal.cli.conf_folder import conf_folder
from twbal.core.errors import ConfigError

_SHEET = re.compile(r"""robot=(['"]?)(.*\.ya?ml)\1""")
"""Maybe with quotes about the path, which Hydra takes about any text."""
_FOLDER = "robot"  # in which Hydra looks for the choices of a group
_FLAGS = ("--config-dir", "-cd")


def with_sheet_folder(words: Sequence[str]) -> list[str]:
    """Words in which a robot that is named by the path of its sheet is a choice from the folder of that sheet.

    Args:
        words: overrides and Hydra's flags.

    Raises:
        ConfigError: there is no such file, it cannot be chosen where it lies, or another folder is given besides.
    """
    paths = {word: found.group(2) for word in words if (found := _SHEET.fullmatch(word))}
    if not paths:
        return list(words)
    sheet = Path(list(paths.values())[-1])
    _check(sheet)
    folder = sheet.parent.parent
    given = _given_folder(words)
    if given is not None and given.resolve() != folder.resolve():
        raise ConfigError(
            f"The sheet {sheet} is not in {given}, and Hydra takes a single --config-dir. Leave out --config-dir, or "
            f"move the sheet into {given / _FOLDER}."
        )
    flags = [] if given is not None else [f"--config-dir={folder}"]
    return [f"robot={text(sheet.stem)}" if word in paths else word for word in words] + flags


def _check(sheet: Path) -> None:
    if not sheet.is_file():
        raise ConfigError(
            f"There is no robot sheet {sheet}. Give the name of a packaged robot, such as robot=paper, or the path of "
            "a sheet; `twbal new-robot` writes one."
        )
    if sheet.parent.name != _FOLDER or sheet.suffix != ".yaml":
        place = Path("my_conf") / _FOLDER / f"{sheet.stem}.yaml"
        raise ConfigError(
            f"The sheet {sheet} cannot be chosen where it lies: Hydra looks for .yaml files in a folder named "
            f"{_FOLDER!r}. Move it, and give robot={place}."
        )
    if (conf_folder() / _FOLDER / sheet.name).exists() and not sheet.parent.samefile(conf_folder() / _FOLDER):
        raise ConfigError(
            f"The sheet {sheet} has the file name of a packaged robot, which Hydra would take in its place. Rename it, "
            "and its entry name, too."
        )


def _given_folder(words: Sequence[str]) -> Path | None:
    """The folder of --config-dir; None where it is not given."""
    for before, word in zip(["", *words], words, strict=False):
        if before in _FLAGS:
            return Path(word)
        if word.startswith(tuple(f"{flag}=" for flag in _FLAGS)):
            return Path(word.partition("=")[2])
    return None
