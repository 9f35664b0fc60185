"""Try a robot with its wheels off the ground, before its first rollout."""

from pathlib import Path

from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from twbal.cli.console import chosen_overrides, next_command, run_folder, say
from twbal.cli.link_gate import heeds, record_begin, record_check
from twbal.cli.manifest import StageWork, perform_anew
from twbal.cli.own_sheet import check_numbers, chosen_by, sheet_file, with_copy, write_measured
from twbal.cli.robot_link import in_time, robot_link
from twbal.cli.signals import stopped_once
from twbal.cli.typed_config import recorded, typed
from twbal.core.check import check_lines, problems, skipped
from twbal.core.errors import CheckError, MotorsOnError
from twbal.core.files import write_atomically
from twbal.core.json_records import write_record
from twbal.core.robot_parameters import RobotParameters
from twbal.link.checks.by_hand import SIGNS_BY_HAND, Helper
from twbal.link.checks.procedure import LinkReport, LinkTrial, check_link
from twbal.link.person import ask_again, ask_for_motion, confirm_lifted
from twbal.link.sheet_check import is_of_another
from twbal.virtual_robot.process import Launch, launch
from twbal.viz.canvas import save
from twbal.viz.round_trip_figure import round_trip_figure

PAGE, RECORD, FIGURE = "check_link.txt", "check_link.json", Path("figures") / "round_trips.svg"
_TRIED_AS = {"confirm_placed": None, "on_board": False}  # asked once; torques are the host's


def main(cfg: DictConfig) -> None:
    """Run the stage in Hydra's run folder; never skipped, as it is the robot that it tries.

    Raises:
        CheckError: something is a problem.
        MotorsOnError: the same, and the robot does not confirm that its motors are off.
        LinkError: the robot cannot be reached at all.
        ConfigError: the sheet cannot be changed here.
    """
    out = run_folder()
    found: list[LinkReport] = []

    def check() -> list[Path]:
        found.append(run(cfg, out))
        return [out / name for name in (PAGE, RECORD, FIGURE)[: 3 if found[0].round_trips else 2]]

    made = perform_anew(StageWork("check-link", out, recorded(cfg, ()), {}, 0), check).outputs
    (report,) = found
    print(page(report), end="")
    for output in made:
        print(f"made  {out / output.path}")
    own = _record(cfg, report)
    if wrong := problems(report.checks):
        on = " It does not confirm that its motors are off, and THEY MAY STILL BE ON: switch it off by hand."
        kind = MotorsOnError if report.motors_may_be_on else CheckError
        raise kind(
            f"The robot {report.robot} is not fit to be driven: {', '.join(wrong)}. {out / PAGE} says why."
            f"{on * report.motors_may_be_on}"
        )
    if heeds(cfg, cfg.link) and _is_placed_by_hand(cfg) and SIGNS_BY_HAND in skipped(report.checks):
        say("the robot is not armed before its signs were tried by hand, too")
        print(f"next  {_with_robot('check-link', own)}{chosen_overrides('link')}")
        return
    print(f"next  {_with_robot('lqr', own)}")
    drive = _with_robot("real-rollout", own)
    print(f"then  {drive} policy.path=<its policy.pt>{chosen_overrides('link')} steps=25")


def _with_robot(stage: str, own: Path | None) -> str:
    """A command with the robot by its own sheet, which may have been written by this check."""
    return next_command(stage, {}, "robot") if own is None else f"twbal {stage} {chosen_by(own)}"


def _is_placed_by_hand(cfg: DictConfig) -> bool:
    return cfg.link.get("confirm_placed") is not None


def run(cfg: DictConfig, out: Path, launch: Launch = launch) -> LinkReport:
    """Try the robot that `cfg` names, and write what came of it to `out`.

    Args:
        cfg: of this stage.
        out: the run folder.
        launch: starts the virtual robot, where `cfg` asks for one.
    """
    sheet = instantiate(cfg.robot)
    is_held = _is_placed_by_hand(cfg)
    trial = typed(LinkTrial, cfg, is_held=is_held)
    known = {key: value for key, value in _TRIED_AS.items() if key in cfg.link}
    link = OmegaConf.merge(cfg.link, known)
    assert isinstance(link, DictConfig)
    helper = Helper(ask_for_motion, ask_again, say)
    with stopped_once(), robot_link(link, launch) as plant:
        if _writes_sheet(cfg):
            check_numbers(sheet_file())
        if is_held and not is_of_another(sheet.torque_limit, plant.torque_limit):
            confirm_lifted()
        if heeds(cfg, cfg.link):
            record_begin(plant, _checked(cfg))
        with in_time(plant):
            report = check_link(plant, trial, say, helper, sheet=sheet)
    write_atomically(out / PAGE, page(report))
    write_record(out / RECORD, report)
    if report.round_trips:
        save(round_trip_figure(report.round_trips, report.control_period, report.robot), out / FIGURE)
    return report


def _writes_sheet(cfg: DictConfig) -> bool:
    return heeds(cfg, cfg.link) and bool(cfg.write_sheet)


def _checked(cfg: DictConfig) -> tuple[RobotParameters, ...]:
    """The sheets that the check counts for."""
    robot: RobotParameters = instantiate(cfg.robot)
    return with_copy(robot, sheet_file()) if _writes_sheet(cfg) else (robot,)


def _record(cfg: DictConfig, report: LinkReport) -> Path | None:
    """Write what was measured into the sheet, where nothing is wrong, and keep what the check came to.

    Returns:
        The copy of a packaged sheet that it was written into; None where the sheet of the run is the robot's.
    """
    wrong, own = problems(report.checks), None
    robots = _checked(cfg) if wrong else (instantiate(cfg.robot),)
    try:
        if _writes_sheet(cfg) and not wrong:
            file = sheet_file()
            robots, sheet = write_measured(report, robots[0], file)
            own = sheet if file.packaged else None
    finally:
        if heeds(cfg, cfg.link):
            record_check(report, robots)
    return own


def page(report: LinkReport) -> str:
    """What came of it, as text of one page."""
    return "".join(f"{line}\n" for line in [f"Link of the robot {report.robot!r}", "", *check_lines(report.checks)])
