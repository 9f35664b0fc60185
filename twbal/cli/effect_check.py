"""Refuses effects of a simulation that do not go together, or with which its robot cannot move."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from twbal.cli.settings.lookup import is_known
from twbal.core.errors import ConfigError

if TYPE_CHECKING:  # effects need numpy, before which threads are set
    from twbal.core.robot_parameters import RobotParameters
    from twbal.effects.effect import Effect

_EFFECTS = "sim.effects"


def check_effects(cfg: DictConfig) -> None:
    """Hold the effects of the simulation against each other and against the robot's torque limit.

    Args:
        cfg: of a stage.

    Raises:
        ConfigError: two are of one kind, do not go together, or leave no command that turns the wheels.
    """
    ensemble = cfg.get("ensemble")
    members = [f"ensemble.{name!s}" for name in ensemble] if isinstance(ensemble, DictConfig) else []
    for place in (_EFFECTS, *members):
        _refuse_twice(_effects_at(cfg, place))
    robot, effects = cfg.get("robot"), _effects_at(cfg, _EFFECTS)
    if effects and isinstance(robot, DictConfig) and is_known(str(robot.get("_target_"))):
        _refuse_stuck(instantiate(robot), effects)


def _effects_at(cfg: DictConfig, place: str) -> dict[str, "Effect"]:
    """The effects of a mapping that the library knows, by their dotted keys."""
    from twbal.effects.library import effect_of

    node = OmegaConf.select(cfg, place)
    nodes: Mapping[Any, Any] = node if isinstance(node, DictConfig) else {}
    return {
        f"{place}.{name}": instantiate(own)
        for name, own in nodes.items()
        if isinstance(own, DictConfig) and effect_of(str(own.get("_target_"))) is not None
    }


def _refuse_twice(effects: Mapping[str, "Effect"]) -> None:
    from twbal.effects.library import effect_name

    keys: dict[str, str] = {}
    for key, effect in effects.items():
        name = effect_name(effect)
        if name in keys:
            raise ConfigError(
                f"{keys[name]} and {key} are the effect {name} twice; give one with what both do together."
            )
        keys[name] = key


def _refuse_stuck(robot: "RobotParameters", effects: Mapping[str, "Effect"]) -> None:
    from twbal.effects.effect import torque_left

    left = torque_left(robot, list(effects.values()))
    if left > 0.0:
        return
    without = {key: torque_left(robot, [e for other, e in effects.items() if other != key]) for key in effects}
    to_blame = [key for key in effects if without[key] > 0.0] or [key for key in effects if without[key] > left]
    smaller = ", ".join(f"{key}={value:.3g}" for key, value in _of_its_size(robot, effects, to_blame))
    advice = f"try {smaller} (defaults are those of a robot of 20 N·m)" if smaller else "leave one effect out"
    raise ConfigError(
        f"With {' and '.join(to_blame)}, no command up to the torque limit of {robot.torque_limit:g} N·m turns the "
        f"wheels of {robot.name}; {advice}."
    )


def _of_its_size(
    robot: "RobotParameters", effects: Mapping[str, "Effect"], to_blame: Sequence[str]
) -> list[tuple[str, float]]:
    """Torques of effects, by their dotted keys, that are to this robot what defaults are to one of 20 N·m."""
    from twbal.effects.parameter import Scale, parameters_of

    return [
        (f"{key}.{name}", known.value * known.size(robot))
        for key in to_blame
        for name, known in parameters_of(type(effects[key])).items()
        if known.scale is Scale.TORQUE and getattr(effects[key], name) > known.value * known.size(robot)
    ]
