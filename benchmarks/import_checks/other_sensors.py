"""Logs that lack something that others have: even time stamps, or a tilt; and what the import must make of them."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from benchmarks.import_checks.conventions import Written
from benchmarks.import_checks.robot import Ride
from twbal.core.gaussian import Array
from twbal.core.robot_parameters import GRAVITY
from twbal.io.importers.conversion import Imported
from twbal.io.importers.tilt_by_gyro import FILTER_TIME

_ROWS = 3, 11  # of a packet, about; one more or less at times
_JITTER = (0.0, 0.2, 0.5, 1.0)  # periods by which packets are late, in the mean
_WITHIN = (0.0, 1e-4, 3e-4)  # s between the stamps of one packet
_LOST = 0.3  # share of the logs in which a packet is lost
_FILL = 3  # lost rows within a recording
_PERIOD = 2e-4  # share by which the period may be off, as clocks are
_TILT = 0.02  # rad by which the tilt may be off, but for its mean: standard deviation
_NOISE = 0.3  # m/s² of an accelerometer


class Odd(NamedTuple):
    """A log, and how far off what was made of it is.

    Attributes:
        log: with its mapping.
        off: error of what the import made of it, as a share of what is right: at most 1.
    """

    log: Written
    off: Callable[[Imported], float]


def bunched(ride: Ride, log: Written, rng: np.random.Generator) -> Odd | None:
    """Rows that a computer stamps as packets arrive; None where the log has no time."""
    if "stamp" not in log.columns:
        return None
    dt, count = ride.build.true.control_period, len(ride.tilt)
    rows, jitter, within = int(rng.integers(*_ROWS)), float(rng.choice(_JITTER)) * dt, float(rng.choice(_WITHIN))
    ends = np.cumsum(rows + rng.integers(-1, 2, count))
    ends = np.append(ends[ends < count], count)
    stamps, kept, begin, before = np.empty(count), np.ones(count, bool), 0, 0.0
    lost = int(rng.integers(20, len(ends) - 20)) if rng.random() < _LOST else 0
    for number, end in enumerate(ends):
        arrival = max(dt * (end - 1) + rng.exponential(jitter), before + 1e-4)
        stamps[begin:end] = arrival + within * np.arange(end - begin)
        kept[begin:end] = not lost or number != lost
        begin, before = end, float(stamps[end - 1])
    columns = {name: values[kept] for name, values in log.columns.items()}
    unit, digits = (1e3, 0) if rng.random() < 0.5 else (1e6, 0)
    columns["stamp"] = np.round(unit * (stamps[kept] + 1000.0), digits)
    gaps = np.diff(np.flatnonzero(kept)) - 1
    lengths = np.diff(np.concatenate([[0], np.flatnonzero(gaps > _FILL) + 1, [int(kept.sum())]]))

    def off(imported: Imported) -> float:
        found = [len(episode.observations) for episode in imported.episodes]
        return abs(imported.episodes[0].control_period / dt - 1.0) / _PERIOD if found == lengths.tolist() else np.inf

    time = {"time": {"from": "stamp", "unit": "ms" if unit == 1e3 else "us"}}
    return Odd(replace(log, columns=columns, quantities={**log.quantities, **time}), off)


def no_tilt(ride: Ride, log: Written, rng: np.random.Generator) -> Odd | None:
    """A gyro alone; None where the log has none."""
    return _without_tilt(log, ride.true_tilt)


def accelerometer(ride: Ride, log: Written, rng: np.random.Generator) -> Odd | None:
    """A gyro and two axes of an accelerometer, of which a filter is expected; None where the log has no gyro."""
    noise = _NOISE * rng.standard_normal((2, len(ride.felt)))
    columns = {"ax": np.round(-GRAVITY * np.sin(ride.felt) + noise[0], 3)}
    columns["az"] = np.round(GRAVITY * np.cos(ride.felt) + noise[1], 3)
    axes = {"accelerometer_forward": {"from": "ax"}, "accelerometer_up": {"from": "az"}}
    log = replace(log, columns={**log.columns, **columns}, quantities={**log.quantities, **axes})
    wrong, share = np.zeros(len(ride.felt)), ride.build.true.control_period / FILTER_TIME
    for k in range(1, len(wrong)):
        wrong[k] = wrong[k - 1] + share * (ride.felt[k] - ride.true_tilt[k] - wrong[k - 1])
    return _without_tilt(log, ride.true_tilt + wrong)


def _without_tilt(log: Written, expected: Array) -> Odd | None:
    if "tilt_rate" not in log.quantities:
        return None
    quantities = {quantity: source for quantity, source in log.quantities.items() if quantity != "tilt"}
    columns = {column: values for column, values in log.columns.items() if column != "angle_y"}

    def off(imported: Imported) -> float:
        (episode,) = imported.episodes
        return float(np.std(episode.tilt - expected) / _TILT)

    return Odd(replace(log, columns=columns, quantities=quantities), off)


CONVENTIONS: Mapping[str, Callable[[Ride, Written, np.random.Generator], Odd | None]] = {
    "stamps in bunches": bunched,
    "no tilt": no_tilt,
    "accelerometer in place of tilt": accelerometer,
}
