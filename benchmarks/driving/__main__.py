"""Drive hidden robots by the policies that `python -m benchmarks.hidden_robots` learned for standing.

    python -m benchmarks.driving [family=moderate] [robots=10] [policies=outputs/bench/hidden_robots]

Of each family (all, unless one is named) the first `robots` that are learned are driven through all tasks of
`tasks.py`, in this process, and judged by their true poses alone. Nothing is learned. A robot is not driven again by
the same policy through the same tasks. Raw results, with the hash of each policy's file, go to
benchmarks/results/driving.json after each robot. What is not learned yet is left out: run it again later.
"""

import json
import shlex
import sys
from collections.abc import Sequence
from functools import cache
from itertools import zip_longest
from pathlib import Path
from typing import Any

from benchmarks.driving.driven import Driver, digest
from benchmarks.hidden_robots.families import FAMILIES
from benchmarks.settings import text_settings
from twbal.core.files import write_atomically

DONE = Path("outputs/bench/driving")
RESULTS = Path("benchmarks/results/driving.json")
DEFAULTS = {"family": "", "robots": "10", "policies": "outputs/bench/hidden_robots"}


def learned(policies: Path, family: str, robots: int) -> list[int]:
    """Seeds of those of the first robots of a family that are learned."""
    seeds = sorted(int(path.name.removeprefix("robot_")) for path in (policies / family / "default").glob("robot_*"))
    return [seed for seed in seeds[:robots] if (_folder(policies, family, seed) / "result.json").exists()]


def _folder(policies: Path, family: str, seed: int) -> Path:
    return policies / family / "default" / f"robot_{seed}"


@cache
def _driver(family: str) -> Driver:
    return Driver(FAMILIES[family])


def driven(family: str, seed: int, policies: Path) -> dict[str, Any]:
    """What a robot did, from its file where that is of the same policy and tasks."""
    file, policy = DONE / family / f"robot_{seed}.json", _folder(policies, family, seed) / "best_policy.pt"
    same = {"policy": digest(policy), "asked": _driver(family).asked}
    known: dict[str, Any] = json.loads(file.read_text()) if file.exists() else {}
    if {name: known.get(name) for name in same} == same:
        return known
    found = _driver(family).drive(seed, policy)
    write_atomically(file, json.dumps(found, indent=1) + "\n")
    return found


def main(words: Sequence[str]) -> None:
    """Run with settings of the form key=value."""
    usage = (
        f"Settings are family (one of {', '.join(FAMILIES)}), robots (a number) and policies (a folder); "
        f"found {shlex.join(words)}."
    )
    settings = text_settings(DEFAULTS, words, usage)
    families = (settings["family"],) if settings["family"] else tuple(FAMILIES)
    if not set(families) <= set(FAMILIES) or not settings["robots"].isdecimal():
        raise SystemExit(usage)
    policies, robots = Path(settings["policies"]), int(settings["robots"])
    chosen = {family: learned(policies, family, robots) for family in families}
    if not any(chosen.values()):
        raise SystemExit(f"No robot is learned in {policies}; run `python -m benchmarks.hidden_robots` first.")
    results: dict[str, Any] = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    found: dict[str, list[Any]] = {family: [] for family in chosen}
    for seeds in zip_longest(*chosen.values()):  # a robot of each family in turn
        for family, seed in zip(chosen, seeds, strict=True):
            if seed is None:
                continue
            found[family].append(driven(family, seed, policies))
            results[family] = found[family]
            ordered = {name: results[name] for name in FAMILIES if name in results}
            write_atomically(RESULTS, json.dumps(ordered, indent=1) + "\n")
            did = sum(task["passed"] for task in found[family][-1]["tasks"])
            print(f"{family} {seed}: {did} of {len(found[family][-1]['tasks'])} tasks", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
