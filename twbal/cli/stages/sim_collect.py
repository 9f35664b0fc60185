"""Drive the simulated robot and log what it does."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from hydra.utils import instantiate
from omegaconf import DictConfig

from twbal.algorithm.collection import simulate
from twbal.algorithm.settings import RolloutSettings
from twbal.cli.artefacts import episode_file, policy_files, policy_hash
from twbal.cli.console import next_command, print_result, run_folder, say, with_progress
from twbal.cli.manifest import Manifest, StageWork, perform
from twbal.cli.policy_origin import say_doubts_of_policy
from twbal.cli.simulation_config import simulation_of
from twbal.cli.typed_config import recorded, typed
from twbal.core.episode import Episode, Outcome, Provenance
from twbal.core.motion_limits import MotionLimits
from twbal.core.plant import Observation
from twbal.core.robot_parameters import RobotParameters, parameter_hash
from twbal.io.logs.writer import write_episode

NOT_RECORDED = ("workers", "policy.path")
_FAR_BEYOND = 2.0  # times the speed limit of motions
_LONG = 3.0  # as far as a robot gets at that limit in this time [s]; one that falls at once gets less far


class Driven(NamedTuple):
    """How a robot drove in a rollout.

    Attributes:
        distance: greatest distance from where it began [m].
        speed: greatest speed, either way [m/s].
    """

    distance: float
    speed: float


@dataclass(frozen=True)
class Settings:
    """How much to collect; see conf/sim_collect.yaml."""

    seed: int
    rollouts: int
    first_trial: int
    steps: int
    tilt_limit: float
    exploration: float
    workers: int

    @property
    def rollout_settings(self) -> RolloutSettings:
        """Which rollouts."""
        return RolloutSettings(
            self.seed, self.rollouts, self.first_trial, self.steps, self.tilt_limit, self.exploration
        )


def main(cfg: DictConfig) -> None:
    """Run the stage in Hydra's run folder."""
    out = run_folder()
    manifest = run(cfg, out)
    print_result(manifest, out, next_command("fit-sim-gp", {"episodes": out}, "robot", "state"))


def run(cfg: DictConfig, out: Path) -> Manifest:
    """Collect what `cfg` asks for into `out`/episodes, unless it is there already."""
    settings = typed(Settings, cfg)
    text, simulation, rollouts = recorded(cfg, NOT_RECORDED), simulation_of(cfg), settings.rollout_settings
    policy = instantiate(cfg.policy)
    say_doubts_of_policy(policy, policy_files(cfg.policy), simulation.robot)
    provenance = Provenance(
        robot=simulation.robot.name,
        source="simulation",
        parameter_hash=parameter_hash(simulation.robot, simulation.effects, simulation.used_step),
        policy_hash=policy_hash(cfg.policy),
        seed=settings.seed,
        config=text,
    )
    episodes = simulate(simulation, policy, instantiate(cfg.state), rollouts, provenance, settings.workers)
    step = StageWork("sim-collect", out, text, {"policy": policy_files(cfg.policy)}, settings.seed)
    counted = with_progress(episodes, "rollouts", settings.rollouts)
    return perform(step, lambda: _write(counted, simulation.robot, out / "episodes"))


def _write(episodes: Iterable[Episode], robot: RobotParameters, folder: Path) -> list[Path]:
    """Log each rollout of a robot to `folder`; returns the files."""
    files, fallen, driven = [], list[float](), list[Driven]()
    for episode in episodes:
        files.append(episode_file(folder, episode.provenance.trial))
        write_episode(files[-1], episode)
        if episode.outcome is Outcome.TILT_LIMIT:
            fallen.append(len(episode.commands) * episode.control_period)
        driven.append(driven_of(episode, robot.wheel_radius))
    say(_falls_in_words(fallen, len(files)))
    if beyond := beyond_limits(driven, robot):
        say(beyond)
    return files


def driven_of(episode: Episode, radius: float) -> Driven:
    """How a robot on wheels of a radius [m] drove in an episode, as its encoders and its tilt tell it."""
    columns = [Observation._fields.index(name) for name in ("wheel_angle", "tilt", "wheel_rate", "tilt_rate")]
    wheel_angle, tilt, wheel_rate, tilt_rate = episode.observations[:, columns].T
    way = radius * (wheel_angle + tilt)
    return Driven(float(np.abs(way - way[0]).max()), float(np.abs(radius * (wheel_rate + tilt_rate)).max()))


def beyond_limits(driven: Sequence[Driven], robot: RobotParameters) -> str:
    """A sentence on rollouts that went farther and faster than the robot may be asked to; empty if none did.

    Args:
        driven: in each rollout.
        robot: its sheet.
    """
    limit = MotionLimits.of_robot(robot).speed
    beyond = [each for each in driven if each.speed > _FAR_BEYOND * limit and each.distance > _LONG * limit]
    if not beyond:
        return ""
    farthest = max(beyond)
    drove = f"the simulated robot drove {farthest.distance:.2g} m at up to {farthest.speed:.2g} m/s"
    return (
        f"{drove}: a robot of this sheet is not asked for more than {limit:.2g} m/s. Effects may be too large for it: "
        "their defaults are for the robot paper, of 20 N·m"
    )


def _falls_in_words(fallen: Sequence[float], rollouts: int) -> str:
    """How many rollouts ended beyond the tilt limit, and when [s]."""
    if not fallen:
        return f"the simulated robot fell in none of {rollouts} rollouts"
    when = f"after {min(fallen):.2g} to {max(fallen):.2g} s"
    return f"the simulated robot fell in {len(fallen)} of {rollouts} rollouts, {when}"
