"""From the columns of a foreign log to episodes."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from math import isfinite
from pathlib import Path
from typing import NamedTuple

import numpy as np

from twbal.core.channels import Channels
from twbal.core.episode import Episode, Estimated, Event, Outcome, Provenance
from twbal.core.errors import LogError
from twbal.core.gaussian import Array
from twbal.core.plant import Observation
from twbal.core.robot_parameters import RobotParameters
from twbal.core.smoothed_derivatives import noise_sd
from twbal.core.text import counted
from twbal.io.importers.arrays import read_arrays
from twbal.io.importers.checks.all_checks import doubts
from twbal.io.importers.checks.doubt import Curves, Doubt, DoubtKind, LogPart
from twbal.io.importers.checks.motor_doubts import stall_doubts, voltage_doubts
from twbal.io.importers.checks.rates import integral
from twbal.io.importers.checks.repeated_rows import held_doubts
from twbal.io.importers.columns import Columns
from twbal.io.importers.formats import reader_of
from twbal.io.importers.mapping import ACCELEROMETER, SIDES, UNITS
from twbal.io.importers.mapping import Mapping as LogMapping
from twbal.io.importers.sampling import FILLED, stretches
from twbal.io.importers.text_files import read_text
from twbal.io.importers.tilt_by_gyro import FILTER_TIME, tilt_by_gyro
from twbal.io.importers.usable_rows import usable_rows
from twbal.io.importers.wrap_doubts import with_ranges

_LOOKED_AT = 20_000  # samples that are checked
_PERIODS = 0.0005, 1.0  # s; control periods that a robot can have
_SUMMED = {"wheel_angle": "the sum of its rate", "tilt": "the sum of its rate, less its trend"}
_ABOUT_TILT = {
    True: f"the tilt is that of a complementary filter of tilt_rate and {' and '.join(ACCELEROMETER)}, with a time "
    f"constant of {FILTER_TIME:g} s; what is said of the tilt is said of these",
    False: "the log has no tilt: its mean, and an offset of the centre of mass, cannot be told; what is said of the "
    "tilt is said of tilt_rate. Log an accelerometer, or the tilt of the robot's filter",
}
_SAME_PERIOD = 0.02  # share of a period within which two periods are the same


class Wanted(NamedTuple):
    """What is to come out.

    Attributes:
        channels_at: state channels of episodes of a control period [s].
        period: control period of the episodes [s], a multiple of the log's; None keeps the log's.
        min_length: samples of a recording, below which it is left out.
        robot: data sheet with which sizes are compared; None compares signs alone.
    """

    channels_at: Callable[[float], Channels]
    period: float | None
    min_length: int
    robot: RobotParameters | None = None


class Imported(NamedTuple):
    """What came out of one file.

    Attributes:
        episodes: one for each part without a gap.
        notes: what was done to the data.
        doubts: what looks wrong with them.
        untold: what the log does not tell, and what it would take.
    """

    episodes: tuple[Episode, ...]
    notes: tuple[str, ...]
    doubts: tuple[Doubt, ...]
    untold: tuple[str, ...]


def import_file(path: Path, mapping: LogMapping, wanted: Wanted, provenance: Provenance) -> Imported:
    """Read a foreign log.

    Raises:
        LogError: it cannot be read; the message says where and why.
    """
    read = read_text if reader_of(path) is None else read_arrays
    columns = read(path, mapping.wanted, mapping.names, mapping.unsaid)
    usable = usable_rows(path, _with_last_command(columns, mapping), mapping)
    columns, mapping = usable.columns, usable.mapping
    signals = mapping.signals(columns)
    if mapping.rate is not None:
        signals["time"] = _time_by_rows(path, columns, mapping.rate)
    if "heading" in signals:
        signals["heading"] = np.unwrap(signals["heading"])  # means and lost samples are between two of one turn
    parts, period, more, odd = stretches(path, signals, columns, mapping.fill)
    notes = [*columns.notes, *usable.notes, *more]
    if "tilt" not in signals:
        step = period.of(1, wanted.period)
        parts = [{**part, "tilt": tilt_by_gyro(part, step, _skipped(part, mapping))} for part in parts]
        notes.append(_ABOUT_TILT[mapping.measures_tilt])
    every = _every(path, period.of(1), wanted.period)
    least = max(wanted.min_length, 4 * every)
    rests = [_from(part, _skipped(part, mapping)) for part in parts]
    long = [rest for rest in rests if len(rest["time"]) >= least]
    short = [len(part["time"]) for part, rest in zip(parts, rests, strict=True) if len(rest["time"]) < least]
    if short:
        skipped = f", of which the first {mapping.skip:g} s are skipped" if mapping.skip else ""
        notes.append(
            f"{counted(len(short), 'part')} without a gap of at most {max(short)} samples{skipped}: too short, left out"
        )
    if not long:
        raise LogError(
            f"{path} has no recording of {wanted.min_length} samples without a gap: {'; '.join(notes)}. "
            f"{_why_short(parts, mapping, least)}"
        )
    channels = wanted.channels_at(period.of(every, wanted.period))
    of = period.of(every, wanted.period), every, mapping, channels
    episodes = [_episode(rest, *of, replace(provenance, trial=provenance.trial + i)) for i, rest in enumerate(long)]
    if mapping.skip:
        notes.append(f"the first {mapping.skip:g} s of each recording are left out")
    if worked_out := _worked_out(episodes):
        notes.append(f"not measured, and worked out: {worked_out}")
    longest, step = max(parts, key=lambda part: len(part["time"])), period.of(1, wanted.period)
    looked_at = _part(longest, step, mapping, channels.wheel_radius, wanted.robot)
    looked_at = looked_at._replace(is_sampled=looked_at.is_sampled or usable.has_means)
    steps = Curves(1.0, np.diff(signals["time"]), "time between rows, by their number [s]")
    found = [Doubt(DoubtKind.TIME, "time", sentence, steps) for sentence in odd]
    found += [*usable.doubts, *_of_drive(mapping, signals, looked_at), *held_doubts(looked_at, every)]
    found += with_ranges(list(doubts(signals, looked_at)), columns, mapping)
    untold = tuple(doubt.sentence for doubt in found if doubt.kind is DoubtKind.UNTOLD)
    doubted = tuple(doubt for doubt in found if doubt.kind is not DoubtKind.UNTOLD)
    return Imported(tuple(episodes), tuple(notes), doubted, untold)


def _why_short(parts: Sequence[Mapping[str, Array]], mapping: LogMapping, least: int) -> str:
    """What to try where no part of a log has at least so many samples."""
    whole = max(parts, key=lambda part: len(part["time"]))["time"]
    if len(whole) >= least:  # before what is skipped
        return (
            f"The mapping skips the first {mapping.skip:g} s of each recording, and the longest has "
            f"{whole[-1] - whole[0]:.3g} s: give a smaller import.skip=... [s]."
        )
    return "Is the rate right? `min_length` and the mapping's `fill` and `skip` change what is kept."


def _time_by_rows(path: Path, columns: Columns, rate: float) -> Array:
    """Times of rows that come `rate` times a second, with gaps where rows were left out [s].

    Raises:
        LogError: the header comes again, so that a new recording may begin there.
    """
    if columns.header_again:
        raise LogError(
            f"Line {columns.header_again} of {path} is its header again, and without a column of time nothing "
            "tells whether a new recording begins there: expected is one recording a file. Cut the file there."
        )
    return np.asarray((columns.rows - columns.rows[0]) / rate)


def _skipped(part: Mapping[str, Array], mapping: LogMapping) -> int:
    """How many samples the mapping skips at the beginning of a recording."""
    return int(np.searchsorted(part["time"], part["time"][0] + mapping.skip - 1e-9))


def _from(part: Mapping[str, Array], begin: int) -> dict[str, Array]:
    """A recording from a sample on."""
    return {name: values[begin:] for name, values in part.items()}


def _worked_out(episodes: Sequence[Episode]) -> str:
    """What was not measured, each with how well it is known in the worst of the episodes."""
    worst: dict[str, Estimated] = {}
    for each in (each for episode in episodes for each in episode.estimated):
        worst[each.channel] = max(worst.get(each.channel, each), each, key=lambda known: known.sd)
    return ", ".join(f"{each.channel} ({_accuracy(each)})" for each in worst.values())


def _accuracy(of: Estimated) -> str:
    """How well what was not measured is known."""
    if isfinite(of.sd):
        return f"to ±{of.sd:.2g}"
    return _SUMMED.get(of.channel, "taken as 0")


def _part(
    signals: Mapping[str, Array], period: float, mapping: LogMapping, wheel_radius: float, robot: RobotParameters | None
) -> LogPart:
    """What the checks look at: signals as measured, at the log's own period."""
    begin = max(min(_skipped(signals, mapping), len(signals["time"]) - 8), 0)
    rest = {name: values[:_LOOKED_AT] for name, values in _from(signals, begin).items() if name != FILLED}
    commands = _commands(rest, 1, mapping)
    rest = {name: values[: len(commands) + 1] for name, values in rest.items()}
    whole = {name: values for name, values in rest.items() if " " not in name}
    sides = {
        name: (rest[f"{SIDES[0]} {name}"], rest[f"{SIDES[1]} {name}"]) for name in whole if f"{SIDES[0]} {name}" in rest
    }
    angle = _wheel_angle(rest, wheel_radius)
    if angle is not None:
        whole["wheel_angle"] = angle
    is_sampled, comes_before = mapping.command_is_sample, mapping.command_before_sample
    has_tilt = "tilt" in mapping.quantities
    return LogPart(period, whole, commands, sides, is_sampled, comes_before, robot, has_tilt)


