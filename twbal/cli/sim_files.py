"""A simulation from a file: `sim=outputs/diagnose/.../augmented.yaml` instead of a choice of the group `sim`.

The run folder that holds such a file may stand for it.

Such a file is data, and may come from anyone: it has names of effects of twbal and numbers, and nothing in it is
looked up or called. It replaces the simulation that would have been chosen; it is not merged into it.
"""

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields
from pathlib import Path
from textwrap import wrap
from typing import Any

from omegaconf import OmegaConf

from twbal.cli.commands import parsed, swept, text
from twbal.cli.settings.robot_settings import PHYSICS_STEP
from twbal.cli.yaml_data import read_yaml
from twbal.core.errors import ConfigError

AUGMENTED, IDENTIFIED = "augmented.yaml", "identified.yaml"
"""Names of such files in the run folders of diagnose and of identify."""

_KEY, _ENDINGS = "sim=", (".yaml", ".yml")
_ADDED = re.compile(r"\+?\+?[\w/]+@sim\.effects\.(\w+)=")
_PARTS = ("physics_step", "effects", "robot")
_CONTENTS: dict[str, list[str]] = {}  # of the files that this process was given, by the word that names them
_MADE_FOR: dict[str, str] = {}  # names of robots, by the files whose simulations stand for the words given last
_LONGEST = 100  # letters of a name
_LARGEST = 1e6  # of any effect's values, in whichever SI unit
_NUMBER = re.compile(r"[+-]?(\d{1,40}\.?\d{0,40}|\.\d{1,40})([eE][+-]?\d{1,3})?")


def with_files(words: Sequence[str]) -> list[str]:
    """Overrides in which a simulation from a file stands as what the file says.

    Of several words `sim=...`, where one is a file, the last one counts. The words of the file come first, so that
    others may change its values.

    Raises:
        ConfigError: the file is not there, holds no simulation, has an effect that another word adds once more, or is
            one of several simulations.
    """
    chosen = [word for word in words if word.startswith(_KEY)]
    _MADE_FOR.clear()
    for word in chosen:
        _refuse_several(word)
    if not any(map(_is_file, chosen)):
        return list(words)
    others = [word for word in words if not word.startswith(_KEY)]
    if not _is_file(chosen[-1]):
        return [chosen[-1], *others]
    path = simulation_file(_word(chosen[-1]))
    step, effects, robot = _read(path)
    again = [name for word in others if (name := _added(word)) in effects]
    if again:
        raise ConfigError(f"{path} has {again[0]} already; change its values by sim.effects.{again[0]}.<name>=...")
    content = ["sim=nominal", *step, *(f"++sim.effects.{name}={text(node)}" for name, node in effects.items())]
    if robot:
        _MADE_FOR[str(path)] = robot
    _CONTENTS.pop(chosen[-1], None)
    _CONTENTS[chosen[-1]] = content
    return [*content, *others]


def as_given(words: Sequence[str]) -> list[str]:
    """Words of `with_files` as a person gave them: with the file in the place of what it says."""
    for given, content in reversed(_CONTENTS.items()):  # of two of one content, the last one
        if list(words[: len(content)]) == content:
            return [given, *words[len(content) :]]
    return list(words)


def doubts_of_simulation(robot: str) -> list[str]:
    """What is doubtful of the simulation that was given last: it was made for a robot of another name."""
    return [
        f"the simulation {file} was made for robot {made_for!r}, and this robot is {robot!r}. If these are two robots, "
        f"give the simulation of this one, or robot=<sheet of {made_for}>"
        for file, made_for in _MADE_FOR.items()
        if made_for != robot
    ]


def is_simulation_file(word: str) -> bool:
    """Whether a word names a simulation by its file, or by the run folder that has one.

    A plain word is a folder only where it holds a simulation; else it may be a choice of the group `sim`.
    """
    path = Path(word)
    return word.endswith(_ENDINGS) or (os.sep in word and path.is_dir()) or bool(_simulations_in(path))


def simulation_file(word: str) -> Path:
    """The file of such a word.

    Raises:
        ConfigError: it is a folder that has none, or two.
    """
    path = Path(word)
    if word.endswith(_ENDINGS) and not path.is_dir():
        return path
    found = _simulations_in(path)
    if len(found) != 1:
        raise ConfigError(
            f"The folder {path} holds {'two simulations' if found else 'no simulation'}; expected is the run folder of "
            f"`twbal diagnose` (with {AUGMENTED}) or of `twbal identify` (with {IDENTIFIED}), or the file itself."
        )
    return found[0]


def _simulations_in(folder: Path) -> list[Path]:
    return [folder / name for name in (AUGMENTED, IDENTIFIED) if (folder / name).is_file()]


def effects_in(path: Path) -> dict[str, dict[str, float]]:
    """The effects of a simulation in a file, with their values.

    Raises:
        ConfigError: the file is not there, or holds no simulation.
    """
    _, effects, _ = _read(path)
    return {name: {key: value for key, value in node.items() if key != "_target_"} for name, node in effects.items()}


