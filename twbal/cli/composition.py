"""What configurations are composed of: the yaml files of conf/, and nodes that share a file.

Hydra takes one file a choice. Here the choices of most groups are a few lines each, so a group is one file,
`conf/groups/<group>.yaml`, with a key for each of its choices (and one such as `fit_f/exact` in `model.yaml` for the
choice `exact` of the group `model/fit_f`); it begins with `# @package _global_` where these set anything in the whole
configuration. And a stage's own
settings, `stage/<name>` for the configuration of a stage that runs it, are those in the stage's file but for what names
files, which is up to who runs it. The choices of the group `effect` are the effects of the library.
"""

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from math import ceil, sqrt
from pathlib import Path
from threading import RLock
from typing import Any, Self

import yaml
from hydra import initialize_config_dir
from hydra.core.config_store import ConfigNode, ConfigStore
from hydra.core.global_hydra import GlobalHydra
from omegaconf import ListConfig, OmegaConf

from twbal.cli.conf_folder import conf_folder
from twbal.cli.settings.kinds import names_files
from twbal.cli.settings.stage_settings import SECTIONS, STAGES
from twbal.core.robot_parameters import GRAVITY

_GLOBAL = "_global_"
_OF_HYDRA = ("defaults", "hydra")
_one_at_a_time = RLock()


class SharedRepository(dict[str, Any]):
    """The nodes of Hydra's store, which copies of that share.

    Hydra copies the whole store for each configuration that it composes and for each group whose choices a help text
    lists, which took seconds. It composes with a copy of the node inside (`ConfigStore.load`), so the nodes stay as
    they are.
    """

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self


class Choice(ConfigNode):
    """A node of Hydra's store that is made of its values where it is asked for: few of all choices ever are."""

    def __init__(self, name: str, values: Any, group: str, package: str | None) -> None:
        self.name, self.group, self.package, self.provider = f"{name}.yaml", group, package, "twbal"
        self._values = values

    def __getattr__(self, name: str) -> Any:
        if name != "node":
            raise AttributeError(name)
        self.node = OmegaConf.structured(self._values)
        return self.node

    def __copy__(self) -> ConfigNode:
        """Of which Hydra then copies the node: that is made once."""
        return ConfigNode(self.name, self.node, self.group, self.package, self.provider)


@contextmanager
def composing() -> Iterator[None]:
    """Let `hydra.compose` compose what twbal has, for the length of the body.

    What Hydra has composed a configuration for, such as a stage that runs, has its Hydra again afterwards. Hydra is one
    for all threads, so one thread composes at a time, and others wait.
    """
    with _one_at_a_time:
        register_nodes()
        running = GlobalHydra.instance().hydra
        GlobalHydra.instance().clear()
        try:
            with initialize_config_dir(str(conf_folder()), version_base="1.3"):
                yield
        finally:
            GlobalHydra.instance().hydra = running


def register_nodes() -> None:
    """Make known to Hydra what stands in no file of its own."""
    _register_files()
    from twbal.effects.library import nodes  # here, as effects need numpy, before which threads are set

    for name, node in nodes().items():
        _store(name, node, "effect")


@cache
def _register_files() -> None:
    """Make known what shares a file."""
    store = ConfigStore.instance()
    store.repo = SharedRepository(store.repo)
    for file in sorted((conf_folder() / "groups").glob("*.yaml")):
        package = _GLOBAL if file.read_text(encoding="utf-8").startswith(f"# @package {_GLOBAL}") else None
        for key, node in loaded(file).items():
            group, choice = f"{file.stem}/{key}".rsplit("/", 1)
            _store(choice, node, group, package)
    for stage in set(SECTIONS.values()):
        name = stage.replace("-", "_")
        _store(name, _own_settings(stage, conf_folder() / f"{name}.yaml"), "stage")