def _with_last_command(columns: Columns, mapping: LogMapping) -> Columns:
    """The columns with some command in the last row, where that one alone is missing: it acts after the last sample."""
    is_command = np.array(
        [name in ("command", "voltage") for name, source in mapping.quantities.items() for _ in source.columns]
    )
    last = columns.values[-1]
    acts_later = not (mapping.command_is_sample or mapping.command_before_sample)
    if not acts_later or np.isfinite(last[is_command]).all() or not np.isfinite(last[~is_command]).all():
        return columns
    values = columns.values.copy()
    values[-1, is_command] = 0.0
    return columns._replace(values=values)


def _of_drive(mapping: LogMapping, signals: Mapping[str, Array], part: LogPart) -> Iterator[Doubt]:
    """Doubts about voltages and their motor, and about a command that is the mean of two torques, not their sum."""
    if mapping.motor is not None and "voltage" in signals:
        is_duty = mapping.quantities["voltage"].is_duty
        yield from voltage_doubts(signals["voltage"], mapping.motor, is_duty, part.period)
        yield from stall_doubts(part, mapping.motor)
    source = mapping.quantities.get("command")
    if source is not None and len(source.columns) == 2 and abs(source.factors[0]) in UNITS["N·m"].values():
        left, right = source.columns
        sentence = (
            f"command is the mean of {left} and {right}: where these are the torques of the two wheels, their sum is "
            "meant; give it scale: 2"
        )
        yield Doubt(DoubtKind.UNIT, "command", sentence)


