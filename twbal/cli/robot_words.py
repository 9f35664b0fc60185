"""A robot by the path of its sheet: `robot=my_conf/robot/my_robot.yaml` for `--config-dir=my_conf robot=my_robot`."""

import re
from collections.abc import Sequence
from glob import escape
from pathlib import Path

from hydra.conf import HydraConf

from twbal.cli.commands import swept, text
from twbal.cli.conf_folder import conf_folder
from twbal.cli.flags import CONFIG_DIR, with_flags
from twbal.core.errors import ConfigError

_KEY, _ENDINGS = "robot=", (".yaml", ".yml")
_SHEET = re.compile(r"""robot=(['"]?)(.*\.ya?ml)\1""")
"""Maybe with quotes about the path, which Hydra takes about any text."""
_FOLDER = "robot"  # in which Hydra looks for the choices of a group
_ADVICE = (
    "Give the name of a packaged robot, such as robot=paper, or the path of a sheet; `twbal new-robot` writes one."
)


def with_sheet_folder(words: Sequence[str]) -> list[str]:
    """Words in which a robot that is named by the path of its sheet is a choice from the folder of that sheet.

    Of several robots, over which a sweep goes, those that are named so lie in one folder.

    Args:
        words: overrides and Hydra's flags.

    Raises:
        ConfigError: there is no such file, it cannot be chosen where it lies, or another folder is given besides.
    """
    named = {word: robots for word in words if word.startswith(_KEY) and (robots := _robots(word))}
    if not named:
        return list(words)
    given = _given_folder(words)
    sheets = [Path(robot) for robot in list(named.values())[-1] if _is_path(robot)]
    for sheet in sheets:
        _check(sheet, given)
    folder = sheets[0].parent.parent
    for sheet in sheets:
        _check_folder(sheet, sheets[0], given)
    flags = [] if given is not None else [f"--config-dir={folder}"]
    return [_by_name(named[word]) if word in named else word for word in words] + flags


def sheet_of(hydra: HydraConf) -> Path | None:
    """The file of the robot that a run chose, which Hydra found; None where it is in no folder.

    Args:
        hydra: what Hydra keeps of itself in that run.
    """
    choice = hydra.runtime.choices.get(_FOLDER)
    for source in hydra.runtime.config_sources:
        path = Path(source.path) / _FOLDER / f"{choice}.yaml"
        if source.schema == "file" and path.is_file():
            return path
    return None


def _robots(word: str) -> list[str]:
    """The robots that a word names by paths: one, or those of a sweep; none where there is no path."""
    one = _SHEET.fullmatch(word)
    if one is None or not Path(one.group(2)).is_file():  # whose name may have a comma
        several = swept(word)
        if any(map(_is_path, several)):
            return several
    return [one.group(2)] if one else []


def _is_path(robot: str) -> bool:
    return robot.endswith(_ENDINGS)


def _by_name(robots: Sequence[str]) -> str:
    """The word that chooses robots, each by its name."""
    return _KEY + ",".join(text(Path(robot).stem if _is_path(robot) else robot) for robot in robots)


def _check(sheet: Path, given: Path | None) -> None:
    """Whether a sheet is there, and can be chosen where it lies.

    Args:
        sheet: its path.
        given: folder of --config-dir.
    """
    if not sheet.is_file():
        raise ConfigError(f"There is no robot sheet {sheet}{_elsewhere(sheet, given)}")
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


def _elsewhere(sheet: Path, given: Path | None) -> str:
    """Where a sheet of that name is, as the end of a sentence, and how it is chosen; else which robots there are."""
    name = f"{sheet.stem}.yaml"
    if given is not None and (given / _FOLDER / name).is_file():
        return f"; there is {given / _FOLDER / name}: give {_KEY}{text(sheet.stem)} beside --config-dir={given}."
    if (conf_folder() / _FOLDER / name).is_file():
        return f"; twbal has a robot of that name: give {_KEY}{text(sheet.stem)}."
    for found in sorted(Path.cwd().glob(f"*/{_FOLDER}/{escape(name)}"))[:1]:
        path = found.relative_to(Path.cwd())
        return f"; there is {path}: give {_KEY}{text(str(path))}."
    return f". {_ADVICE}"


def _check_folder(sheet: Path, first: Path, given: Path | None) -> None:
    """Whether a sheet lies in the folder that Hydra is given: --config-dir, or that of the first sheet."""
    if given is not None and given.resolve() != sheet.parent.parent.resolve():
        raise ConfigError(
            f"The sheet {sheet} is not in {given}, and Hydra takes a single --config-dir. Leave out --config-dir, or "
            f"move the sheet into {given / _FOLDER}."
        )
    if sheet.parent.resolve() != first.parent.resolve():
        raise ConfigError(
            f"The sheets {first} and {sheet} lie in two folders, and Hydra takes a single --config-dir. Move one of "
            f"them into {first.parent}, or run the command once for each."
        )


def _given_folder(words: Sequence[str]) -> Path | None:
    """The folder of --config-dir; None where it is not given."""
    values = (word.value for word in with_flags(words) if word.flag in CONFIG_DIR)
    return next((Path(value) for value in values if value is not None), None)
