"""Between a robot and its arming: the last `twbal check-link` of it, where the link is to heed that."""

from dataclasses import replace
from datetime import UTC, datetime

from omegaconf import DictConfig

from twbal.cli.console import say
from twbal.cli.own_sheet import made_by_interview
from twbal.core.check import problems, skipped
from twbal.core.errors import CheckError, DataError
from twbal.core.robot_parameters import RobotParameters, parameter_hash
from twbal.link.checks.by_hand import SIGNS_BY_HAND
from twbal.link.checks.procedure import MUST_HOLD, LinkReport
from twbal.link.protocol import Clock
from twbal.link.serial_plant import SerialPlant
from twbal.sheets.link_record import (
    Announced,
    LinkRecord,
    keep_record,
    last_record,
    objection,
    records_folder,
    sheet_numbers,
    unreadable,
)

HEED = "heed_check"
"""Setting of a stage: whether the last check of the link counts; None: where the robot is on a port."""

SAME_ROBOT = ("link.port", "link.deploy", "link.confirm_placed")
"""Settings of a link that bear on no result: by which way the same robot is reached, and what its person is asked."""


def heeds(cfg: DictConfig, link: DictConfig) -> bool:
    """Whether the last check counts.

    Args:
        cfg: of a stage, or its section in that of another.
        link: of the robot.
    """
    asked = cfg.get(HEED)
    return "port" in link if asked is None else bool(asked)


def heed_last_check(plant: SerialPlant, robot: RobotParameters, advise: bool = True) -> None:
    """Refuse a robot as `advice_of_last_check` does, and say its advice.

    Args:
        plant: the robot.
        robot: its sheet.
        advise: whether what does not speak against the robot is worth a sentence.

    Raises:
        CheckError: it is not to be armed.
    """
    overrule = f"{HEED}=false (in iterate: real_rollout.{HEED}=false)"
    advice = advice_of_last_check(plant, robot, made_by_interview(), overrule)
    if advice and advise:
        say(advice)


def advice_of_last_check(plant: SerialPlant, robot: RobotParameters, of_interview: bool, overrule: str) -> str:
    """Refuse a robot whose link was found wrong, or that is not as it was when it was checked.

    Args:
        plant: the robot.
        robot: its sheet.
        of_interview: `twbal new-robot` made the sheet, as a real robot's own; it is refused where it was never checked.
        overrule: what drives the robot all the same, as the end of a sentence.

    Returns:
        A sentence on what was not tried, without its period; empty where nothing is to be said.

    Raises:
        CheckError: it is not to be armed.
    """
    try:
        record = last_record(records_folder(), robot.name, plant.robot_name)
        against = objection(record, robot, announced_by(plant), _needed(plant)) if record else ""
    except DataError as error:
        record, against = None, unreadable(error)
    if record is None and not against and of_interview:
        against = (
            f"it was never tried by `twbal check-link`, and the sheet {robot.name!r} is that of a robot of your own, "
            "whose signs nobody knows yet."
        )
    if against:
        raise CheckError(
            f"The robot {plant.robot_name!r} is not armed: {against} Try it by `twbal check-link`, with the same "
            f"robot= and link=; or drive it all the same by {overrule}."
        )
    if record is None:
        return f"the robot {plant.robot_name!r} was never tried by `twbal check-link`, which finds wrong signs"
    if SIGNS_BY_HAND in record.skipped:
        return f"the {SIGNS_BY_HAND} of the robot {plant.robot_name!r} were not tried by `twbal check-link`"
    return ""


def _needed(plant: SerialPlant) -> tuple[str, ...]:
    """Checks that must have been made: Stop and watchdog in real time, and the signs where a person places it."""
    of_person = (SIGNS_BY_HAND,) if plant.is_placed_by_hand else ()
    return of_person if plant.clock is Clock.LOCKSTEP else (*MUST_HOLD, *of_person)


def announced_by(plant: SerialPlant) -> Announced:
    """What a robot says of itself."""
    return Announced(plant.robot_name, plant.version, plant.firmware, plant.control_period, plant.torque_limit)


def carry_check(before: Announced, plant: SerialPlant, robot: RobotParameters) -> None:
    """Let the last check of a robot hold for another build of its firmware, where it held for the one before.

    Args:
        before: what it announced before it was given another policy, and nothing else.
        plant: the robot now.
        robot: its sheet.

    Raises:
        DataError: the record cannot be read or written.
    """
    now, record = announced_by(plant), last_record(records_folder(), robot.name, plant.robot_name)
    if record and not objection(record, robot, before) and now == before._replace(firmware=now.firmware):
        keep_record(replace(record, announced=now), records_folder())


def record_begin(plant: SerialPlant, robots: tuple[RobotParameters, ...]) -> None:
    """Note that a check has begun: until `record_check`, nothing is to arm the robot, whatever a check before said.

    Args:
        plant: the robot.
        robots: its sheets.

    Raises:
        DataError: it cannot be written.
    """
    for robot in robots:
        known = (robot.name, parameter_hash(robot), announced_by(plant), _now(), (), ())
        keep_record(LinkRecord(*known, sheet_numbers(robot), finished=False), records_folder())


def record_check(report: LinkReport, robots: tuple[RobotParameters, ...]) -> None:
    """Keep what a check came to, for each of the sheets that it is of.

    Raises:
        DataError: it cannot be written.
    """
    limits = (report.control_period, report.torque_limit)
    announced = Announced(report.robot, report.version, report.firmware, *limits)
    measured = tuple(each for check in report.checks for each in check.measured)
    wrong = tuple(problems(report.checks))
    for robot in robots:
        known = (robot.name, parameter_hash(robot), announced, _now(), wrong, measured)
        record = LinkRecord(*known, sheet_numbers(robot), tuple(skipped(report.checks)))
        keep_record(record, records_folder())


def _now() -> str:
    return datetime.now(UTC).isoformat(sep=" ", timespec="seconds")
