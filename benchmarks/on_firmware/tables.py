"""The table of Algorithm 1 over the firmware, from results/on_firmware.json."""

from collections.abc import Mapping
from typing import Any

_COLUMNS = {
    "virtual": "virtual robot",
    "host": "firmware, policy on the host",
    "on_board": "firmware, policy on board",
}


def on_firmware(results: Mapping[str, Any]) -> list[str]:
    """One line a robot: updates in each way, successes by update, and what is the same as over the virtual robot."""
    names = ["robot", *_COLUMNS.values(), "same artefacts (host)", "same policies (board)", "sets of rollouts on board"]
    lines = [f"| {' | '.join(names)} |", "|---" * len(names) + "|"]
    for robot, ways in results.items():
        cells = [_updates(ways[way]["iterations"]) if way in ways else "not run" for way in _COLUMNS]
        cells += [_share(ways, "host", "artefacts"), _share(ways, "on_board", "policies")]
        cells.append(str(len(ways["on_board"]["on_board"])) if "on_board" in ways else "-")
        lines.append(f"| {robot.replace('_', ' ')} | {' | '.join(cells)} |")
    return lines


def updates(iterations: list[Mapping[str, Any]]) -> int | None:
    """Updates after which all ten trials succeed for the first time; None where they never do."""
    return next((each["index"] for each in iterations if each["successes"] == 10), None)


def _updates(iterations: list[Mapping[str, Any]]) -> str:
    found = updates(iterations)
    successes = ", ".join(str(each["successes"]) for each in iterations)
    return f"{'never' if found is None else found} ({successes})"


def _share(ways: Mapping[str, Any], way: str, kind: str) -> str:
    if way not in ways:
        return "-"
    same, count = ways[way]["same"][kind]
    return f"{same} of {count}"
