"""Drive the simulated robot and log what it does."""

from dataclasses import dataclass, replace
from pathlib import Path

from hydra.utils import instantiate
from omegaconf import DictConfig
from tqdm import tqdm

from twbal.algorithm.collection import RolloutPlan, collect
from twbal.cli.artefacts import episode_file, policy_files, policy_hash
from twbal.cli.console import closing, next_command, run_folder
from twbal.cli.manifest import Manifest, Step, perform
from twbal.cli.simulation_config import plant_maker
from twbal.cli.typed_config import members, recorded, typed
from twbal.core.episode import Provenance
from twbal.core.robot_parameters import parameter_hash
from twbal.io.logs.writer import write_episode
from twbal.policies.exploring import ExploringPolicy
from twbal.policies.policy import Policy

NOT_RECORDED = ("workers", "policy.path")


@dataclass(frozen=True)
class Settings:
    """How much to collect; see conf/stage/sim_collect.yaml."""

    seed: int
    rollouts: int
    first_trial: int
    steps: int
    tilt_limit: float
    exploration: float
    workers: int


def main(cfg: DictConfig) -> None:
    """Run the stage in Hydra's run folder."""
    out = run_folder()
    manifest = run(cfg, out)
    closing(manifest, out, next_command("fit-sim-gp", {"episodes": out}, "robot", "state"))


def run(cfg: DictConfig, out: Path) -> Manifest:
    """Collect what `cfg` asks for into `out`/episodes, unless it is there already."""
    settings = typed(Settings, cfg)
    text = recorded(cfg, NOT_RECORDED)
    robot, effects = instantiate(cfg.robot), members(cfg.sim.effects)
    make_plant = plant_maker(cfg, settings.seed)
    policy: Policy = instantiate(cfg.policy)
    if settings.exploration:
        policy = ExploringPolicy(policy, settings.exploration * robot.torque_limit, robot.torque_limit)
    plan = RolloutPlan(make_plant, policy, instantiate(cfg.state), settings.steps, settings.tilt_limit)
    provenance = Provenance(
        robot=robot.name,
        source="simulation",
        parameter_hash=parameter_hash(robot, effects, float(cfg.sim.physics_step)),
        policy_hash=policy_hash(cfg.policy),
        seed=settings.seed,
        config=text,
    )
    step = Step("sim-collect", out, text, {"policy": policy_files(cfg.policy)}, settings.seed)
    trials = range(settings.first_trial, settings.first_trial + settings.rollouts)
    return perform(step, lambda: simulate(plan, provenance, trials, settings.workers, out / "episodes"))


def simulate(plan: RolloutPlan, provenance: Provenance, trials: range, workers: int, folder: Path) -> list[Path]:
    """Drive the simulated robot once for each of `trials` and log each rollout to `folder`; returns the files.

    Args:
        plan: robot, policy and state.
        provenance: of all of them; each gets its own trial number.
        trials: their numbers.
        workers: processes; 0: one a core.
        folder: for the logs.
    """
    provenances = [replace(provenance, trial=trial) for trial in trials]
    files = []
    episodes = tqdm(collect(plan, provenances, workers), "rollouts", len(trials), disable=None)
    for trial, episode in zip(trials, episodes, strict=True):
        files.append(episode_file(folder, trial))
        write_episode(files[-1], episode)
    return files
