"""The control period of recordings, where it is another one than that of the data sheet.

What is learned from logs is learned at the period that they were recorded at. So a stage that reads logs alone goes on
as if it had been given `robot.control_period=<that of the logs>`, and gives it to the commands that come next.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

from omegaconf import DictConfig, OmegaConf

from twbal.cli.composition import loaded
from twbal.cli.conf_folder import conf_folder
from twbal.cli.config_check import check_configuration
from twbal.cli.console import add_override, has_group, next_command, overridden, say
from twbal.core.errors import DataError
from twbal.io.logs import read_control_period, read_episode
from twbal.io.recorded_sheet import is_of_sheet
from twbal.sysid.recording import SAME_PERIOD

KEY, VIRTUAL = "robot.control_period", "link.overrides"


def take_recorded_period(cfg: DictConfig, stage: str, files: Sequence[Path]) -> None:
    """Let a stage go by the control period of its logs, unless the command line says another one.

    Args:
        cfg: of the stage, as composed; changed where the logs have another period than the robot's sheet.
        stage: its name on the command line.
        files: logs that it reads.

    Raises:
        LogError: a log cannot be read.
        DataError: the logs are of several control periods.
        ConfigError: with the period of the logs the configuration cannot be right.
    """
    periods = {file: read_control_period(file) for file in files}
    first, last = (choose(periods, key=lambda file: periods[file]) for choose in (min, max))
    if periods[last] - periods[first] > SAME_PERIOD:
        raise DataError(
            f"The recordings have different control periods: {periods[first]:.6g} s ({first}) and "
            f"{periods[last]:.6g} s ({last}). Expected is one period: give the recordings of one period at a time. Of "
            "logs that were imported, import them again with a period=... that suits all."
        )
    period, sheet = periods[files[0]], cfg.robot.control_period
    is_same = abs(period - sheet) <= SAME_PERIOD
    if is_same or overridden(KEY) or not is_of_sheet(read_episode(files[0]).provenance, cfg.robot.name):
        return
    found = f"The recordings have a control period of {period:.6g} s; the data sheet's is {sheet:.6g} s."
    say(f"{found} The former is used.")
    OmegaConf.update(cfg, KEY, period)
    add_override(f"{KEY}={period!r}")
    check_configuration(cfg, stage)


def virtual_robot_at(period: float) -> Mapping[str, list[str]]:
    """The setting by which the virtual robot of a next command has the control period that this run was given.

    None where the run was given none, as then both go by the sheet, or where it has a link of its own.

    Args:
        period: the robot's control period in this run [s].
    """
    if not overridden(KEY) or has_group("link"):
        return {}
    given = loaded(conf_folder() / "groups" / "link.yaml")["virtual"]["overrides"]
    return {VIRTUAL: [*given, f"{KEY}={period!r}"]}


def drive_next(policy: Path, period: float) -> str:
    """The next command that drives the robot by a policy; a virtual robot then has the control period of this run.

    Args:
        policy: its file.
        period: the robot's control period in this run [s].
    """
    virtual = virtual_robot_at(period)
    if virtual:
        say(f"the next command drives a virtual robot of this control period, by {VIRTUAL}=[...]; to drive your own,")
        say("write link=serial link.port=... in the place of that")
    return next_command("real-rollout", {"policy.path": policy, **virtual}, "robot", "state")