def simulation_text(effects: Mapping[str, Mapping[str, float]], physics_step: float, robot: str, title: str) -> str:
    """The text of such a file.

    Args:
        effects: values by names of effects and parameters.
        physics_step: of the integrator [s]; one beyond what such a file may have is cut to that.
        robot: name of the robot that it is made for.
        title: stands above, as a comment.
    """
    values = {name: {key: float(value) for key, value in own.items()} for name, own in effects.items()}
    step = min(max(physics_step, PHYSICS_STEP.low), PHYSICS_STEP.high)  # an upper bound: the same step is used of it
    written: str = OmegaConf.to_yaml(OmegaConf.create({"robot": robot, "physics_step": step, "effects": values}))
    return "".join(f"# {line}\n" for line in wrap(title, 100)) + written


def _is_file(word: str) -> bool:
    return is_simulation_file(_word(word))


def _word(override: str) -> str:
    """The value of a word `sim=...`, as Hydra reads it where it stands in quotes."""
    word = override.removeprefix(_KEY)
    if word[:1] not in ("'", '"'):
        return word
    read = parsed(override)
    return word.strip("'\"") if read is None else str(read.value())


def _refuse_several(override: str) -> None:
    """Refuse a file as one of several simulations: it stands for overrides, of which a sweep has one set."""
    several = [] if Path(override.removeprefix(_KEY)).exists() else swept(override)
    if any(map(is_simulation_file, several)):
        once = ", then with ".join(f"{_KEY}{text(each)}" for each in several)
        raise ConfigError(
            f"{override} names several simulations, one of them by its file, and a sweep takes choices by name alone. "
            f"Run the command once for each: with {once}."
        )


def _added(word: str) -> str:
    """The effect that a word such as `+effect@sim.effects.dead_zone=dead_zone` adds; "" where it adds none."""
    found = _ADDED.match(word)
    return found.group(1) if found else ""


def _read(path: Path) -> tuple[list[str], dict[str, dict[str, Any]], str]:
    """What the file says: an override of the physics step, or none; nodes of the effects by their names; the robot.

    Files of earlier versions do not name their robot: it is "".
    """
    try:
        sim = read_yaml(path)
    except FileNotFoundError as error:
        raise ConfigError(
            f"There is no simulation {path}. `twbal diagnose` and `twbal identify` write such files."
        ) from error
    if not isinstance(sim, dict) or not set(sim) <= set(_PARTS):
        found = f"has {_listed(sim)}" if isinstance(sim, dict) else f"is a {type(sim).__name__}"
        raise ConfigError(f"{path} is no simulation: it {found}; expected {', '.join(_PARTS)}.")
    try:
        step = [_step(sim["physics_step"])] if "physics_step" in sim else []
        given = _mapping("effects", sim.get("effects", {}))
        return step, {name: _effect(name, values) for name, values in given.items()}, _robot(sim.get("robot", ""))
    except ConfigError as error:
        raise ConfigError(f"The simulation {path} cannot be: {error}") from error


def _robot(given: Any) -> str:
    if not isinstance(given, str) or len(given) > _LONGEST:
        raise ConfigError(f"robot must be the name of a robot; found {str(given)[:40]!r}.")
    return given


def _step(given: Any) -> str:
    step = _number("physics_step", given)
    if not PHYSICS_STEP.takes(step):
        raise ConfigError(f"physics_step must be {PHYSICS_STEP.expected}; found {step}.")
    return f"sim.physics_step={text(step)}"


def _effect(name: str, given: Any) -> dict[str, Any]:
    """The node that makes an effect, of values that it takes."""
    from twbal.effects.library import VARIABLE, all_effects  # here, as effects need numpy, before which threads are set

    known = all_effects()
    if name not in known:
        raise ConfigError(
            f"there is no effect {name[:40]!r}. The effects are: {', '.join(known)}. If it is one of your own, name "
            f"its module in {VARIABLE}."
        )
    target = f"{known[name].__module__}.{known[name].__name__}"
    values = _mapping(name, given)
    named = values.pop("_target_", target)  # files of earlier versions have it
    if named not in (target, target.replace("twbal.effects.", "twbal.sim.effects.")):
        raise ConfigError(f"_target_ of {name} must be {target}, or be left out; found {str(named)[:80]!r}.")
    expected = [field.name for field in fields(known[name])]  # type: ignore[arg-type]
    needed = [field.name for field in fields(known[name]) if field.default is MISSING]  # type: ignore[arg-type]
    if not set(needed) <= set(values) <= set(expected):
        raise ConfigError(f"{name} has the values {', '.join(expected)}; found {_listed(values)}.")
    numbers = {value: _number(f"{name}.{value}", values[value]) for value in expected if value in values}
    known[name](**numbers)  # which checks their ranges
    return {"_target_": target, **numbers}


def _mapping(where: str, given: Any) -> dict[str, Any]:
    if given == "":  # a key with nothing after it
        return {}
    if not isinstance(given, dict):
        raise ConfigError(f"{where} must be a mapping of names; found {str(given)[:40]!r}.")
    return dict(given)


def _number(where: str, given: Any) -> float:
    if not isinstance(given, str) or not _NUMBER.fullmatch(given) or not abs(float(given)) <= _LARGEST:
        raise ConfigError(f"{where} must be a plain number within ±{_LARGEST:g}; found {str(given)[:40]!r}.")
    return float(given)


def _listed(given: dict[str, Any]) -> str:
    names = ", ".join(repr(name[:40]) for name in list(given)[:8])
    return (names + (", ..." if len(given) > 8 else "")) or "nothing"
