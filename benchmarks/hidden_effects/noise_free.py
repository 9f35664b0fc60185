"""How much of the gap a diagnosis closes against what the hidden robot did, without noise of its sensors.

The robot is driven once more from the same start under the recorded commands: it does the very same. PyBullet then
starts at its true motion in the held-out recordings, once as the data sheet says and once with what was found, and the
channel counts in which the data sheet is farthest off after 0.15 s, in standard deviations of its sensor.

Tilt and tilt rate of a start are what the model reads out of sensors without noise. What is upright no sensor knows: a
centre of mass that is off and a sensor that is mounted askew are the same robot in two counts of its tilt.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from hydra import compose
from hydra.utils import instantiate
from omegaconf import OmegaConf

from benchmarks.hidden_effects.robot import Body, drawn
from benchmarks.hidden_effects.sets import Set
from benchmarks.hidden_effects.truth import HiddenRobot, Sensors
from twbal.cli.composition import composing
from twbal.core.gaussian import Array
from twbal.core.plant import Observation
from twbal.core.start_pose import InitialState
from twbal.io.logs import read_episode
from twbal.sim.replay import ReplayStart, replay
from twbal.sim.restart_state import RestartState

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
    with composing():
        robot = instantiate(compose("real_rollout", ["experiment=excite"]).robot)
    augmented = OmegaConf.load(folder / "diagnosis" / "augmented.yaml")
    values: Any = OmegaConf.to_container(augmented.effects)
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
        held = np.array([commands[t : t + steps] for t in places])
        truth = np.array([seen[t + steps, columns] for t in places])
        heading = np.concatenate([[0.0], np.cumsum(0.5 * robot.control_period * (seen[:-1, -1] + seen[1:, -1]))])
        for key, model, read in (("before", [], {}), ("after", effects, values)):
            shown = _read(seen, motion, hidden, read)
            starts = [_start(shown, seen, motion, heading, body, commands, t) for t in places]
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


def _read(seen: Array, motion: Array, hidden: Mapping[str, Any], known: Mapping[str, Any]) -> Array:
    """Tilt and tilt rate (T + 1, 2) that a model of known effects reads out of sensors without noise.

    Args:
        seen: what the sensors show.
        motion: as it is.
        hidden: effects of the robot with their parameters.
        known: effects of the model with theirs.
    """

    def of(effects: Mapping[str, Any], name: str, key: str, neutral: float = 0.0) -> float:
        return float(effects.get(name, {}).get(key, neutral))

    def levels(effects: Mapping[str, Any]) -> tuple[Array, Array]:
        scale = np.array([1.0, of(effects, "gyro_scale", "factor", 1.0)])
        return scale, np.array([of(effects, "imu_mount_angle", "angle"), of(effects, "gyro_bias", "rate")])

    shown = seen[:, [Observation._fields.index(name) for name in ("tilt", "tilt_rate")]]
    late = of(hidden, "imu_delay", "delay")
    if late:  # what a model knows of the delay it makes up for
        scale, zero = levels(hidden)
        shown = shown + of(known, "imu_delay", "delay") / late * (scale * motion[:, :2] + zero - shown)
    scale, zero = levels(known)
    return np.asarray((shown - zero) / scale)


def _start(
    shown: Array, seen: Array, motion: Array, heading: Array, body: Body, commands: Array, t: int
) -> ReplayStart:
    _, tilt_rate, speed, wheel_angle, position = motion[t].tolist()
    ways, ahead = np.diff(motion[: t + 1, 4]), 0.5 * (heading[:t] + heading[1 : t + 1])
    now = Observation(*seen[t].tolist())
    return ReplayStart(
        initial=InitialState(float(shown[t, 0]), float(shown[t, 1]), speed),
        restart=RestartState(
            wheel_angle=wheel_angle,
            heading=float(heading[t]),
            slip=speed - body.radius * (now.wheel_rate + tilt_rate),
            yaw_rate=now.yaw_rate,
            position=position,
            x=float(ways @ np.cos(ahead)),
            y=float(ways @ np.sin(ahead)),
        ),
        past_commands=commands[:t],
        past_motion=np.column_stack([shown, motion[:, 2]])[:t],
    )
