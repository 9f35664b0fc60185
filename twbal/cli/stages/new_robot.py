"""Ask for the values of a robot, and write its sheet."""

import json
import shlex
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from twbal.cli.commands import text
from twbal.cli.conf_folder import conf_folder
from twbal.cli.console import say
from twbal.cli.typed_config import typed
from twbal.cli.yaml_data import read_yaml
from twbal.core.errors import ConfigError
from twbal.core.files import write_atomically
from twbal.sheets.doubts import doubts
from twbal.sheets.interview import BACK, HELP, Interview, Person
from twbal.sheets.writing import check_name, sheet_text

_KEPT = "# Answers to `twbal new-robot`, which goes on with them.\n"


@dataclass(frozen=True)
class Settings:
    """See conf/new_robot.yaml."""

    name: str
    folder: str
    answers: str | None
    replace: bool


def main(cfg: DictConfig) -> None:
    """Ask, or take the answers that were given, and print what was made.

    Raises:
        ConfigError: an answer is missing or cannot be right, or there is a sheet of this name.
        KeyboardInterrupt: the person pressed Ctrl-C; the answers are kept.
    """
    settings = typed(Settings, cfg)
    given = {str(key): str(value) for key, value in cfg.given.items() if value is not None}
    sheet = run(settings, given)
    print(f"made  {sheet}")
    print(f"kept  {_kept_in(sheet)}, the answers")
    for doubt in doubts(instantiate(OmegaConf.load(sheet))):
        print(f"WARNING: {doubt}")
    following = ["twbal", "lqr", f"--config-dir={settings.folder}", f"robot={text(settings.name)}"]
    print(f"next  {shlex.join(following)}")


def run(settings: Settings, given: Mapping[str, str]) -> Path:
    """Write the sheet; returns its file.

    Args:
        settings: of this stage.
        given: answers, before those of files.
    """
    sheet = Path(settings.folder) / "robot" / f"{settings.name}.yaml"
    _check_place(settings, sheet)
    kept = _kept_in(sheet)
    texts = {**_read(kept, True), **(_read(Path(settings.answers)) if settings.answers else {}), **given}

    def keep(answers: Mapping[str, str]) -> None:
        lines = [f"{key}: {json.dumps(answer, ensure_ascii=False)}\n" for key, answer in answers.items()]
        write_atomically(kept, "".join([_KEPT, *lines]))

    person = Person(_ask if sys.stdin.isatty() else None, say, keep)
    if person.ask is not None:
        say(f"A number, with its unit if you like: 0.25 or 25 cm. {HELP} says how to find it; docs/new_robot.md")
        say("has pictures. Behind it where it comes from: measured, data_sheet, cad, computed or guess.")
        say(f"{BACK} goes to the question before, and the name of an earlier one, such as wheel_mass, to that one.")
    try:
        found = Interview(settings.name, texts, person).run()
    except KeyboardInterrupt:
        so_far = f"The answers so far are in {kept}; the same command goes on with them."
        print(f"\n{so_far if kept.is_file() else 'No answers were given, and nothing was written.'}", flush=True)
        raise
    write_atomically(sheet, sheet_text(settings.name, found))
    return sheet


def _check_place(settings: Settings, sheet: Path) -> None:
    check_name(settings.name)
    if (conf_folder() / "robot" / sheet.name).is_file():
        raise ConfigError(f"twbal has a robot {settings.name!r} of its own. Choose another name=..., as my_robot.")
    if sheet.exists() and not settings.replace:
        raise ConfigError(
            f"There is a sheet {sheet} already. Change it there, choose another name=..., or write it anew from the "
            "kept answers by replace=true."
        )


def _kept_in(sheet: Path) -> Path:
    """Where answers are kept; Hydra takes it for no configuration."""
    return sheet.with_suffix(".answers")


def _read(path: Path, may_be_absent: bool = False) -> dict[str, str]:
    """The answers in a file."""
    try:
        answers = read_yaml(path)
    except FileNotFoundError as error:
        if may_be_absent:
            return {}
        raise ConfigError(f"There is no file {path} of answers. Expected are lines as `body_mass: 1.09 kg`.") from error
    if not isinstance(answers, dict) or not all(isinstance(answer, str) for answer in answers.values()):
        raise ConfigError(f"{path} holds no answers; expected are lines as `body_mass: 1.09 kg`.")
    return answers


def _ask(prompt: str) -> str:
    try:
        return input(prompt)
    except EOFError as error:
        raise KeyboardInterrupt from error
