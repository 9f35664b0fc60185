"""Run the benchmark: `python -m benchmarks.methods [robots=10] [first_seed=7000] [workers=2] [collect=true]`.

Every method of conf/groups/method.yaml learns the same hidden robots, which the textbook regulator of the data sheet
drops, with at most 6 updates; those that search nothing with three seeds each. What is done already in
outputs/bench/methods is not done again; with collect=true nothing is, and what is there is put together. `twbal
compare` reads that folder, too; raw results go to benchmarks/results/methods.json.
"""

import json
import platform
import subprocess
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import islice
from pathlib import Path
from typing import Any

from omegaconf import OmegaConf

from benchmarks.hidden_robots.lqr_baseline import dropped_by_the_data_sheet
from benchmarks.hidden_robots.robots import iterate
from benchmarks.settings import text_settings
from twbal.algorithm.comparison import METRICS, Run, estimate, paired, run_values
from twbal.algorithm.summary import read_summary
from twbal.cli.conf_folder import conf_folder

ROOT = Path("outputs/bench/methods")
METHODS = OmegaConf.load(conf_folder() / "groups" / "method.yaml")
RESULTS = Path("benchmarks/results/methods.json")
DEFAULTS = {"robots": "10", "first_seed": "7000", "workers": "2", "collect": "false"}
MAIN = "twbal"  # what the others are compared with
UPDATES = 6
FAST = ("lqr", "lqr_identified", "agent")  # nothing is searched: three seeds each
SEEDS = 3
LOCK = threading.Lock()


def methods() -> list[str]:
    """All methods, the main one first."""
    names = sorted(map(str, METHODS))
    return [MAIN, *(name for name in names if name != MAIN)]


def jobs(robots: Sequence[int]) -> list[tuple[str, int, int]]:
    """Method, robot and seed of every run; all robots before a second seed."""
    return [
        (method, robot, seed)
        for seed in range(SEEDS)
        for robot in robots
        for method in methods()
        if seed == 0 or method in FAST
    ]


def learn(job: tuple[str, int, int]) -> None:
    """One run."""
    method, robot, seed = job
    folder = ROOT / method / f"robot_{robot}_seed_{seed}"
    words = [f"method={method}", f"link.seed={robot}", f"seed={seed}", "calibration_rollouts=0"]
    if method == "agent":  # knows nothing of the robot: trained once for each seed
        words.append(f"trained_agent={trained(seed)}")
    if METHODS[method].get("updates") != 0:
        words.append(f"updates={UPDATES}")
    began = time.monotonic()
    found: Any = iterate(folder, words)["iterations"]
    successes = [i["successes"] for i in found]
    print(f"{method}, robot {robot}, seed {seed}: {successes} by update, {time.monotonic() - began:.0f} s", flush=True)


def trained(seed: int) -> Path:
    """Folder of an agent that is trained, or was before."""
    folder = (ROOT / "agents" / f"seed_{seed}").absolute()
    with LOCK:
        command = [sys.executable, "-m", "twbal", "train-agent", f"seed={seed}", f"hydra.run.dir={folder}"]
        subprocess.run(command, stdout=subprocess.DEVNULL, check=True)
    return folder


def runs_of(method: str) -> list[Run]:
    """All runs of a method that are done."""
    files = sorted((ROOT / method).glob("*/summary.json"))
    return [Run(tuple(file.parent.name.split("_")), run_values(read_summary(file))) for file in files]


def table(groups: Mapping[str, Sequence[Run]]) -> list[dict[str, Any]]:
    """One record a method: how many robots were solved, every metric with its interval, and against the main method."""
    found = []
    for name, runs in groups.items():
        solved = sum(run.values["success"] == 1.0 for run in runs)
        record: dict[str, Any] = {"method": name, "runs": len(runs), "solved": solved}
        for metric in METRICS:
            interval = estimate([run.values[metric] for run in runs])
            beside = paired(runs, groups[MAIN], metric)
            record[metric] = None if interval is None else interval.words
            record[f"{metric}_p"] = beside._asdict()
        found.append(record)
    return found


def main(words: Sequence[str]) -> None:
    """Run with settings of the form key=value."""
    settings = text_settings(DEFAULTS, words)
    count, first, workers = (int(settings[name]) for name in ("robots", "first_seed", "workers"))
    robots = list(islice(dropped_by_the_data_sheet(first), count))
    if settings["collect"] != "true":
        with ThreadPoolExecutor(workers) as pool:
            list(pool.map(learn, jobs(robots)))
    groups = {method: runs_of(method) for method in methods()}
    results = {
        "robots": robots,
        "updates": UPDATES,
        "work_s": round(sum(read_summary(file).wall_s for file in ROOT.glob("*/*/summary.json"))),
        "machine": f"{platform.machine()}, {workers} runs at a time",
        "methods": table(groups),
        "runs": {name: {" ".join(run.key): dict(run.values) for run in runs} for name, runs in groups.items()},
    }
    RESULTS.write_text(json.dumps(results, indent=1) + "\n")
    print(f"{RESULTS} written")


if __name__ == "__main__":
    main(sys.argv[1:])