def _every(path: Path, period: float, wanted: float | None) -> int:
    """How many samples of the log, one each `period` [s], make a control period of `wanted` [s]; None: one.

    Raises:
        LogError: no whole number of them does, or no robot has such a control period.
    """
    every = 1 if wanted is None else round(wanted / period)
    if wanted is not None and (every < 1 or abs(every * period / wanted - 1.0) > _SAME_PERIOD):
        raise LogError(
            f"{path} has a sample every {period:.6g} s, of which a control period of {wanted:g} s is no multiple. "
            "Give period=null to keep the log's own, or a multiple of it."
        )
    if not _PERIODS[0] <= every * period <= _PERIODS[1]:
        raise LogError(
            f"{path} has a sample every {period:.3g} s; expected is a control period from {_PERIODS[0]:g} to "
            f"{_PERIODS[1]:g} s. Is the unit of the time right?"
        )
    return every


def _episode(
    signals: Mapping[str, Array],
    period: float,
    every: int,
    mapping: LogMapping,
    channels: Channels,
    provenance: Provenance,
) -> Episode:
    """One recording as an episode, of `period` [s], which is `every` samples."""
    radius = channels.wheel_radius
    commands = _commands(signals, every, mapping)
    taken = {name: values[::every][: len(commands) + 1] for name, values in signals.items()}
    estimated: list[Estimated] = []

    def rate_of(name: str, values: Array) -> Array:
        from twbal.io.importers.smoother import smooth  # compiled, loads slowly: most logs have rates

        smoothed = smooth(values, period)
        estimated.append(Estimated(name, smoothed.rate_sd))
        return smoothed.rate

    def absent(name: str) -> Array:
        estimated.append(Estimated(name, float("inf")))
        return np.zeros(len(taken["time"]))

    tilt = taken["tilt"]
    if not mapping.measures_tilt:
        estimated.append(Estimated("tilt", float("inf")))
    tilt_rate = taken["tilt_rate"] if "tilt_rate" in taken else rate_of("tilt_rate", tilt)
    if (angle := _wheel_angle(taken, radius)) is None:
        angle = integral(taken["wheel_rate"], period)
        estimated.append(Estimated("wheel_angle", float("inf")))
    wheel_rate = taken["wheel_rate"] if "wheel_rate" in taken else rate_of("wheel_rate", angle)
    if "yaw_rate" in taken:
        yaw_rate = taken["yaw_rate"]
    else:
        yaw_rate = rate_of("yaw_rate", taken["heading"]) if "heading" in taken else absent("yaw_rate")
    if "acceleration" in taken:
        acceleration = taken["acceleration"]
    else:
        speed = radius * (wheel_rate + tilt_rate)
        acceleration = np.concatenate([[0.0], np.diff(speed)]) / period
        doubt = sum(e.sd**2 for e in estimated if e.channel in ("tilt_rate", "wheel_rate"))
        off = max(radius * float(np.sqrt(doubt)), noise_sd(speed))  # measured rates have noise, too
        estimated.append(Estimated("acceleration", float(np.sqrt(2.0)) * off / period))
    kept = np.flatnonzero(taken[FILLED] == 0.0) if FILLED in taken and every == 1 else np.arange(len(taken["time"]))
    time = taken["time"] - taken["time"][kept[0]]
    columns = {
        "time": time,
        "tilt": tilt,
        "tilt_rate": tilt_rate,
        "acceleration": acceleration,
        "wheel_angle": angle,
        "wheel_rate": wheel_rate,
        "yaw_rate": yaw_rate,
    }
    observations = np.column_stack([columns[name] for name in Observation._fields])
    events = [Event(0.0, f"began {float(taken['time'][0]):g} s into the log")] if taken["time"][0] else []
    return Episode(
        channels=channels.names,
        control_period=period,
        observations=observations[kept],
        states=channels.states(observations, commands)[kept],
        commands=commands[kept[:-1]],
        outcome=Outcome.COMPLETED,
        provenance=provenance,
        events=tuple(events),
        estimated=tuple(estimated),
    )


