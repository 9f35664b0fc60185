"""Try a robot with its wheels off the ground, before its first rollout."""

from dataclasses import asdict, dataclass
from pathlib import Path

from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from twbal.cli.console import next_command, run_folder, say
from twbal.cli.link_gate import heeds, record_check
from twbal.cli.own_sheet import sheet_file, write_measured
from twbal.cli.robot_link import in_time, robot_link
from twbal.cli.signals import stopped_once
from twbal.cli.typed_config import typed
from twbal.core.check import check_lines, problems
from twbal.core.errors import CheckError
from twbal.core.files import write_atomically
from twbal.core.json_records import write_record
from twbal.core.robot_parameters import RobotParameters
from twbal.link.checks.procedure import LinkReport, LinkTrial, check_link
from twbal.link.person import ask_for_motion, confirm_lifted
from twbal.virtual_robot.process import Launch, launch
from twbal.viz.canvas import save
from twbal.viz.round_trip_figure import round_trip_figure

PAGE, RECORD, FIGURE = "check_link.txt", "check_link.json", Path("figures") / "round_trips.svg"
_TRIED_AS = {"confirm_placed": None, "on_board": False}  # asked once; torques are the host's


@dataclass(frozen=True)
class Settings:
    """See conf/check_link.yaml."""

    exchanges: int
    rest: float
    pulse: float
    pulse_time: float
    by_hand: bool
    hand_time: float


def main(cfg: DictConfig) -> None:
    """Run the stage in Hydra's run folder; never skipped, as it is the robot that it tries.

    Raises:
        CheckError: something is a problem.
        LinkError: the robot cannot be reached at all.
        ConfigError: the sheet cannot be changed here.
    """
    out = run_folder()
    report = run(cfg, out)
    print(page(report), end="")
    for name in (PAGE, RECORD, FIGURE):
        if (out / name).is_file():
            print(f"made  {out / name}")
    _record(cfg, report)
    if wrong := problems(report.checks):
        raise CheckError(
            f"The robot {report.robot} is not fit to be driven: {', '.join(wrong)}. {out / PAGE} says why."
        )
    print(f"next  {next_command('lqr', {}, 'robot')}")


def run(cfg: DictConfig, out: Path, launch: Launch = launch) -> LinkReport:
    """Try the robot that `cfg` names, and write what came of it to `out`.

    Args:
        cfg: of this stage.
        out: the run folder.
        launch: starts the virtual robot, where `cfg` asks for one.
    """
    settings = typed(Settings, cfg)
    is_held = cfg.link.get("confirm_placed") is not None
    trial = LinkTrial(**asdict(settings), is_held=is_held)
    known = {key: value for key, value in _TRIED_AS.items() if key in cfg.link}
    link = OmegaConf.merge(cfg.link, known)
    assert isinstance(link, DictConfig)
    with stopped_once(), robot_link(link, launch) as plant:
        if is_held:
            confirm_lifted()
        with in_time(plant):
            report = check_link(plant, trial, say, ask_for_motion)
    write_atomically(out / PAGE, page(report))
    write_record(out / RECORD, report)
    if report.round_trips:
        save(round_trip_figure(report.round_trips, report.control_period, report.robot), out / FIGURE)
    return report


def _record(cfg: DictConfig, report: LinkReport) -> None:
    """Write what was measured into the sheet, where nothing is wrong, and keep what the check came to."""
    robots: tuple[RobotParameters, ...] = (instantiate(cfg.robot),)
    try:
        if heeds(cfg, cfg.link) and cfg.write_sheet and not problems(report.checks):
            robots = write_measured(report, robots[0], sheet_file())
    finally:
        if heeds(cfg, cfg.link):
            record_check(report, robots)


def page(report: LinkReport) -> str:
    """What came of it, as text of one page."""
    return "".join(f"{line}\n" for line in [f"Link of the robot {report.robot!r}", "", *check_lines(report.checks)])
