"""From a configuration to typed settings, and to the text that says what decided a result."""

from collections.abc import Iterable
from dataclasses import fields
from enum import Enum
from typing import Any, TypeVar, get_type_hints

import yaml
from hydra.utils import instantiate
from omegaconf import MISSING, DictConfig, OmegaConf

from twbal.cli.composition import FLOAT
from twbal.core.engine import dividing_step

Settings = TypeVar("Settings")


class _Dumper(getattr(yaml, "CSafeDumper", yaml.SafeDumper)):  # type: ignore[misc]
    """Writes what `OmegaConf.create` reads back as the same, many times as fast as `OmegaConf.to_yaml`."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


_Dumper.add_implicit_resolver(*FLOAT)


def typed(kind: type[Settings], cfg: DictConfig, **known: Any) -> Settings:
    """The fields of the dataclass `kind` from `cfg`, with their types checked (and "3" made 3).

    Args:
        kind: of the settings.
        cfg: has them by name.
        known: fields that `cfg` does not have.

    Raises:
        ValidationError: a value is of the wrong type.
        MissingMandatoryValue: one was not given.
    """
    schema, types = OmegaConf.structured(kind), get_type_hints(kind)
    names = [field.name for field in fields(kind) if field.name not in known]  # type: ignore[arg-type]
    values = {name: _member(types[name], cfg[name]) for name in names}
    settings = OmegaConf.to_object(OmegaConf.merge(schema, values, known))
    assert isinstance(settings, kind)
    return settings


def _member(kind: Any, value: Any) -> Any:
    """A value of an enumeration, which OmegaConf would look up by its name; any other as it is."""
    return kind(value) if isinstance(kind, type) and issubclass(kind, Enum) else value


def section(cfg: DictConfig, stage: str) -> DictConfig:
    """The settings of a stage within those of one that runs it: its own there, and the tilt limit that all share."""
    return OmegaConf.create({"tilt_limit": cfg.tilt_limit, **cfg[stage]})


def members(cfg: DictConfig) -> tuple[Any, ...]:
    """The objects that a list or a mapping of `_target_` nodes describes, in order."""
    built = instantiate(cfg, _convert_="all")
    return tuple(built.values() if isinstance(built, dict) else built)


def with_used_step(plain: dict[Any, Any]) -> dict[Any, Any]:
    """The same configuration, as plain values, with the physics steps that are used of those that are upper bounds."""
    robot, step = plain.get("robot"), "physics_step"
    period = robot.get("control_period") if isinstance(robot, dict) else None
    for node in (plain, plain.get("sim")):
        if isinstance(node, dict) and isinstance(node.get(step), float) and isinstance(period, float):
            node[step] = dividing_step(period, node[step])
    return plain


def recorded(cfg: DictConfig, without: Iterable[str]) -> str:
    """The resolved configuration as yaml text with sorted keys; physics steps are those that are used.

    Args:
        cfg: of a stage.
        without: dotted keys that bear on no result (paths of inputs, whose content is recorded instead; ports; numbers
            of processes).

    Raises:
        MissingMandatoryValue: a value was not given.
    """
    plain = OmegaConf.to_container(cfg, resolve=True, enum_to_str=True)
    assert isinstance(plain, dict)
    with_used_step(plain)
    for key in without:
        *parents, name = key.split(".")
        node: Any = plain
        for parent in parents:
            node = node.get(parent) if isinstance(node, dict) else None
        if isinstance(node, dict):
            node.pop(name, None)
    text = str(yaml.dump(plain, Dumper=_Dumper, default_flow_style=False, allow_unicode=True))
    if MISSING in text:
        OmegaConf.to_container(OmegaConf.create(plain), throw_on_missing=True)
    return text