def _commands(signals: Mapping[str, Array], every: int, mapping: LogMapping) -> Array:
    """Mean torque over each control period, (T,) [N·m].

    A row's command acts after its sample, until the next one; before it, where the mapping says so.
    A command that is an instant of a faster loop is taken to run straight from one sample to the next.
    """
    if mapping.motor is not None and "voltage" in signals:
        supply = mapping.motor.supply
        torque = mapping.motor.torque_per_volt * np.clip(signals["voltage"], -supply, supply)
    else:
        torque = signals["command"]
    held = torque[1:] if mapping.command_before_sample else torque[:-1]
    if mapping.command_is_sample:
        held = 0.5 * (torque[1:] + torque[:-1])
    periods = len(held) // every
    return np.asarray(held[: periods * every].reshape(periods, every).mean(axis=1))


def _wheel_angle(taken: Mapping[str, Array], radius: float) -> Array | None:
    """Angle of the wheels relative to the body, as encoders count it; None where only their rate is known."""
    if "wheel_angle" in taken:
        return taken["wheel_angle"]
    if "distance" in taken:
        return taken["distance"] / radius
    if "x" in taken:
        heading = taken["heading"]
        middle = 0.5 * (heading[1:] + heading[:-1])
        forward = np.diff(taken["x"]) * np.cos(middle) + np.diff(taken["y"]) * np.sin(middle)
        return np.concatenate([[0.0], np.cumsum(forward)]) / radius
    return None
