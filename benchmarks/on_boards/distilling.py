"""What fewer basis functions cost: the policy itself, the small board, and the robot.

    python -m benchmarks.on_boards.distilling [robots=default] [basis=12,8,4] [trials=10]

Each robot is learned by `twbal iterate` (`default`, or the seed of a virtual robot), unless it was before; runs are in
outputs/bench/on_boards. Its best policy, whole and with fewer basis functions, is exported, compiled by avr-gcc, run in
simavr, and tried on the same robot for 10 s. Results are in benchmarks/results/on_boards.json. Needs avr-gcc, gcc,
libsimavr and libelf (Debian: gcc-avr avr-libc libsimavr-dev libelf-dev).
"""

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.hidden_robots.record import trial_record
from benchmarks.hidden_robots.robots import FAMILIES, Workshop, run
from benchmarks.on_boards.avr import taken
from twbal.core.files import write_atomically
from twbal.io.logs import read_episode

ROOT = Path("outputs/bench/on_boards")
RESULTS = Path("benchmarks/results/on_boards.json")
DEFAULTS = {"robots": "default", "basis": "12,8,4", "trials": "10"}
STEPS = 500
CLOCK = 16e6
BOARD = "ATmega32U4"


def learned(robot: str) -> Path:
    """The best policy of a robot."""
    seed = [] if robot == "default" else [f"link.seed={robot}", f"seed={robot}"]
    run("iterate", ROOT / robot, seed)
    return ROOT / robot / "best_policy.pt"


def judged(robot: str, policy: Path, basis: str, trials: str) -> dict[str, Any]:
    """A policy with so many basis functions, or whole: what it costs, takes and does."""
    folder = ROOT / f"{robot}_{basis}"
    smaller = [] if basis == "whole" else [f"distil={basis}"]
    run("export-policy", folder / "export", [f"policy.path={policy}", "states=100000", *smaller])
    made = policy if basis == "whole" else folder / "export" / "policy.pt"
    seed = [] if robot == "default" else [f"link.seed={robot}"]
    run("real-rollout", folder / "trials", [f"policy.path={made}", f"trials={trials}", f"steps={STEPS}", *seed])
    on_board = json.loads((folder / "export" / "on_board.json").read_text())
    found = taken(folder / "export" / "policy.h")
    rules = Workshop(FAMILIES["hard"]).rules
    logs = sorted((folder / "trials" / "episodes").glob("*.mcap"))
    records = [trial_record(read_episode(log), rules) for log in logs]
    return {
        "distillation": on_board["distillation"],
        "agreement": on_board["agreement"],
        "estimated": next(need for need in on_board["needs"] if need["board"] == BOARD),
        "measured": found._asdict(),
        "trials": len(records),
        "successes": sum(record["default"]["succeeded"] for record in records),
    }


def main(words: Sequence[str]) -> None:
    """Run with settings of the form key=value."""
    settings = {**DEFAULTS, **dict(word.split("=", 1) for word in words)}
    if unknown := sorted(set(settings) - set(DEFAULTS)):
        raise SystemExit(f"unknown settings: {', '.join(unknown)}. Settings are {', '.join(DEFAULTS)}.")
    results: dict[str, Any] = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    for robot in settings["robots"].split(","):
        policy = learned(robot)
        for basis in ("whole", *settings["basis"].split(",")):
            results.setdefault(robot, {})[basis] = judged(robot, policy, basis, settings["trials"])
            write_atomically(RESULTS, json.dumps(results, indent=1) + "\n")
            print(robot, basis, results[robot][basis], flush=True)


def distilled_policies(results: Mapping[str, Any]) -> list[str]:
    """One line a policy."""
    lines = [
        "| policy | basis functions | command off by (rms, most), of its limit | gain off by (rms), of its largest | "
        "flash, estimate | flash, by avr-gcc | cycles, estimate | cycles in simavr (mean, most) | trials that succeed"
        " |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    return lines + [_line(robot, found) for robot, cases in results.items() for found in cases.values()]


def _line(robot: str, found: Mapping[str, Any]) -> str:
    cost, need, measured = found["distillation"], found["estimated"], found["measured"]
    off = f"{100 * cost['rms_command']:.1f} %, {100 * cost['max_command']:.0f} %" if cost else "-"
    cells = [
        robot,
        str(cost["basis"]) if cost else "all",
        off,
        f"{100 * cost['rms_gain']:.1f} %" if cost else "-",
        f"{need['flash']:,} bytes",
        f"{measured['flash']:,} bytes",
        f"{need['cycles']:,}",
        f"{measured['cycles'][0]:,}, {measured['cycles'][1]:,} ({1e3 * measured['cycles'][0] / CLOCK:.1f} ms)",
        f"{found['successes']} of {found['trials']}",
    ]
    return f"| {' | '.join(cells)} |"


if __name__ == "__main__":
    main(sys.argv[1:])
