"""Make a linear-quadratic regulator: of the data sheet, or of a linear model of real episodes."""

from dataclasses import dataclass
from pathlib import Path

from hydra.utils import instantiate
from omegaconf import DictConfig

from twbal.cli.artefacts import episode_files
from twbal.cli.console import closing, next_command, run_folder
from twbal.cli.manifest import Manifest, Step, perform
from twbal.cli.stages.optimise_policy import POLICY
from twbal.cli.typed_config import recorded, typed
from twbal.core.channels import Channels
from twbal.core.robot_parameters import RobotParameters
from twbal.io.checkpoint import save_checkpoint
from twbal.io.logs import read_episode
from twbal.policies.linear import LinearPolicy
from twbal.search.regulator import data_sheet_regulator, identified_regulator

NOT_RECORDED = ("episodes",)


@dataclass(frozen=True)
class Settings:
    """See conf/stage/linear_policy.yaml."""

    command_width: float


def main(cfg: DictConfig) -> None:
    """Run the stage in Hydra's run folder."""
    out = run_folder()
    closing(run(cfg, out), out, next_command("real-rollout", {"policy.path": out / POLICY}, "robot", "state"))


def run(cfg: DictConfig, out: Path) -> Manifest:
    """Write the regulator that `cfg` asks for to `out`/policy.pt, unless it is there already."""
    settings = typed(Settings, cfg)
    files = episode_files(cfg.episodes) if cfg.episodes else []
    step = Step("linear-policy", out, recorded(cfg, NOT_RECORDED), {"episodes": files}, 0)

    def make() -> list[Path]:
        save_checkpoint(out / POLICY, "policy", _regulator(cfg, settings, files).to_payload())
        return [out / POLICY]

    return perform(step, make)


def _regulator(cfg: DictConfig, settings: Settings, files: list[Path]) -> LinearPolicy:
    robot: RobotParameters = instantiate(cfg.robot)
    channels: Channels = instantiate(cfg.state)
    cost, width = instantiate(cfg.cost), settings.command_width
    if files:
        episodes = [read_episode(file) for file in files]
        found = identified_regulator(episodes, channels, cost, width, robot.torque_limit)
        if found is not None:
            return found
        print("  the linear model of these episodes cannot be stabilised: the regulator is that of the data sheet")
    return data_sheet_regulator(robot, channels, cost, width)
