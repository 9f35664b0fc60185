"""Whether the arguments of a function of the library can be meant, before anything is done with them."""

from collections.abc import Callable, Iterable, Sequence
from numbers import Integral
from os import PathLike
from pathlib import Path
from typing import Any, get_args

from twbal.core.errors import ConfigError
from twbal.core.plant import Plant
from twbal.core.robot_parameters import RobotParameters
from twbal.effects.effect import Effect
from twbal.effects.library import all_effects
from twbal.link.serial_plant import SerialPlant
from twbal.policies.policy import Policy
from twbal.policies.saved import SavedPolicy

_EXPECTED_POLICY = "a policy, or the path of a policy.pt"
_EXPECTED_EFFECTS = "effects must be a list of effects, such as [DeadZone(width=1.0)] of twbal.effects.dead_zone"


def check_whole(name: str, value: object, least: int) -> None:
    """Raise ConfigError where an argument is no whole number, or less than `least`."""
    if isinstance(value, bool) or not isinstance(value, Integral) or value < least:
        raise ConfigError(f"{name} must be a whole number of at least {least}; found {value!r:.80}.")


def check_path(name: str, path: object, of: str) -> None:
    """Raise ConfigError where an argument is no path.

    Args:
        name: of the argument.
        path: that it has.
        of: what the path is of, as a phrase.
    """
    if not isinstance(path, str | PathLike):
        raise ConfigError(f"{name} must be the path of {of}; found {_said(path)}.")


def check_policy(policy: object) -> None:
    """Raise ConfigError where something is neither a policy nor the path of one."""
    if isinstance(policy, str | Path) and not Path(policy).is_file() and not Path(policy).suffix:
        raise ConfigError(
            f"policy must be {_EXPECTED_POLICY}; there is no file {str(policy)!r}. Are two arguments swapped?"
        )
    if isinstance(policy, Policy | str | Path) or _has_controller(policy):
        return
    advice = ""
    if isinstance(policy, RobotParameters):
        advice = " Are two arguments swapped?"
    elif isinstance(policy, type) and issubclass(policy, Policy):
        advice = f" {policy.__name__} is a class: make a policy of it by {policy.__name__}(...)."
    elif callable(policy):
        advice = (
            " A function becomes a policy as what `controller` of a class of yours returns, derived from "
            "twbal.policies.policy.Policy."
        )
    raise ConfigError(f"policy must be {_EXPECTED_POLICY}; found {_said(policy)}.{advice}")


def check_saved(policy: object) -> None:
    """Raise ConfigError where something is no policy that a file can hold."""
    if not isinstance(policy, SavedPolicy):
        kinds = ", ".join(kind.__name__ for kind in get_args(SavedPolicy))
        raise ConfigError(f"policy must be one that a file can hold ({kinds}); found {_said(policy)}.")


def checked_effects(effects: object) -> tuple[Effect, ...]:
    """The effects, in order.

    Raises:
        ConfigError: they are no list, or one is no effect.
    """
    if isinstance(effects, Effect):
        raise ConfigError(f"{_EXPECTED_EFFECTS}; found an effect alone. Write [{effects!r}].")
    if isinstance(effects, str) or not isinstance(effects, Iterable):
        raise ConfigError(f"{_EXPECTED_EFFECTS}; found {_said(effects)}.{_about_name(effects)}")
    found = tuple(effects)
    for effect in found:
        if isinstance(effect, type) and issubclass(effect, Effect):
            raise ConfigError(
                f"{_EXPECTED_EFFECTS}; found the class {effect.__name__} among them. Give it its values: "
                f"{effect.__name__}(...)."
            )
        if not isinstance(effect, Effect):
            raise ConfigError(f"{_EXPECTED_EFFECTS}; found {_said(effect)} among them.{_about_name(effect)}")
    return found


def check_plant(plant: object) -> None:
    """Check that something is a robot that can be driven.

    Raises:
        ConfigError: it is none.
        LinkError: it was closed.
    """
    if isinstance(plant, SerialPlant):
        plant.check_open()
    if isinstance(plant, Plant):
        return
    advice = "of `with twbal.connect(port) as plant:`, or any twbal.core.plant.Plant"
    if isinstance(plant, type) and issubclass(plant, Plant):
        name = plant.__name__
        raise ConfigError(f"plant must be a robot to drive, {advice}; {name} is a class: make one by {name}(...).")
    if hasattr(plant, "__enter__"):
        raise ConfigError(f"plant must be a robot to drive, {advice}; found a connection that is not open yet.")
    raise ConfigError(f"plant must be a robot to drive, {advice}; found {_said(plant)}. Are two arguments swapped?")


def check_progress(progress: object) -> None:
    """Raise ConfigError where something is no function that could be told lines."""
    if not callable(progress):
        raise ConfigError(
            f"progress must be a function of a line of text, such as print; found {_said(progress)}. Leave it out to "
            "be told nothing."
        )


def check_tell(tell: object) -> None:
    """Raise ConfigError where something is no function that could be given episodes."""
    if not callable(tell):
        raise ConfigError(
            f"tell must be a function of an episode, such as episodes.append; found {_said(tell)}. Leave it out to be "
            "told nothing."
        )


def check_list(name: str, values: object, kind: type | tuple[type, ...], example: str) -> None:
    """Raise ConfigError where an argument is no list of values of a kind.

    Args:
        name: of the argument.
        values: that it has.
        kind: of each.
        example: what to give, as a phrase.
    """
    if not isinstance(values, Sequence) or isinstance(values, str):
        raise ConfigError(f"{name} must be {example}; found {_said(values)}, which is no list.")
    for value in values:
        if not isinstance(value, kind):
            raise ConfigError(f"{name} must be {example}; found {_said(value)} among them.")


def _has_controller(policy: object) -> bool:
    return hasattr(policy, "controller") and not isinstance(policy, type)


def _about_name(effect: object) -> str:
    """What to write in the place of an effect's name."""
    if not isinstance(effect, str) or effect not in all_effects():
        return ""
    kind = all_effects()[effect]
    return f" Write [{kind.__name__}(...)], with `from {kind.__module__} import {kind.__name__}`."


def _said(value: Any) -> str:
    """A value in a few words."""
    if isinstance(value, str | int | float | None):
        return f"{value!r:.80}"
    if isinstance(value, RobotParameters):
        return f"the parameters of the robot {value.name!r}"
    if isinstance(value, Callable) and hasattr(value, "__name__"):  # type: ignore[arg-type]
        return f"the {'class' if isinstance(value, type) else 'function'} {value.__name__}"
    name = type(value).__name__
    return f"{'an' if name[0] in 'AEIOU' else 'a'} {name}"
