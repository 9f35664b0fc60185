"""Files of a person's own configuration, beside the choices that are packaged."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from hydra.core.config_store import ConfigStore

from twbal.cli.commands import parsed
from twbal.cli.composition import Choice, register_nodes
from twbal.cli.conf_folder import conf_folder
from twbal.cli.flags import CONFIG_DIR, CONFIG_PATH, with_flags
from twbal.core.errors import ConfigError

_ROBOT = "robot"
_SEARCHED = "hydra.searchpath="
_FILE = "file://"


def refuse_packaged_names(words: Sequence[str]) -> None:
    """Refuse a file of one's own that has the name of a packaged choice, such as `my_conf/import/regbot.yaml`.

    Hydra takes the packaged one for the schema of such a file, and merges the two or ends with an error of its own.
    Robots are files in conf/ themselves, of which Hydra takes the packaged one and drops the other.

    Args:
        words: overrides and Hydra's flags.

    Raises:
        ConfigError: there is such a file in a folder that the words name.
    """
    for folder in _folders(words, (*CONFIG_DIR, *CONFIG_PATH)):
        register_nodes()
        for file in _named_as(ConfigStore.instance().repo, folder):
            group = file.parent.relative_to(folder).as_posix()
            own = file.with_name(f"my_{file.name}")
            raise ConfigError(
                f"{file} has the name of a packaged choice, {group}={file.stem}, which Hydra would mix with it. Rename "
                f"it, as to {own}, and choose it by {group}={own.stem}."
            )
    for folder in _folders(words, CONFIG_DIR):  # beside Hydra's own folder, which comes first
        for sheet in sorted((conf_folder() / _ROBOT).glob("*.yaml")):
            file = folder / _ROBOT / sheet.name
            if file.is_file() and not file.samefile(sheet):
                own = file.with_name(f"my_{file.name}")
                raise ConfigError(
                    f"{file} has the name of a packaged robot, {_ROBOT}={file.stem}, which Hydra would take in its "
                    f"place. Rename it, as to {own}, and its entry name, too; choose it by {_ROBOT}={own.stem}."
                )


def refuse_missing_folders(overrides: Sequence[str]) -> None:
    """Refuse a folder of `hydra.searchpath` that is not there, which Hydra only warns of.

    Args:
        overrides: without Hydra's flags.

    Raises:
        ConfigError: there is such a folder.
    """
    for folder in _folders(overrides, ()):
        if not folder.is_dir():
            raise ConfigError(f"{_SEARCHED}[...] names the folder {folder}, which is not there. Check its path.")


def _folders(words: Sequence[str], flags: Sequence[str]) -> Iterator[Path]:
    """The folders in which Hydra is to look for configuration: those of flags, and of its search path."""
    for word in with_flags(words):
        if word.flag in flags and word.value is not None:
            yield Path(word.value)
        elif word.text.startswith(_SEARCHED):
            yield from map(Path, _searched(word.text))


def _searched(word: str) -> list[str]:
    """The folders of a word `hydra.searchpath=[...]`; none where Hydra, too, cannot read it."""
    value = override.value() if (override := parsed(word)) else None
    if isinstance(value, list):
        return [path.removeprefix(_FILE) for path in map(str, value) if path.startswith(_FILE) or "://" not in path]
    return []


def _named_as(choices: Mapping[str, Any], folder: Path) -> Iterator[Path]:
    """The files of a folder that are named as choices.

    Args:
        choices: by their file names, within the names of their groups.
        folder: of the same tree.
    """
    for name, node in choices.items():
        if isinstance(node, Choice):
            if (folder / name).is_file():
                yield folder / name
        elif isinstance(node, Mapping) and (folder / name).is_dir():
            yield from _named_as(node, folder / name)