def _store(name: str, values: Any, group: str, package: str | None = None) -> None:
    """Make `values` known to Hydra as the choice `name` of a group."""
    choices = ConfigStore.instance().repo
    for part in group.split("/"):
        choices = choices.setdefault(part, {})
    node = Choice(name, values, group, package)
    choices[node.name] = node


def _own_settings(stage: str, file: Path) -> dict[str, Any]:
    """What stands in a stage's file, but for inputs."""
    inputs = {row.key for row in STAGES[stage] if names_files(row.kind)}
    return {key: value for key, value in loaded(file).items() if key not in (*_OF_HYDRA, *inputs)}


FLOAT = ("tag:yaml.org,2002:float", re.compile(r"[-+]?[0-9]+(\.[0-9]*)?[eE][-+]?[0-9]+$"), list("-+0123456789"))
"""What reads as a number beside those of YAML 1.1: `1e3`; a tag, an expression and first characters."""


class _Loader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """Reads numbers as `OmegaConf.load` does, many times as fast."""


_Loader.add_implicit_resolver(*FLOAT)


def loaded(file: Path) -> dict[str, Any]:
    """What a yaml file of conf/ says, as `OmegaConf.load` reads it."""
    node = loaded_text(file.read_bytes())
    assert isinstance(node, dict)
    return node


def loaded_text(text: str | bytes) -> object:
    """What yaml text says, as `OmegaConf.create` reads it.

    Raises:
        YAMLError: it is no yaml.
    """
    return yaml.load(text, _Loader)


def seconds_of(periods: int, control_period: float) -> float:
    """How long so many control periods are [s]; `${seconds_of:100,${robot.control_period}}` in yaml."""
    return periods * control_period


def periods_of(seconds: float, control_period: float) -> int:
    """How many control periods last so long; `${periods_of:10,${robot.control_period}}` in yaml.

    A period that cannot be gives 1; it is refused when the robot is made.
    """
    return max(round(seconds / control_period), 1) if control_period > 0.0 else 1


def scaled(value: float, unit: str, robot: Mapping[str, Any]) -> float:
    """A quantity of the robot `paper` for a robot of another size; `${scaled:0.5,m,${robot}}` in yaml.

    Lengths are in proportion to the wheel's radius, and times to that in which the body falls about the axle,
    √((I + m l²) / (m g l)). A sheet that is no robot's leaves the value as it is; it is refused when the robot is made.
    """
    if min(robot[key] for key in ("wheel_radius", "body_mass", "com_height", "body_inertia_pitch")) <= 0.0:
        return value
    length = robot["wheel_radius"] / _PAPER_RADIUS
    time = _falling_time(robot["body_mass"], robot["com_height"], robot["body_inertia_pitch"]) / _PAPER_FALLING_TIME
    factors = {"m": length, "m.s": length * time, "m/s": length / time, "rad/s": 1.0 / time}
    return value * float(factors[unit])


def _falling_time(mass: float, height: float, inertia: float) -> float:
    return sqrt((inertia + mass * height**2) / (mass * GRAVITY * height))


_PAPER_RADIUS, _PAPER_FALLING_TIME = 0.15, _falling_time(10.0, 0.3, 0.319)


def place_state(control_period: float, memory: float) -> ListConfig:
    """The channels of a state that keeps a place, with as many past commands as `memory` [s] holds, from 2 to 9.

    `${place_state:${robot.control_period},0.04}` in yaml. OmegaConf cannot put a plain list in the place of that word,
    as `--cfg job --resolve` does.
    """
    past = min(max(ceil(memory / control_period - 1e-9), 2), 9)
    commands = [f"command_{k + 1}" for k in range(past)]
    return ListConfig(["tilt", "tilt_rate", "speed", *commands, "position", "position_integral"])


OmegaConf.register_new_resolver("place_state", place_state, replace=True)
OmegaConf.register_new_resolver("periods_of", periods_of, replace=True)
OmegaConf.register_new_resolver("scaled", scaled, replace=True)
OmegaConf.register_new_resolver("seconds_of", seconds_of, replace=True)
