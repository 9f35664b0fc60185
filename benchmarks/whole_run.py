"""`python -m benchmarks.whole_run [code=.] [repeats=3]`: how long `twbal iterate` takes, and its stages.

`code` is a list of folders of versions of twbal, separated by commas; they run in turn, so that a machine that gets
slower in the meantime is slower for all. The first run of each version compiles and is not counted. Results go to
benchmarks/results/whole_run.json.
"""

import hashlib
import json
import os
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks.measure import RESULTS, machine, version_of
from benchmarks.settings import number_settings

_NAMES = {
    "optimise-policy": "searches",
    "fit-diff-gp": "fits of g",
    "fit-sim-gp": "fits of f",
    "identify": "parameters from rollouts",
    "sim-collect": "rollouts in simulation",
    "real-rollout": "trials and rollouts of the robot",
}


def once(code: Path) -> dict[str, Any]:
    """Times of one run: by the clock, of all its processes on all cores, and by the clock of each kind of stage [s]."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "twbal", "iterate", f"hydra.run.dir={folder}/run"]
        began, before = time.monotonic(), os.times()
        surroundings = {**os.environ, "PYTHONPATH": str(code)}
        subprocess.run(command, check=True, capture_output=True, cwd=code, env=surroundings)
        wall_s, after = time.monotonic() - began, os.times()
        stages: dict[str, float] = defaultdict(float)
        for file in Path(folder, "run").rglob("*/manifest.json"):
            manifest = json.loads(file.read_text())
            stages[manifest["stage"]] += manifest["wall_s"]
        summary = json.loads(Path(folder, "run", "summary.json").read_text())
        policy = hashlib.sha256(Path(folder, "run", "best_policy.pt").read_bytes()).hexdigest()[:12]
    cpu_s = after.children_user + after.children_system - before.children_user - before.children_system
    successes = [iteration["successes"] for iteration in summary["iterations"]]
    return {"wall_s": wall_s, "cpu_s": cpu_s, "stages": dict(stages), "policy": policy, "successes": successes}


def whole_run(results: Mapping[str, Any]) -> list[str]:
    """Table of the medians: one line a kind of stage, one column a version."""
    versions = results["versions"]
    lines = ["| seconds | " + " | ".join(each["version"] for each in versions) + " |", "|---|" + "---|" * len(versions)]

    def line(name: str, figures: Sequence[float]) -> str:
        return f"| {name} | " + " | ".join(f"{figure:.1f}" for figure in figures) + " |"

    for stage, name in _NAMES.items():
        lines.append(line(name, [median(run["stages"][stage] for run in each["runs"]) for each in versions]))
    lines.append(line("**by the clock**", [median(run["wall_s"] for run in each["runs"]) for each in versions]))
    lines.append(line("CPU, all processes", [median(run["cpu_s"] for run in each["runs"]) for each in versions]))
    policies = [" and ".join(sorted({run["policy"] for run in each["runs"]})) for each in versions]
    lines.append("| SHA-256 of the best policy | " + " | ".join(policies) + " |")
    return [*lines, "", f"{results['machine']}, {results['cores']} cores, {results['date']}."]


def main(words: Sequence[str]) -> None:
    """Measure, and write the results after each round."""
    given = [word.removeprefix("code=") for word in words if word.startswith("code=")] or ["."]
    codes = [Path(text).resolve() for text in given[-1].split(",")]
    repeats = number_settings({"repeats": 3}, [word for word in words if not word.startswith("code=")])["repeats"]
    found: list[dict[str, Any]] = [{"version": version_of(code), "runs": []} for code in codes]
    for round_number in range(repeats + 1):
        for code, version in zip(codes, found, strict=True):
            run = once(code)
            print(version["version"], json.dumps(run), flush=True)
            if round_number:
                version["runs"].append(run)
        here = {"machine": machine(), "cores": os.cpu_count(), "date": str(date.today())}
        if round_number:
            (RESULTS / "whole_run.json").write_text(json.dumps({**here, "versions": found}, indent=1) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
