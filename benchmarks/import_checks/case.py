"""One robot: its log as it is, and with faults, imported; what was said."""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.import_checks.conventions import Written, written
from benchmarks.import_checks.faults import FAULTS
from benchmarks.import_checks.other_sensors import CONVENTIONS
from benchmarks.import_checks.robot import Ride, drawn
from twbal.core.channels import Channels
from twbal.core.episode import Provenance
from twbal.core.errors import LogError
from twbal.io.importers.checks.doubt import Doubt, DoubtKind
from twbal.io.importers.conversion import Imported, Wanted, import_file

_CHANNELS = ("tilt", "tilt_rate", "speed")
_MOST = 1e6  # for infinity, which is no number of a file


def log_of(seed: int) -> tuple[Ride, Written]:
    """The ride of a seed, in the convention of that seed."""
    ride = drawn(seed)
    return ride, written(ride, np.random.default_rng([seed, 1_000_000]))


def import_of(log: Written, ride: Ride) -> Imported:
    """What the import makes of a log.

    Raises:
        LogError: it refuses the log.
    """
    sheet = ride.build.sheet
    channels = Channels(_CHANNELS, sheet.wheel_radius)
    wanted = Wanted(lambda period: channels, None, 50, sheet)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        log.write(path)
        return import_file(path, log.mapping, wanted, Provenance("drawn", "robot"))


def doubts_of(log: Written, ride: Ride) -> tuple[list[Doubt], list[str]]:
    """What the import doubts of a log, and what it cannot tell; an error that refuses it is a doubt about time."""
    try:
        imported = import_of(log, ride)
    except LogError as error:
        return [Doubt(DoubtKind.TIME, "time", str(error))], []
    return list(imported.doubts), list(imported.untold)


def correct(seed: int) -> dict[str, Any]:
    """What is said of a log that is right."""
    ride, log = log_of(seed)
    doubts, untold = doubts_of(log, ride)
    said = [f"{doubt.kind}: {doubt.sentence}" for doubt in doubts]
    build = ride.build
    robot = {"height": build.true.com_height, "period": build.true.control_period, "driving": build.driving}
    return {"seed": seed, **robot, "has": sorted(log.quantities), "said": said, "untold": untold}


def convention(seed: int, name: str) -> dict[str, Any] | None:
    """What is said of a right log that lacks something, and how far off its import is; None of one without that."""
    ride, log = log_of(seed)
    odd = CONVENTIONS[name](ride, log, np.random.default_rng([seed, 4_000_000]))
    if odd is None:
        return None
    found = {"seed": seed, "convention": name}
    try:
        imported = import_of(odd.log, ride)
    except LogError as error:
        return {**found, "off": None, "said": [str(error)], "untold": []}
    said = [f"{doubt.kind}: {doubt.sentence}" for doubt in imported.doubts]
    return {**found, "off": min(odd.off(imported), _MOST), "said": said, "untold": list(imported.untold)}


def planted(seed: int, name: str) -> dict[str, Any] | None:
    """What is said of a log with a fault; None where this log cannot have it."""
    ride, log = log_of(seed)
    fault = FAULTS[name]
    made = fault.plant(log, np.random.default_rng([seed, 2_000_000]))
    if made is None:
        return None
    found, untold = doubts_of(made.log, ride)
    named = any(doubt.kind in fault.kinds for doubt in found)
    said = [f"{doubt.kind}: {doubt.sentence}" for doubt in found]
    told = {"found": bool(said), "named": named, "said": said, "untold": untold}
    return {"seed": seed, "fault": name, "what": made.what, **told}
