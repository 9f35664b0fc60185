"""The file of a run's robot sheet, and what `twbal check-link` writes into it."""

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any, NamedTuple

from hydra.core.hydra_config import HydraConfig

from twbal.cli.commands import text
from twbal.cli.conf_folder import conf_folder
from twbal.cli.console import say
from twbal.cli.robot_words import sheet_of
from twbal.core.check import Measurement
from twbal.core.errors import ConfigError
from twbal.core.files import write_atomically
from twbal.core.robot_parameters import RobotParameters
from twbal.core.robot_sheet import VALUES, ValueProvenance, robot_sheet
from twbal.link.checks.line import CONTROL_PERIOD
from twbal.link.checks.procedure import LinkReport
from twbal.link.sheet_check import is_beyond, is_of_another
from twbal.sheets.editing import SheetEdit, edited, noted, renamed, sheet_values
from twbal.sheets.link_record import build_number
from twbal.sheets.writing import is_of_interview, number, written, written_at_most

FOLDER = Path("my_conf")
"""Of a person's own configuration, where none was named by --config-dir."""

_SAME = 1e-5  # share by which a number of single precision may differ from the sheet's


class Written(NamedTuple):
    """What came of writing.

    Attributes:
        robots: that were checked, by their sheets as they are now: that of the run, and the copy's.
        sheet: file that it stands in.
    """

    robots: tuple[RobotParameters, ...]
    sheet: Path


class SheetFile(NamedTuple):
    """Where a sheet lies.

    Attributes:
        path: of the file.
        packaged: it is one of twbal's own, which stay as they are.
    """

    path: Path
    packaged: bool


def sheet_file() -> SheetFile:
    """The file of the robot that this run chose.

    Raises:
        ConfigError: it is in no folder.
    """
    hydra = HydraConfig.get()
    path = sheet_of(hydra)
    if path is None:
        choice = str(hydra.runtime.choices["robot"])
        raise ConfigError(
            f"The sheet of robot {choice!r} lies in no folder. Give --config-dir=<folder>, and robot=<name>."
        )
    return SheetFile(path, path.parent.parent == conf_folder())


def made_by_interview() -> bool:
    """Whether `twbal new-robot` made the sheet of this run; not where there is no run, or no file."""
    if not HydraConfig.initialized():
        return False
    try:
        return is_of_interview(sheet_file().path.read_text(encoding="utf-8"))
    except (ConfigError, OSError, UnicodeDecodeError):
        return False


def check_numbers(file: SheetFile) -> None:
    """Check that what the robot is measured to have can be written into its sheet, before it is tried.

    Args:
        file: the sheet.

    Raises:
        ConfigError: the sheet cannot be changed here.
    """
    sheet = sheet_values(file.path.read_text(encoding="utf-8"))
    for key in ("control_period", "torque_limit"):
        _number(sheet, key)


def write_measured(report: LinkReport, robot: RobotParameters, file: SheetFile) -> Written:
    """Write what was measured into a sheet, and say what changed; of a packaged sheet, into a copy of one's own.

    Args:
        report: of a robot on which nothing is wrong.
        robot: of this run, overrides included.
        file: its sheet.

    Returns:
        The robots that were checked, and where the sheet is.

    Raises:
        ConfigError: the sheet cannot be changed here, or is that of another robot.
        DataError: it cannot be written.
    """
    path = _copy_of(robot.name) if file.packaged else file.path.resolve()
    is_new = not path.exists()
    text = renamed(file.path.read_text(encoding="utf-8"), path.stem) if is_new else path.read_text(encoding="utf-8")
    before = sheet_values(text)
    changes = _changes(report, before)
    title = f"{date.today()}, of the robot {report.robot!r}, firmware {build_number(report.firmware)}"
    after = noted(edited(text, changes), title, [_line(each) for each in _measured(report)])
    write_atomically(path, after)
    _tell(path, is_new, changes, before)
    if not file.packaged:
        now: dict[str, Any] = {change.key: written(change.value) for change in changes}
        return Written((replace(robot, **now),), path)
    return Written((robot, _robot_of(sheet_values(after))), path)


