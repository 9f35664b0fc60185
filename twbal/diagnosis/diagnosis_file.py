"""`diagnosis.json`: how it is written, and what later commands read of it."""

from pathlib import Path
from typing import Any, NamedTuple

from twbal.core.errors import DataError
from twbal.core.files import read_json
from twbal.core.json_records import encoded, write_record
from twbal.diagnosis.record import CHANCE, Diagnosis, Verdict

SCHEMA = 2
"""Of `diagnosis.json`. In schema 1, `effects` were the named ones only, and nothing said what remains."""

_KEYS = {"autocorrelation": "whiteness"}
"""Fields that have another name in `diagnosis.json`, which is that of schema 2."""


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
        "parameter_floor",
        "interval_scale",
    )
    gap: dict[str, Any] = {name: getattr(head, name, None) for name in names}
    if head is not None:
        gap["metric"] = f"rms error of {head.channel} after {head.horizon:g} s"
    record = _with_keys(encoded(diagnosis))
    record["rivals"] = [_with_keys(rival) for rival in record["rivals"]]
    gap |= {"held_out": record.pop("held_out"), "added": record.pop("added"), "all": record["gap"]}
    found = diagnosis.autocorrelation
    worst = {kind: max((getattr(each, kind) for each in found), default=None) for kind in ("before", "after")}
    return {"schema": SCHEMA} | record | {"gap": gap, "whiteness": {**worst, "channels": record["whiteness"]}}


def _with_keys(record: dict[str, Any]) -> dict[str, Any]:
    return {_KEYS.get(name, name): value for name, value in record.items()}


def write_diagnosis(path: Path, diagnosis: Diagnosis) -> None:
    """Write `diagnosis.json`."""
    write_record(path, as_record(diagnosis))


class Concluded(NamedTuple):
    """What a `diagnosis.json` says of what comes next.

    Attributes:
        is_open: whether its verdict is.
        suggested: command of the suggested experiment; "" where there is none.
        repetition_tells_more: whether more is expected of a repetition of what was recorded than of that experiment.
        has_no_safe_experiment: whether none of the experiments that were weighed is safe.
        is_better_unchanged: whether the simulation as it was predicts held-out data better than what came of it, by
            more than `CHANCE`, as a data sheet may be refitted where nothing is missing.
    """

    is_open: bool
    suggested: str
    repetition_tells_more: bool
    has_no_safe_experiment: bool
    is_better_unchanged: bool


def concluded(path: Path) -> Concluded:
    """What a `diagnosis.json` says of what comes next."""
    record = read_json(path)
    suggested, gap = record.get("next_experiment") or {}, record.get("gap") or {}
    before, after = gap.get("before"), gap.get("after")
    return Concluded(
        is_open=Verdict(record["verdict"]).is_open,
        suggested=str(suggested.get("command", "")),
        repetition_tells_more=float(suggested.get("repetition", 0.0)) > float(suggested.get("separation", 0.0)),
        has_no_safe_experiment=bool(record.get("no_safe_experiment", False)),
        is_better_unchanged=before is not None and after is not None and after > (1.0 + CHANCE) * before,
    )


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
