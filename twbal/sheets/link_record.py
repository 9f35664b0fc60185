"""What the last check of a robot's link came to, kept on this computer, and what speaks against arming that robot."""

import hashlib
import os
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from twbal.core.check import Measurement
from twbal.core.errors import DataError
from twbal.core.json_records import read_record, write_record
from twbal.core.robot_parameters import RobotParameters, parameter_hash
from twbal.core.robot_sheet import VALUES
from twbal.sheets.questions import QUESTIONS


class Announced(NamedTuple):
    """What a robot says of itself when it is greeted.

    Attributes:
        robot: its name.
        version: of the protocol.
        firmware: number of its build; 0: unknown.
        control_period: [s].
        torque_limit: [N·m].
    """

    robot: str
    version: int
    firmware: int
    control_period: float
    torque_limit: float


@dataclass(frozen=True)
class LinkRecord:
    """A check of a robot with a sheet.

    Attributes:
        sheet: name of the sheet.
        sheet_hash: of its values, as they were after the check.
        announced: by the robot.
        checked: when, in UTC, as text that can be sorted.
        problems: names of the checks that found something wrong.
        measured: numbers.
        values: of the sheet, as they were after the check; records of older versions have none.
        skipped: names of the checks that were left out; not known of older versions.
        finished: the check came to its end; until then there are neither problems nor numbers.
    """

    sheet: str
    sheet_hash: str
    announced: Announced
    checked: str
    problems: tuple[str, ...]
    measured: tuple[Measurement, ...]
    values: Mapping[str, float] = field(default_factory=dict)
    skipped: tuple[str, ...] = ()
    finished: bool = True


def records_folder() -> Path:
    """Where records lie: in the state of this user on this computer, whose line and robot were checked."""
    base = Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state")
    return base / "twbal" / "links"


def keep_record(record: LinkRecord, folder: Path) -> Path:
    """Write a record in the place of that of the same sheet and robot; returns its file.

    Raises:
        DataError: it cannot be written.
    """
    path = _file(folder, record.sheet, record.announced.robot)
    write_record(path, record)
    return path


def last_record(folder: Path, sheet: str, robot: str) -> LinkRecord | None:
    """The record of a sheet and a robot, by their names; else the newest of either; None where there is none.

    Raises:
        DataError: it cannot be read.
    """
    own = _file(folder, sheet, robot)
    if own.exists():
        return read_record(LinkRecord, own)
    found = [read_record(LinkRecord, path) for path in sorted(folder.glob("*.json"))]
    of_either = [record for record in found if record.sheet == sheet or record.announced.robot == robot]
    return max(of_either, key=lambda record: record.checked, default=None)


def objection(record: LinkRecord, robot: RobotParameters, announced: Announced, needed: Collection[str] = ()) -> str:
    """What speaks against arming a robot, as a sentence; empty where nothing does.

    Args:
        record: of the last check of its link.
        robot: its sheet.
        announced: by the robot, now.
        needed: names of checks that must not have been left out.
    """
    when = f"twbal check-link of {record.checked}"
    if record.sheet != robot.name:
        return f"the last {when} was with the sheet {record.sheet!r}, and this is {robot.name!r}."
    if not record.finished:
        return f"the last {when} did not finish."
    changed = [
        f"{name.replace('_', ' ')} was {_announced(name, before, now)} and is {_announced(name, now, before)}"
        for name, before, now in zip(Announced._fields, record.announced, announced, strict=True)
        if before != now
    ]
    if changed:
        return f"it is not as at the last {when}: its {', its '.join(changed)}."
    if record.problems:
        return f"the last {when} found something wrong: {', '.join(record.problems)}."
    if left_out := [name for name in record.skipped if name in needed]:
        return f"the last {when} left out: {', '.join(left_out)}."
    if record.sheet_hash != parameter_hash(robot):
        return f"values of the sheet {robot.name!r} have changed since the last {when}{_changes(record.values, robot)}."
    return ""


def sheet_numbers(robot: RobotParameters) -> dict[str, float]:
    """The values of a sheet, by their names."""
    return {name: float(getattr(robot, name)) for name in VALUES}


def _changes(before: Mapping[str, float], robot: RobotParameters) -> str:
    """Which values of a sheet changed; empty where it is not known what they were."""
    facts = [
        f"{name} was {_number(before[name], now, unit)} and is {_number(now, before[name], unit)}"
        for name, now in sheet_numbers(robot).items()
        for unit in [QUESTIONS[name].unit]
        if name in before and before[name] != now
    ]
    return f": {', '.join(facts)}" if facts else ""


def _announced(name: str, value: object, other: object) -> str:
    if not isinstance(value, int | float) or not isinstance(other, int | float):
        return repr(value)
    if name == "firmware":
        return build_number(int(value))
    return _number(value, other, QUESTIONS[name].unit if name in QUESTIONS else "")


def _number(value: float, other: float, unit: str) -> str:
    """A number, with as many digits as tell it from another."""
    digits = next((digits for digits in (6, 9) if f"{value:.{digits}g}" != f"{other:.{digits}g}"), 17)
    return f"{value:.{digits}g} {unit}".strip()


def build_number(firmware: int) -> str:
    """The number of a firmware's build, in words."""
    return f"{firmware:08x}" if firmware else "not numbered"


def unreadable(error: DataError) -> str:
    """What speaks against arming a robot whose record cannot be read."""
    return f"the record of its last twbal check-link cannot be read: {str(error).rstrip('.')}."


def _file(folder: Path, sheet: str, robot: str) -> Path:
    name = re.sub(r"[^\w-]", "_", f"{sheet}__{robot}", flags=re.ASCII)[:80]
    both = hashlib.sha256("\0".join((sheet, robot)).encode()).hexdigest()
    return folder / f"{name}_{both[:10]}.json"
