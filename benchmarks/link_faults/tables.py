"""Tables of faults of the link, from the results of this benchmark."""

from collections.abc import Mapping, Sequence
from typing import Any

_COLUMNS = {
    "virtual lockstep": "virtual robot, lockstep",
    "firmware lockstep": "firmware, lockstep",
    "virtual real_time": "virtual robot, real time",
    "firmware real_time": "firmware, real time",
}


def link_faults(results: Mapping[str, Sequence[Any]]) -> list[str]:
    """One line a kind of fault: how many rollouts went on or ended, and when the motors were off at the latest."""
    columns = {name: {found["kind"]: found for found in results[name]} for name in _COLUMNS if name in results}
    order = list(dict.fromkeys(kind for found in columns.values() for kind in found))
    lines = [
        f"| fault | {' | '.join(_COLUMNS[name] for name in columns)} |",
        "|---" * (1 + len(columns)) + "|",
    ]
    return lines + [
        f"| {kind} | {' | '.join(_cell(found.get(kind)) for found in columns.values())} |" for kind in order
    ]


def link_fault_misses(results: Mapping[str, Sequence[Any]]) -> list[str]:
    """One line for each trial that was not right, and how many there were."""
    trials = sum(found["trials"] for kinds in results.values() for found in kinds)
    missed = [
        f"| {_COLUMNS[name]} | {found['kind']} | {miss} |"
        for name, kinds in results.items()
        for found in kinds
        for miss in found["misses"]
    ]
    if not missed:
        return [f"All {trials:,} trials were right."]
    return [
        f"{len(missed)} of {trials:,} trials were not right:",
        "",
        "| robot | fault | what |",
        "|---|---|---|",
        *missed,
    ]


def _cell(found: Mapping[str, Any] | None) -> str:
    """Such as `goes on 7, ends 3: 98 ms`."""
    if found is None:
        return "not run"
    ended = found["trials"] - found["ridden"]
    said = [f"goes on {found['ridden']}"] if found["ridden"] else []
    if ended:
        off = f": {found['off_ms'][1]:.0f} ms" if found["off_ms"] else ""
        said.append(f"ends {ended}{off}")
    return ", ".join(said)
