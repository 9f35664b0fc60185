"""What trials of the same kind came to, together."""

from collections import Counter
from collections.abc import Collection, Sequence
from statistics import median
from typing import Any


def counts(trials: Sequence[dict[str, Any]], names: Collection[str]) -> list[dict[str, Any]]:
    """A record a kind, in the order of `names`."""
    by_kind = {name: [trial for trial in trials if trial["kind"] == name] for name in names}
    return [_counted(name, found) for name, found in by_kind.items() if found]


def _counted(name: str, trials: Sequence[dict[str, Any]]) -> dict[str, Any]:
    ended = [trial for trial in trials if trial["code"]]
    off = [trial["off_ms"] for trial in ended if trial["off_ms"] is not None]
    return {
        "kind": name,
        "trials": len(trials),
        "ridden": len(trials) - len(ended),
        "off_ms": [round(median(off), 1), round(max(off), 1)] if off else [],
        "late": sum(trial.get("late", 0) for trial in trials),
        "late_trials": sum(trial.get("late", 0) > 0 for trial in trials),
        "spoilt": round(median(trial["spoilt"] for trial in trials), 1),
        "errors": dict(Counter(_reason(trial["error"]) for trial in ended).most_common()),
        "misses": [f"trial {trial['trial']}: {miss}"[:160] for trial in trials for miss in trial["misses"]],
    }


REASONS = {
    "its watchdog": "watchdog",
    "THEY MAY STILL BE ON": "Stop not confirmed",
    "no handshake": "robot started anew",
    "does not run forward": "clock",
    "not finite numbers": "no number",
    "a sensor that": "sensor",
    "is gone": "port gone",
    "the same": "sensor frozen",
    "No answer to Hello": "no greeting",
    "No answer to Arm": "not armed",
    "No answer to Command": "robot silent",
}
"""What an error says, and what that is called in tables."""


def _reason(error: str) -> str:
    """The first thing that went wrong, as errors tell it in order."""
    places = {called: error.find(said) for said, called in REASONS.items() if said in error}
    return min(places, key=lambda called: places[called]) if places else ("killed" if not error else "other")
