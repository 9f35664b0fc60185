"""What fewer basis functions cost: the policy itself, the small board, and the robot.

    python -m benchmarks.on_boards.distilling [policies=default,rolling] [basis=12,8,4] [trials=10]

`default` is the best policy of `twbal iterate` for the default robot, which is learned into outputs/bench/on_boards
unless it is there; `rolling` is data/regression/policy.pt, which does not hold its place. Each, whole and with fewer
basis functions (where it has more), is exported, compiled by avr-gcc, run in simavr, and tried on a virtual robot for
10 s. Results are in benchmarks/results/on_boards.json. Needs avr-gcc, gcc, libsimavr and libelf (Debian: gcc-avr
avr-libc libsimavr-dev libelf-dev).
"""

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.hidden_robots.families import FAMILIES
from benchmarks.hidden_robots.record import trial_record
from benchmarks.hidden_robots.robots import Workshop, run
from benchmarks.on_boards.avr import taken
from benchmarks.settings import text_settings
from twbal.core.files import write_atomically
from twbal.io.logs import read_episode
from twbal.policies.saved import load_policy

ROOT = Path("outputs/bench/on_boards")
RESULTS = Path("benchmarks/results/on_boards.json")
DEFAULTS = {"policies": "default,rolling", "basis": "12,8,4", "trials": "10"}
ROLLING = Path("data/regression/policy.pt")
STATE = {"default": (), "rolling": ("state=rolling",)}
ROBOT = {"default": (), "rolling": ("link.seed=4", 'link.overrides=["faults=light"]')}
"""Settings that choose the state that a policy reads, and the robot that it is tried on."""
STEPS = 500
CLOCK = 16e6
BOARD = "ATmega32U4"


def whole(name: str) -> Path:
    """The policy of this name, learned where it has to be."""
    if name == "rolling":
        return ROLLING
    policy = ROOT / name / "best_policy.pt"
    if not policy.exists():
        run("iterate", ROOT / name, [])
    return policy


def judged(name: str, policy: Path, basis: str, trials: str) -> dict[str, Any]:
    """A policy with so many basis functions, or whole: what it costs, takes and does."""
    folder = ROOT / f"{name}_{basis}"
    smaller = [] if basis == "whole" else [f"distil={basis}"]
    run("export-policy", folder / "export", [f"policy.path={policy}", "states=100000", *STATE[name], *smaller])
    made = policy if basis == "whole" else folder / "export" / "policy.pt"
    words = [f"policy.path={made}", f"trials={trials}", f"steps={STEPS}", *STATE[name], *ROBOT[name]]
    run("real-rollout", folder / "trials", words)
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
        "upright": sum(record["default"]["upright"] for record in records),
        "successes": sum(record["default"]["succeeded"] for record in records),
    }


def main(words: Sequence[str]) -> None:
    """Run with settings of the form key=value."""
    settings = text_settings(DEFAULTS, words)
    results: dict[str, Any] = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    for name in settings["policies"].split(","):
        policy = whole(name)
        count = int(np.count_nonzero(getattr(load_policy(policy), "weights", ())))
        fewer = [basis for basis in settings["basis"].split(",") if int(basis) < count]
        for basis in ("whole", *fewer):
            found = {
                "basis": count if basis == "whole" else int(basis),
                **judged(name, policy, basis, settings["trials"]),
            }
            results.setdefault(name, {})[basis] = found
            write_atomically(RESULTS, json.dumps(results, indent=1) + "\n")
            print(name, basis, found, flush=True)


def distilled_policies(results: Mapping[str, Any]) -> list[str]:
    """One line a policy."""
    lines = [
        "| policy | basis functions | command off by (rms, most), of its limit | gain off by (rms), of its largest | "
        "flash, estimate | flash, by avr-gcc | cycles, estimate | cycles in simavr (mean, most) "
        "| trials upright | that succeed |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    return lines + [_line(robot, found) for robot, cases in results.items() for found in cases.values()]


def _line(robot: str, found: Mapping[str, Any]) -> str:
    cost, need, measured = found["distillation"], found["estimated"], found["measured"]
    off = f"{100 * cost['rms_command']:.1f} %, {100 * cost['max_command']:.0f} %" if cost else "-"
    cells = [
        robot,
        f"{found['basis']}" if cost else f"all {found['basis']}",
        off,
        f"{100 * cost['rms_gain']:.1f} %" if cost else "-",
        f"{need['flash']:,} bytes",
        f"{measured['flash']:,} bytes",
        f"{need['cycles']:,}",
        f"{measured['cycles'][0]:,}, {measured['cycles'][1]:,} ({1e3 * measured['cycles'][0] / CLOCK:.1f} ms)",
        f"{found['upright']} of {found['trials']}",
        f"{found['successes']} of {found['trials']}",
    ]
    return f"| {' | '.join(cells)} |"


if __name__ == "__main__":
    main(sys.argv[1:])
