"""How much of the gap a diagnosis closes against what the hidden robot did, without noise of its sensors.

The robot is driven once more from the same start under the recorded commands: it does the very same. PyBullet then
starts at its true motion in the held-out recordings, once as the data sheet says and once with what was found, and the
channel counts in which the data sheet is farthest off after 0.15 s, in standard deviations of its sensor.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from hydra import compose, initialize_config_dir
from hydra.utils import instantiate
from omegaconf import OmegaConf

from benchmarks.hidden_effects.robot import drawn
from benchmarks.hidden_effects.sets import Set
from benchmarks.hidden_effects.truth import HiddenRobot, Sensors
from twbal.configuration import conf_folder
from twbal.gaussian import Array
from twbal.logs import read_episode
from twbal.plant import Observation
from twbal.robot.start_pose import Stance
from twbal.sim.replay import ReplayStart, replay

_HISTORY, _SPACING = 5, 5
SILENT = Sensors(0.0, 0.0, 0.0)
_AHEAD = 0.15  # s
_CHANNELS = {"tilt": 0.002, "tilt_rate": 0.01, "wheel_angle": 0.002, "wheel_rate": 0.03}  # and their sensors' noise


def closed_noise_free(each: Set, hidden: Mapping[str, Any], folder: Path, spread: tuple[float, float]) -> float | None:
    """Share of the gap that what was found closes; None where nothing was held out.

    Args:
        each: the set.
        hidden: its effects with their parameters.
        folder: with its episodes/ and diagnosis/.
        spread: tolerance of the data sheet and asymmetry of the motors, as of the generation.
    """
    found: Any = OmegaConf.to_container(OmegaConf.load(folder / "diagnosis" / "diagnosis.json"))
    with initialize_config_dir(str(conf_folder()), version_base="1.3"):
        robot = instantiate(compose("real_rollout", ["experiment=excite"]).robot)
    augmented = OmegaConf.load(folder / "diagnosis" / "augmented.yaml")
    effects = list(instantiate(augmented.effects, _convert_="all").values())
    columns = [Observation._fields.index(name) for name in _CHANNELS]
    steps = round(_AHEAD / robot.control_period)
    body = drawn(robot, np.random.default_rng(each.seed), *spread)
    errors: dict[str, list[Array]] = {"before": [], "after": []}
    for name in found["gap"]["held_out"]:
        trial = int(name.split("_")[1].split(",")[0])
        commands = read_episode(folder / "episodes" / f"{name.split(',')[0]}.mcap").commands
        plant = HiddenRobot(robot, body, hidden, each.surface, each.seed, SILENT)
        seen, motion = _driven(plant, trial, commands)
        places = range(_HISTORY, len(commands) - steps, _SPACING)
        starts = [_start(seen, motion, commands, t) for t in places]
        held = np.array([commands[t : t + steps] for t in places])
        truth = np.array([seen[t + steps, columns] for t in places])
        for key, model in (("before", []), ("after", effects)):
            errors[key].append(replay(robot, model, 0.001, starts, held)[:, -1, columns] - truth)
    if not errors["before"]:
        return None
    before, after = (np.sqrt(np.mean(np.concatenate(errors[key]) ** 2, axis=0)) for key in ("before", "after"))
    worst = int(np.argmax(before / list(_CHANNELS.values())))
    return 1.0 - float(after[worst] / before[worst])


def _driven(plant: HiddenRobot, trial: int, commands: Array) -> tuple[Array, Array]:
    """What the sensors show (T + 1, 7), and tilt, tilt rate, speed, wheel angle and position as they are (T + 1, 5)."""
    seen, motion = [plant.reset(trial)], [plant.motion()]
    for command in commands:
        seen.append(plant.step(float(command)))
        motion.append(plant.motion())
    return np.array(seen), np.array(motion)


def _start(seen: Array, motion: Array, commands: Array, t: int) -> ReplayStart:
    tilt, tilt_rate, speed, wheel_angle, position = motion[t].tolist()
    return ReplayStart(
        stance=Stance(tilt, tilt_rate, speed),
        wheel_angle=wheel_angle,
        position=position,
        rotor_ahead=0.0,
        past_commands=commands[:t],
        past_motion=motion[t - _HISTORY : t, :2],
    )
