"""Logs of a known motion at known instants, whose stamps are what a test makes of these."""

from pathlib import Path

import numpy as np

from twbal.io.importers.columns import Columns
from twbal.io.importers.sampling import FILLED, stretches


def motion(times, seed=0):
    """Quantities of a robot at these instants (n,), with the noise of sensors."""
    rng = np.random.default_rng(seed)
    tilt = 0.05 * np.sin(5.0 * times) + 0.02 * np.sin(13.0 * times + 1.0)
    wheel = 2.0 * np.sin(2.0 * times) + 0.3 * np.sin(9.0 * times)
    return {
        "tilt": tilt + 0.0005 * rng.standard_normal(len(times)),
        "wheel_angle": wheel + 0.002 * rng.standard_normal(len(times)),
    }


def resting(times, seed=0):
    """Quantities of a robot that stands still: noise alone."""
    noise = np.random.default_rng(seed).standard_normal((2, len(times)))
    return {"tilt": 0.0005 * noise[0], "wheel_angle": 0.002 * noise[1]}


def sampled(stamps, signals, fill=3, rows=None):
    """What the import makes of a log whose first row is in line 2 of its file; `rows` are its rows of numbers (n,)."""
    count = len(stamps)
    values = np.column_stack([stamps, *signals.values()])
    columns = Columns(values, np.arange(count) + 2, np.arange(count) if rows is None else rows, "line", ())
    return stretches(Path("log.csv"), {"time": np.asarray(stamps), **signals}, columns, fill)


def measured_rows(found):
    """How many rows of each part were measured, and not filled in."""
    return [len(part["time"]) - int(part.get(FILLED, np.zeros(1)).sum()) for part in found.parts]


def all_rows(found):
    """How many rows each part has, with those that were filled in."""
    return [len(part["time"]) for part in found.parts]
