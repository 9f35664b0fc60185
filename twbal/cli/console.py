"""How every stage begins and ends on the command line: its run folder, what it made there, and what comes next."""

import re
import shlex
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import Any, TypeVar, cast

from hydra.conf import HydraConf
from hydra.core.global_hydra import GlobalHydra
from hydra.core.hydra_config import HydraConfig
from hydra.errors import HydraException
from hydra.types import RunMode
from omegaconf import DictConfig, OmegaConf, read_write
from omegaconf.errors import OmegaConfBaseException

from twbal.cli.commands import compose_stage, text
from twbal.cli.conf_folder import conf_folder
from twbal.cli.manifest import Manifest
from twbal.cli.settings.nested_settings import flattened

LISTED = 3  # files of one folder that are named one by one
BETWEEN_LINES = 5.0  # of progress [s]
_GENTLE = 0.1  # command that costs as much as a width of the state, as a share of the torque limit
_EXPERIMENT = "experiment"
Item = TypeVar("Item")


def gently(recorded_by: object = None) -> dict[str, str | float]:
    """Settings of `real-rollout` that record a robot which falls otherwise.

    Args:
        recorded_by: `policy.command_width` of the regulator under which it fell, which is then halved if it is as small
            already; anything else: it is not known.
    """
    width = _GENTLE
    if isinstance(recorded_by, float) and 0.0 < recorded_by <= _GENTLE:
        width = 0.5 * recorded_by
    return {"experiment": "excite", "policy.command_width": width}


def run_folder() -> Path:
    """Hydra's folder for this run, relative to the working directory where it lies in it."""
    folder = Path(HydraConfig.get().runtime.output_dir)
    return folder.relative_to(Path.cwd()) if folder.is_relative_to(Path.cwd()) else folder


def configuration_flags() -> list[str]:
    """The words by which this run was given configuration of the user's own."""
    sources = [(source.provider, source.path) for source in HydraConfig.get().runtime.config_sources]
    replaced = [f"--config-path={path}" for who, path in sources if who == "main" and Path(path) != conf_folder()]
    added = [f"--config-dir={path}" for who, path in sources if who == "command-line"]
    searched = [word for word in HydraConfig.get().overrides.hydra if word.startswith("hydra.searchpath=")]
    return replaced + added + searched


def overridden(key: str) -> bool:
    """Whether this run was given a value of a key by a word of the command line."""
    return any(word.split("=", 1)[0].lstrip("+") == key for word in HydraConfig.get().overrides.task)


def has_group(name: str) -> bool:
    """Whether the configuration of this run has a choice of a group."""
    return HydraConfig.get().runtime.choices.get(name) is not None


def add_override(word: str) -> None:
    """Let this run count as given a word that it goes by, for the next commands that it prints.

    It takes the place of a word for the same key.
    """
    hydra = HydraConfig.get()
    with read_write(cast(DictConfig, hydra)):
        hydra.overrides.task = last_of_each([*hydra.overrides.task, word])


def last_of_each(words: Iterable[str]) -> list[str]:
    """Overrides, of which the last one for each key is kept: it is the one that counts."""
    kept = dict[str, str]()
    for word in words:
        key = word.partition("=")[0]
        kept.pop(key, None)
        kept[key] = word
    return list(kept.values())


def chosen_overrides(*groups: str) -> str:
    """The words that give a next command what this run chose and set of `groups` (such as robot, state), for a shell.

    Of a choice that an experiment or a method made, too. Where this stage has no `sim`, that of the robot's own name
    is chosen, if there is one.
    """
    return "".join(f" {shlex.quote(word)}" for word in _chosen_words(groups))


def _chosen_words(groups: Sequence[str]) -> list[str]:
    """The same words, not quoted."""
    if not groups:
        return []
    hydra = HydraConfig.get()
    given = last_of_each(hydra.overrides.task)
    words = [word for word in given if re.match(rf"[+~]*({'|'.join(groups)})\b", word)]
    default = _default_choices(hydra)
    chosen = {group: hydra.runtime.choices[group] for group in groups if group in default}
    overridden = {word.split("=", 1)[0] for word in words}
    found = [
        f"{group}={choice}" for group, choice in chosen.items() if choice != default[group] and group not in overridden
    ]
    if hydra.runtime.choices.get(_EXPERIMENT) is not None:
        found += _values_of_experiment(hydra, groups, default)
    if "sim" in groups and "sim" not in default:
        simulations = GlobalHydra.instance().config_loader().get_group_options("sim")
        found += [f"sim={robot}" for robot in [hydra.runtime.choices["robot"]] if robot in simulations]
    return [*words, *found]


