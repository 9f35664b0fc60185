"""Tell the parameters of a robot by rollouts of it."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from hydra.utils import instantiate
from omegaconf import DictConfig

from twbal.algorithm.distribution_file import save_distribution
from twbal.algorithm.identification import EffectValues, identify
from twbal.cli.artefacts import DISTRIBUTION, episode_files, episodes_of, say_duplicates
from twbal.cli.console import next_command, print_result, run_folder, say, say_link
from twbal.cli.manifest import Manifest, StageWork, perform
from twbal.cli.recorded_period import take_recorded_period, virtual_robot_at
from twbal.cli.sim_files import IDENTIFIED, simulation_text
from twbal.cli.typed_config import members, recorded
from twbal.core.engine import dividing_step
from twbal.core.episode import Episode
from twbal.core.files import write_atomically
from twbal.core.plant import Observation
from twbal.core.robot_parameters import RobotParameters
from twbal.diagnosis.log_names import distinct_names
from twbal.effects.library import values_of
from twbal.sysid.posterior import FALLEN, SHORTEST
from twbal.sysid.recording import Usability, check_episodes, what_is_not_used

NOT_RECORDED = ("episodes",)
_TURNING = 1.5  # rad/s; slower turns hardly change how the body tilts
_SOME = 0.05  # share of the samples that is worth a word


def main(cfg: DictConfig) -> None:
    """Run the stage in Hydra's run folder."""
    out = run_folder()
    take_recorded_period(cfg, "identify", episode_files(cfg.episodes))
    made = run(cfg, out)
    robot = virtual_robot_at(cfg.robot.control_period)
    following = next_command("iterate", {"sim": out / IDENTIFIED, "known": out, **robot}, "robot")
    say_link("learns on", following)
    print_result(made, out, following)


def run(cfg: DictConfig, out: Path) -> Manifest:
    """Identify the robot of the episodes that `cfg` names into `out`, unless that is done there already."""
    files = episode_files(cfg.episodes)
    say_duplicates(files)
    step = StageWork("identify", out, recorded(cfg, NOT_RECORDED), {"episodes": files}, 0)
    simulated = values_of(members(cfg.sim.effects))
    physics_step = dividing_step(float(cfg.robot.control_period), float(cfg.sim.physics_step))
    return perform(step, lambda: _identify_to_files(files, instantiate(cfg.robot), simulated, physics_step, out))


def _identify_to_files(
    files: Sequence[Path], robot: RobotParameters, simulated: EffectValues, physics_step: float, out: Path
) -> list[Path]:
    episodes, names = episodes_of(files, robot.name), distinct_names(files)
    check_episodes(episodes, names, robot)
    for said in doubts_of(episodes, names, robot):
        say(said)
    found = identify(robot, simulated, episodes, progress=lambda line: None)
    if found.why_uninformative:
        say(f"nothing was estimated, all values are those of the sheet: {found.why_uninformative}")
    print("\n".join(f"  {line}" for line in found.table()), flush=True)
    say("± holds if nothing but these parameters differs from the sheet; other effects can put the values further off")
    basis = "by its sheet alone, as the rollouts tell nothing" if found.why_uninformative else "by its rollouts"
    if found.at_bound:
        say(
            f"WARNING: {', '.join(found.at_bound)} ran to a bound of the range: the robot has something that none of "
            "the parameters describes, or the recordings are too short or faulty. See how well the estimate predicts "
            "by twbal evaluate-sim"
        )
    title = f"Robot {robot.name} with the mean of its parameters, {basis}."
    if found.far_off:
        say(
            f"WARNING: {', '.join(found.far_off)} moved far from what was known before. Either that is wrong "
            "(robot=... or sim=...), or the robot has something that no parameter describes, or the log has a "
            "wrong unit or sign. See what twbal diagnose says of these recordings"
        )
    save_distribution(out / DISTRIBUTION, found.known)
    write_atomically(out / IDENTIFIED, simulation_text(found.effects, physics_step, robot.name, title))
    return [out / DISTRIBUTION, out / IDENTIFIED]


def doubts_of(episodes: Sequence[Episode], names: Sequence[str], robot: RobotParameters) -> list[str]:
    """A sentence for each episode of which not all is used, that turns (this is left out), or with cut commands."""
    usability = Usability(SHORTEST, 0, float("inf"), FALLEN)
    columns = Observation._fields.index("tilt"), Observation._fields.index("yaw_rate")
    read, turning = list[str](), list[str]()
    for episode, name in zip(episodes, names, strict=True):
        tilt, yaw_rate = np.abs(episode.observations[:, columns]).T
        upright = int(np.argmax(tilt > FALLEN)) if (tilt > FALLEN).any() else len(tilt)
        if upright > SHORTEST:
            read.append(name)
        share = float(np.mean(yaw_rate[:upright] > _TURNING)) if upright else 0.0
        if share > _SOME:
            turning.append(
                f"WARNING: episode {name} turns faster than {_TURNING:g} rad/s in {share:.0%} of its samples, which "
                "the estimate knows nothing of; is its yaw rate in rad/s?"
            )
    return [*what_is_not_used(episodes, names, read, usability, robot), *turning]
