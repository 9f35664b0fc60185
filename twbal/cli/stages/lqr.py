"""Make a linear-quadratic regulator: of the data sheet, or of a linear model of real episodes."""

from pathlib import Path

from hydra.utils import instantiate
from omegaconf import DictConfig

from twbal.cli.artefacts import POLICY, episode_files, episodes_of, say_duplicates
from twbal.cli.console import print_result, run_folder, say
from twbal.cli.manifest import Manifest, StageWork, perform
from twbal.cli.recorded_period import drive_next
from twbal.cli.typed_config import recorded
from twbal.diagnosis.log_names import distinct_names
from twbal.io.checkpoint import save_checkpoint
from twbal.search.regulator import regulator_for
from twbal.sysid.recording import check_episodes

NOT_RECORDED = ("episodes",)


def main(cfg: DictConfig) -> None:
    """Run the stage in Hydra's run folder."""
    out = run_folder()
    if cfg.episodes:
        files, robot = episode_files(cfg.episodes), instantiate(cfg.robot)
        check_episodes(episodes_of(files, robot.name), distinct_names(files), robot)
    print_result(run(cfg, out), out, drive_next(out / POLICY, cfg.robot.control_period))


def run(cfg: DictConfig, out: Path) -> Manifest:
    """Write the regulator that `cfg` asks for to `out`/policy.pt, unless it is there already."""
    files = episode_files(cfg.episodes) if cfg.episodes else []
    step = StageWork("lqr", out, recorded(cfg, NOT_RECORDED), {"episodes": files}, 0)

    def make() -> list[Path]:
        say_duplicates(files)
        robot, channels, cost = (instantiate(cfg[part]) for part in ("robot", "state", "cost"))
        episodes = episodes_of(files, robot.name)
        made = regulator_for(robot, channels, cost, float(cfg.command_width), episodes, say)
        save_checkpoint(out / POLICY, "policy", made.to_payload())
        return [out / POLICY]

    return perform(step, make)
