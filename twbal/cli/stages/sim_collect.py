"""Drive the simulated robot and log what it does."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

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
from twbal.core.robot_parameters import parameter_hash
from twbal.io.logs.writer import write_episode

NOT_RECORDED = ("workers", "policy.path")


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
        parameter_hash=parameter_hash(simulation.robot, simulation.effects, simulation.physics_step),
        policy_hash=policy_hash(cfg.policy),
        seed=settings.seed,
        config=text,
    )
    episodes = simulate(simulation, policy, instantiate(cfg.state), rollouts, provenance, settings.workers)
    step = StageWork("sim-collect", out, text, {"policy": policy_files(cfg.policy)}, settings.seed)
    return perform(step, lambda: _write(with_progress(episodes, "rollouts", settings.rollouts), out / "episodes"))


def _write(episodes: Iterable[Episode], folder: Path) -> list[Path]:
    """Log each rollout to `folder`; returns the files."""
    files, fallen = [], list[float]()
    for episode in episodes:
        files.append(episode_file(folder, episode.provenance.trial))
        write_episode(files[-1], episode)
        if episode.outcome is Outcome.TILT_LIMIT:
            fallen.append(len(episode.commands) * episode.control_period)
    say(_falls_in_words(fallen, len(files)))
    return files


def _falls_in_words(fallen: Sequence[float], rollouts: int) -> str:
    """How many rollouts ended beyond the tilt limit, and when [s]."""
    if not fallen:
        return f"the simulated robot fell in none of {rollouts} rollouts"
    when = f"after {min(fallen):.2g} to {max(fallen):.2g} s"
    return f"the simulated robot fell in {len(fallen)} of {rollouts} rollouts, {when}"
