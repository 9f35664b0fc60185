"""A first mapping for a log that nobody has described yet, by its columns' names and numbers; what is open is said."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import yaml

from twbal.core.plant import Observation
from twbal.core.robot_parameters import RobotParameters
from twbal.io.importers.all_columns import Column, all_columns, passed_over, row_of
from twbal.io.importers.column_choice import Unit, choose
from twbal.io.importers.column_names import CURRENT, DUTY, QUATERNION, is_axis_of_accelerometer
from twbal.io.importers.duty_torque import full_duty, torque_way
from twbal.io.importers.faster_loop import answered_speeds
from twbal.io.importers.late_rates import lateness_of
from twbal.io.importers.mapping import ACCELEROMETER, QUANTITIES
from twbal.io.importers.measured_columns import straight
from twbal.io.importers.proposal import OPEN, Proposal, sources_of
from twbal.io.importers.rate_choice import are_alike, rate_choice, unit_by_angle
from twbal.io.importers.remaining_entries import KnownMapping, remaining_entries
from twbal.io.importers.time_choice import time_choice

_PERCENT = (2.0, 130.0)  # largest values of a duty cycle in percent, before it is clipped
_WHOLE_PERCENT = 100.0  # above it, whole numbers are steps of a timer, such as 255 for full


class Guess(NamedTuple):
    """What a log looks like.

    Attributes:
        table: one line a column: number, name, smallest, largest and first values.
        mapping: a yaml file for the group `import`, with ??? where nothing could be told for certain.
        open: quantities that a person has to fill in, each with the reason.
        unknown_units: quantities of which the unit was taken to be SI.
        is_duty: whether the command is a duty cycle, of which a torque can be made without the data of a motor.
    """

    table: tuple[str, ...]
    mapping: str
    open: tuple[str, ...]
    unknown_units: tuple[str, ...]
    is_duty: bool


def guess(path: Path, robot: RobotParameters | None = None, known: KnownMapping | None = None) -> Guess:
    """Propose a mapping for a log.

    Args:
        path: of the log.
        robot: whose torque limit a duty cycle may be a share of; None says nothing of that.
        known: mapping of that robot, whose motor is taken; and how its rows are written, if it has the same columns.

    Raises:
        LogError: it cannot be read.
    """
    columns = all_columns(path)
    proposal = _of_an_export(columns) or _by_names(columns)
    quantities = [f"  {name}: {proposal.lines[name]}" for name in QUANTITIES if name in proposal.lines]
    command, tilt, gyro = (proposal.columns.get(name, ()) for name in ("command", "tilt", "tilt_rate"))
    tilt = [column._replace(values=straight("tilt", column)) for column in tilt]
    answered = answered_speeds(columns, command or proposal.columns.get("voltage", ()), tilt, gyro)
    rest = remaining_entries(yaml.safe_load("\n".join(quantities)), proposal.motor, answered, known)
    lines = [
        f"# Proposed by `twbal import-log guess=true` for {path.name}: look through every line.",
        "# '???' is for you to fill in; null says that the log does not have it.",
        "_target_: twbal.io.importers.mapping.mapping",
        "quantities:",
        *quantities,
        *(torque_way(*proposal.duty, robot).splitlines() if proposal.duty and robot else ()),
        "names: []  # of all columns, where files have no header",
        "rate: null # samples a second, where there is no time [Hz]",
    ]
    table = [*(row_of(number, column) for number, column in enumerate(columns, start=1)), *passed_over(path)]
    mapping = "\n".join(lines) + "\n" + rest.text
    left = *proposal.open, *rest.open
    return Guess(tuple(table), mapping, left, tuple(proposal.unknown_units), proposal.duty is not None)


def _of_an_export(columns: Sequence[Column]) -> Proposal | None:
    """The mapping of a table that `twbal export` wrote; None of any other."""
    by_name = {column.name: column for column in columns}
    if "command" not in by_name or not all({n, f"{n}_estimated"} & set(by_name) for n in Observation._fields):
        return None
    proposal = Proposal()
    for name in (*Observation._fields, "command"):
        if name in by_name:
            proposal.lines[name] = f"{{from: {name}, unit: {QUANTITIES[name]}}}  # as twbal export writes it"
        else:
            proposal.drop(name, f"{name}_estimated was worked out, not measured")
    return proposal


def _by_names(columns: Sequence[Column]) -> Proposal:
    proposal = Proposal()
    _time(proposal, columns)
    tilt, gyro = choose("tilt", columns), None
    if tilt.columns:
        proposal.take("tilt", tilt.columns)
    else:
        _tilt_by_gyro(proposal, columns, tilt.reason or _by_quaternion(columns))
    for name in ("tilt_rate", "acceleration", "yaw_rate", "wheel_rate"):
        choice, why = rate_choice(name, columns)
        if name == "wheel_rate" and choice.columns and (late := lateness_of(choice.columns, columns)):
            proposal.drop(name, late)
        elif choice.columns:
            by_angle = unit_by_angle(name, choice.columns, columns)
            if name == "yaw_rate" and gyro is not None and are_alike(gyro[0], choice.columns[0]):
                what = "unit as that" if gyro[1].is_scaled else "unit and scale as those"
                by_angle = gyro[1]._replace(comment=f"{what} of {gyro[0].name}")
            if name == "tilt_rate" and by_angle is not None:
                gyro = choice.columns[0], by_angle
            proposal.take(name, choice.columns, why=why, by_others=by_angle)
        elif choice.is_for_person:
            proposal.leave(name, choice.reason)
        else:
            proposal.drop(name, choice.reason)
    _wheels(proposal, columns)
    _command(proposal, columns)
    return proposal


def _tilt_by_gyro(proposal: Proposal, columns: Sequence[Column], reason: str) -> None:
    """Leave the tilt to the import, where the log has a gyro and nothing that may be a tilt; else to a person."""
    gyro = choose("tilt_rate", columns)
    if reason or not (gyro.columns or gyro.is_for_person):
        proposal.leave("tilt", reason or _not_found(columns))
        return
    proposal.drop("tilt", "not found among the names: the import works it out from tilt_rate")
    axes = [column.name for column in columns if is_axis_of_accelerometer(column.meaning)]
    if len(axes) > 1:
        for name in ACCELEROMETER:
            proposal.leave(
                name, f"which of {', '.join(axes)}, and with which sign? Or null for both: by the gyro alone"
            )


def _time(proposal: Proposal, columns: Sequence[Column]) -> None:
    choice = time_choice(columns)
    if choice.split:
        both = Unit("s", "one time; the import takes the mean of both, hence the 2")
        proposal.take("time", (choice.split.seconds, choice.split.fraction), choice.split.scale, by_others=both)
    elif choice.column:
        proposal.take("time", [choice.column])
    else:
        proposal.leave("time", choice.reason)


def _not_found(columns: Sequence[Column]) -> str:
    """Why a quantity is left to a person whom no name helps."""
    has_names = any(column.name for column in columns)
    return "not found among the names" if has_names else "the file has no names of columns: fill in the column's number"


def _by_quaternion(columns: Sequence[Column]) -> str:
    """What to do about a tilt that a log tells as a quaternion; "" where it does not."""
    parts = [column.name for column in columns if column.meaning.quantity == QUATERNION]
    if len(parts) < 4:
        return ""
    names = ", ".join(parts[:4])
    return f"{names} are a quaternion: add a column with the pitch, asin(2 (w y - z x)) where y points to the left"


def _by_current(columns: Sequence[Column]) -> str:
    """What to do about a torque that a log tells as a current; "" where it does not."""
    found = [column.name for column in columns if column.meaning.quantity == CURRENT]
    advice = "a current of a motor times torque constant and gear is a torque: fill in its name and that scale"
    return f"perhaps {' and '.join(found)}: {advice}, N·m/A" if found else ""


def _wheels(proposal: Proposal, columns: Sequence[Column]) -> None:
    """What the wheels did: their angle, or a distance, or a pose, or their rate alone."""
    angle = choose("wheel_angle", columns)
    pose = {name: choose(name, columns).columns for name in ("x", "y", "heading")}
    if angle.columns:
        proposal.take("wheel_angle", angle.columns)
    elif angle.is_for_person:
        proposal.leave("wheel_angle", angle.reason)
    elif distance := choose("distance", columns).columns:
        proposal.take("distance", distance)
    elif all(pose.values()):
        proposal.take("x", pose["x"])
        proposal.take("y", pose["y"])
    elif not proposal.lines["wheel_rate"].startswith(("null", f"{{from: {OPEN}")):
        proposal.drop("wheel_angle", "the sum of wheel_rate")
    else:
        rate = choose("wheel_rate", columns).reason
        proposal.leave("wheel_angle", angle.reason or rate or _not_found(columns))
    if pose["heading"] and ("x" in proposal.lines or proposal.lines["yaw_rate"].startswith("null")):
        proposal.take("heading", pose["heading"])
    if "wheel_angle" not in proposal.lines:
        proposal.drop("wheel_angle")


def _command(proposal: Proposal, columns: Sequence[Column]) -> None:
    """The torque; else a voltage; else a duty cycle, which is a share of a voltage."""
    torque = choose("command", columns)
    if torque.columns:
        of_two = ("2", "their sum, which is twice their mean") if len(torque.columns) == 2 else None
        proposal.take("command", torque.columns, *(of_two or ("", "of both wheels together?")))
        return
    volts = choose("voltage", [c for c in columns if np.nanmin(c.values, initial=0.0) < 0.0])
    duty = choose(DUTY, columns)
    if not torque.is_for_person and (volts.columns or duty.columns):
        why = "their mean, for the motor is both as one" if len(volts.columns or duty.columns) == 2 else ""
        if volts.columns:
            proposal.take("voltage", volts.columns, why=why)
        else:
            _take_duty(proposal, duty.columns, why)
        proposal.motor = True
        proposal.drop("command")
        return
    proposal.leave(
        "command", torque.reason or volts.reason or duty.reason or _by_current(columns) or _not_found(columns)
    )


def _take_duty(proposal: Proposal, duty: Sequence[Column], why: str) -> None:
    """A duty cycle: percent where its unit or its largest value says so, else with a scale to fill in.

    Whole numbers of a `pwm` may be steps of a timer, whose full value a robot that stands does not come near.
    """
    largest = max(float(np.nanmax(np.abs(column.values))) for column in duty)
    why = f"{why}; " if why else ""
    is_whole = all((column.values % 1.0 == 0.0).all() for column in duty)
    is_counted = is_whole and (largest > _WHOLE_PERCENT or any("pwm" in column.meaning.stem for column in duty))
    is_named_percent = all(column.meaning.unit == "%" for column in duty)
    is_percent = is_named_percent or (_PERCENT[0] < largest <= _PERCENT[1] and not is_counted)
    sources = sources_of(duty)
    proposal.duty = sources, full_duty(duty, is_percent, is_counted)
    if is_percent:
        names = " and ".join(column.name for column in duty)
        text = f"{names}: {why}a duty cycle, in percent of the supply by its largest value, {largest:.3g}"
        proposal.lines["voltage"] = f"{{from: {sources}, unit: '%'}}  # {text}"
        proposal.columns["voltage"] = duty
        return
    known = f", the supply over the timer's full value (such as 255), or unit '%'; largest value {largest:.3g}"
    text = f"a duty cycle: fill in the scale, V for one{known if is_whole else ''}"
    proposal.take("voltage", duty, OPEN, f"{why}{text}")
    proposal.open.append("scale of voltage")