def with_copy(robot: RobotParameters, file: SheetFile) -> tuple[RobotParameters, ...]:
    """A robot and, where its sheet is a packaged one, the copy of one's own that is there already.

    Args:
        robot: of this run, overrides included.
        file: its sheet.

    Raises:
        ConfigError: the copy cannot be used.
    """
    if not file.packaged or not (copy := _copy_of(robot.name)).is_file():
        return (robot,)
    return robot, _robot_of(sheet_values(copy.read_text(encoding="utf-8")))


def _robot_of(sheet: Mapping[str, Any]) -> RobotParameters:
    values = {key: _number(sheet, key) for key in VALUES}
    return robot_sheet(name=sheet["name"], provenance=sheet["provenance"], **values)


def _copy_of(name: str) -> Path:
    """Where the own copy of a packaged sheet lies: `my_<name>`, as names of packaged ones cannot be used anew."""
    sources = HydraConfig.get().runtime.config_sources
    own = next((Path(source.path) for source in sources if source.provider == "command-line"), FOLDER)
    return own / "robot" / f"my_{name}.yaml"


def _changes(report: LinkReport, sheet: Mapping[str, Any]) -> list[SheetEdit]:
    """What the sheet does not say as the robot does."""
    today = f"check-link {date.today()}"
    limit = _number(sheet, "torque_limit")
    if is_of_another(limit, report.torque_limit):
        raise ConfigError(
            f"The robot {report.robot!r} takes at most {report.torque_limit:g} N·m, and the sheet {sheet['name']!r} "
            f"says {limit:g} N·m: nothing was written into it. Is it the right one (robot=...)?"
        )
    ticks = [each.value for each in _measured(report) if each.name == CONTROL_PERIOD]
    kind = ValueProvenance.MEASURED if ticks else ValueProvenance.DATA_SHEET
    seen = f"{ticks[0] * 1e3:.4g} ms by its clock, " if ticks else ""
    period = SheetEdit("control_period", report.control_period, kind, f"as the firmware says, {seen}{today}")
    found = []
    listed = sheet["provenance"].get(kind) or ()
    if _differs(period.value, _number(sheet, period.key)) or (ticks and period.key not in listed):
        found.append(period)
    if is_beyond(limit, report.torque_limit):
        source = f"limit of the firmware, {today}"
        found.append(
            SheetEdit("torque_limit", written_at_most(report.torque_limit), ValueProvenance.DATA_SHEET, source)
        )
    return found


def _number(sheet: Mapping[str, Any], key: str) -> float:
    try:
        return float(sheet[key])
    except (KeyError, TypeError, ValueError) as error:
        raise ConfigError(f"The sheet {sheet['name']!r} has no plain number as {key}; write one.") from error


def _differs(a: float, b: float) -> bool:
    return abs(a - b) > _SAME * abs(b)


def _measured(report: LinkReport) -> list[Measurement]:
    return [each for check in report.checks for each in check.measured]


def _line(measured: Measurement) -> str:
    return f"{measured.name} {measured.value:.4g} {measured.unit}".strip()


def _tell(path: Path, is_new: bool, changes: Sequence[SheetEdit], before: Mapping[str, Any]) -> None:
    print(f"sheet {path}{', a copy of the packaged one' * is_new}")
    for change in changes:
        old, new = _number(before, change.key), written(change.value)
        step = f"{number(new)}" if old == new else f"{before[change.key]} -> {number(new)}"
        say(f"{change.key}: {step}, {'now ' * (old == new)}{change.provenance} ({change.source})")
    if not changes:
        say("its values are the robot's; what was measured besides stands at its end")
    if path.parent.parent == FOLDER:
        say(f"choose it by {chosen_by(path)}")


def chosen_by(sheet: Path) -> str:
    """The words that choose a sheet of one's own, for a shell."""
    return shlex.join([f"--config-dir={sheet.parent.parent}", f"robot={text(sheet.stem)}"])
