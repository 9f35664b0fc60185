"""`diagnosis.json`: how it is written, and what later commands read of it."""

from pathlib import Path
from typing import Any

from twbal.core.errors import DataError
from twbal.core.files import read_json
from twbal.core.json_records import encoded, write_record
from twbal.diagnosis.record import CHANCE, Diagnosis, Verdict

SCHEMA = 2
"""Of `diagnosis.json`. In schema 1, `effects` were the named ones only, and nothing said what remains."""


def as_record(diagnosis: Diagnosis) -> dict[str, Any]:
    """What is in a `diagnosis.json`."""
    head = diagnosis.headline
    names = (
        "before",
        "refitted",
        "after",
        "floor",
        "closed",
        "noise_floor",
        "closed_by_refit",
        "closed_by_effects",
        "excess",
        "interval_scale",
    )
    gap: dict[str, Any] = {name: getattr(head, name, None) for name in names}
    if head is not None:
        gap["metric"] = f"rms error of {head.channel} after {head.horizon:g} s"
    record: dict[str, Any] = encoded(diagnosis)
    gap |= {"held_out": record.pop("held_out"), "added": record.pop("added"), "all": record["gap"]}
    worst = {kind: max((getattr(w, kind) for w in diagnosis.whiteness), default=None) for kind in ("before", "after")}
    return {"schema": SCHEMA} | record | {"gap": gap, "whiteness": {**worst, "channels": record["whiteness"]}}


def write_diagnosis(path: Path, diagnosis: Diagnosis) -> None:
    """Write `diagnosis.json`."""
    write_record(path, as_record(diagnosis))


def verdict_in(path: Path) -> Verdict:
    """The verdict of a `diagnosis.json`."""
    return Verdict(read_json(path)["verdict"])


def suggested_in(path: Path) -> str:
    """The command of the suggested experiment in a `diagnosis.json`; "" where there is none."""
    return str((read_json(path).get("next_experiment") or {}).get("command", ""))


def repetition_tells_more(path: Path) -> bool:
    """Whether a `diagnosis.json` expects more of a repetition of what was recorded than of the suggested experiment."""
    suggested = read_json(path).get("next_experiment") or {}
    return float(suggested.get("repetition", 0.0)) > float(suggested.get("separation", 0.0))


def has_no_safe_experiment(path: Path) -> bool:
    """Whether a `diagnosis.json` says that none of the experiments that were weighed is safe."""
    return bool(read_json(path).get("no_safe_experiment", False))


def is_better_unchanged(path: Path) -> bool:
    """Whether a `diagnosis.json` says that the simulation as it was predicts held-out data better than what came of it.

    By more than `CHANCE`, as a data sheet may be refitted where nothing is missing.
    """
    gap = read_json(path).get("gap") or {}
    before, after = gap.get("before"), gap.get("after")
    return before is not None and after is not None and after > (1.0 + CHANCE) * before


def closed_share(path: Path) -> float:
    """Share of the gap on held-out data that what was found closes, by a `diagnosis.json`; 0 where there is no gap.

    Raises:
        DataError: the file cannot be read, or does not say so.
    """
    try:
        return float(read_json(path)["gap"]["closed"] or 0.0)
    except FileNotFoundError as error:
        raise DataError(f"There is no diagnosis {path}. Has `twbal diagnose` finished there?") from error
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise DataError(f"{path} is no diagnosis of this version: it says no share of the gap ({error}).") from error