def _values_of_experiment(hydra: HydraConf, groups: Sequence[str], default: Mapping[str, Any]) -> list[str]:
    """The words that set what an experiment set in groups, beside the choices that it made and what words set.

    Args:
        hydra: of this run.
        groups: in which it may have set values.
        default: what this run's configuration chooses of each group, by itself.
    """
    stage, task = str(hydra.job.config_name), [str(word) for word in hydra.overrides.task]
    without = [word for word in task if not word.startswith(f"{_EXPERIMENT}=")]
    made = {group: choice for group, choice in hydra.runtime.choices.items() if default.get(group, choice) != choice}
    chosen = [f"{group}={choice}" for group, choice in made.items() if group != _EXPERIMENT]
    try:
        own, wanted = (compose_stage(stage, each) for each in ([*chosen, *without], task))
    except (HydraException, OmegaConfBaseException):  # what words set is there with the experiment alone
        return []
    found = []
    for group in groups:
        before, after = (OmegaConf.to_container(OmegaConf.masked_copy(cfg, [group])) for cfg in (own, wanted))
        if isinstance(before, dict) and isinstance(after, dict):
            values = dict(flattened(before))
            changed = [(key, value) for key, value in flattened(after) if key not in values or value != values[key]]
            found += [f"{'' if key in values else '+'}{key}={text(value)}" for key, value in changed]
    return found


def _default_choices(hydra: HydraConf) -> Mapping[str, Any]:
    """What this run's configuration chooses of each group, by itself."""
    made = hydra.runtime.choices
    chosen = {word.split("=", 1)[0] for word in hydra.overrides.task}
    if not any(key in made or key.startswith(("+", "~")) for key in chosen):  # composing takes as long as short stages
        return made
    loader = GlobalHydra.instance().config_loader()
    defaults = loader.compute_defaults_list(hydra.job.config_name, [], RunMode.RUN)  # half the time of composing
    choices: Mapping[str, Any] = defaults.overrides.known_choices
    return choices


def next_command(stage: str, settings: Mapping[str, Any], *groups: str) -> str:
    """The shell command of a stage that comes next.

    Args:
        stage: its name on the command line.
        settings: what it is told, by key: paths or plain values.
        groups: of which it takes what this run chose and set, as in `chosen_overrides`.
    """
    words = [f"{key}={text(str(value) if isinstance(value, Path) else value)}" for key, value in settings.items()]
    chosen = [word for word in _chosen_words(groups) if word.partition("=")[0] not in settings]
    return shlex.join(["twbal", stage, *configuration_flags(), *words, *chosen])


def say(line: str) -> None:
    """Print what is being done."""
    print(f"  {line}", flush=True)


def say_link(does: str, following: str) -> None:
    """Say that the next command is about a virtual robot, unless the link of the one that was recorded is given.

    Args:
        does: what that command does, such as `learns on`.
        following: that command.
    """
    instead = " in the place of link.overrides=[...]" if "link.overrides=" in following else ""
    say(f"the next command {does} a virtual robot, unless you add the link of the robot that was recorded to it:")
    say(f"link=serial link.port=...{instead}, or link.seed=... of a virtual robot")


class Progress:
    """Prints how much of something is done, where it takes long.

    Args:
        what: is counted.
        total: of them.
    """

    def __init__(self, what: str, total: int) -> None:
        self._what, self._total, self._last = what, total, time.monotonic()

    def show(self, number: int, more: str = "") -> None:
        """Print that `number` of them are done, and what else is known, if the last line is some time ago."""
        if time.monotonic() - self._last > BETWEEN_LINES:
            say(f"{number} of {self._total} {self._what}{more}")
            self._last = time.monotonic()


def with_progress(items: Iterable[Item], what: str, total: int) -> Iterator[Item]:
    """The items, counted on the way."""
    progress = Progress(what, total)
    for number, item in enumerate(items, start=1):
        progress.show(number)
        yield item


def print_result(manifest: Manifest, out: Path, following: str) -> None:
    """Print what a stage made and the command that would come next."""
    print_made(manifest, out)
    print(f"next  {following}")


def print_made(manifest: Manifest, out: Path) -> None:
    """Print what a stage made."""
    folders = Counter(PurePosixPath(made.path).parent for made in manifest.outputs)
    for folder, count in folders.items():
        if count > LISTED:
            print(f"made  {out / folder}/ ({count} files)")
    for made in manifest.outputs:
        if folders[PurePosixPath(made.path).parent] <= LISTED:
            print(f"made  {out / made.path}")
