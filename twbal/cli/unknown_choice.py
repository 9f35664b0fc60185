"""What is said of a choice that a group does not have: how it is likeliest meant, and how that is written."""

import difflib
import re
import shlex
from glob import escape
from pathlib import Path

from hydra.core.global_hydra import GlobalHydra
from hydra.errors import MissingConfigException

from twbal.cli.commands import text
from twbal.cli.composition import composing
from twbal.cli.settings.renamed import CHOICES, CHOICES_INSTEAD
from twbal.core.errors import install_advice

_SIMULATION, _POLICY = "sim", "policy"
_PLUGINS = ("hydra/launcher", "hydra/sweeper", "hydra/sweeper/sampler")
_ENDINGS = (".yaml", ".yml")


def no_such_choice(error: MissingConfigException, in_python: bool) -> str:
    """What is said of `error`.

    Args:
        error: of Hydra.
        in_python: whether a function of the library was called in place of a command.
    """
    group, choice = _group_and_choice(error)
    options = error.options or choices_of(group)  # Hydra has none where several were chosen: group=[a,b]
    if not group or not options:
        return (str(error).splitlines() or [""])[0].strip()
    now = CHOICES.get(group, {}).get(choice)
    if now is not None:
        return f"{group} has no choice {choice!r} any more: it is called {now!r} now."
    instead = CHOICES_INSTEAD.get(group, {}).get(choice)
    if instead is not None:
        return f"{group} has no choice {choice!r} any more: {instead}."
    near = difflib.get_close_matches(choice, options, n=1)
    guess = f" (did you mean {near[0]!r}?)" if near else ""
    more = f" Others come with {install_advice('sweeps')}." if group in _PLUGINS else ""
    more += _of_file(group, choice, str(error), in_python) or _of_run(group, choice)
    return f"{group} has no choice {choice!r}{guess}. The choices are: {', '.join(options)}.{more}"


def choices_of(group: str) -> list[str]:
    """All choices of a group of twbal's; none where it has no such group."""
    with composing():
        return GlobalHydra.instance().config_loader().get_group_options(group) if group else []


def _group_and_choice(error: MissingConfigException) -> tuple[str, str]:
    """The group, and what was chosen of it, maybe a path."""
    missing = error.missing_cfg_file or ""
    named = re.search(r"^Available options in '([^']+)'", str(error), re.MULTILINE)
    if named and missing.startswith(f"{named.group(1)}/"):
        return named.group(1), missing.removeprefix(f"{named.group(1)}/")
    group, _, choice = missing.rpartition("/")
    return group, choice


def _of_run(group: str, choice: str) -> str:
    """What is said where a file or a run folder may be meant by a path."""
    if group == _POLICY and Path(choice).exists():
        return f" Is the file or run folder {choice} meant? Give {_POLICY}=saved {_POLICY}.path={choice}."
    if group == _SIMULATION and "/" in choice:
        return f" Nor is there a file or run folder {choice}."
    return ""


def _of_file(group: str, choice: str, said: str, in_python: bool) -> str:
    """What is said where a yaml file is meant, by its path or by its name; "" where there is none."""
    path = Path(choice)
    if choice.endswith(_ENDINGS) and path.is_file():
        places = tuple(group.split("/"))
        if path.suffix == ".yaml" and path.parts[-1 - len(places) : -1] == places:
            folder = Path(*path.parts[: -1 - len(places)])
            return f" For that file {_of_folder(group, path.stem, folder, said, in_python, True)}."
        return (
            f" That file cannot be chosen where it lies: Hydra looks for .yaml files in a folder named {group!r}. Move "
            f"it to my_conf/{group}/{path.stem}.yaml, and give --config-dir=my_conf {group}={text(path.stem)}."
        )
    name = choice.removesuffix(".yaml")
    for file in sorted(Path.cwd().glob(f"*/{escape(group)}/{escape(name)}.yaml"))[:1]:
        folder = Path(file.relative_to(Path.cwd()).parts[0])
        how = _of_folder(group, name, folder, said, in_python, name != choice)
        return f" There is one in the folder {folder}: {how}."
    return ""


def _of_folder(group: str, name: str, folder: Path, said: str, in_python: bool, is_file: bool) -> str:
    """How a choice in a folder of one's own is chosen.

    Args:
        group: of the choice.
        name: of the choice.
        folder: in which there is a folder of the group.
        said: by Hydra, with the folders in which it looked.
        in_python: as above.
        is_file: whether the choice was given as a file, so that its name has to be said.
    """
    chosen = f"{group}={text(name)}"
    if in_python:
        if group == "robot":
            return f"give its path, '{folder}/robot/{name}.yaml', in place of the name"
        return f"add 'hydra.searchpath=[{folder}]' to the overrides" + (f", and {chosen!r}" if is_file else "")
    looked_in = re.findall(r"path=file://(.*)$", said, re.MULTILINE)
    flags = [] if str(folder.resolve()) in looked_in else [f"--config-dir={folder}"]
    return f"give {shlex.join([*flags, chosen])}" if is_file else f"add {shlex.join(flags)}"
