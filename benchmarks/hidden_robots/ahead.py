"""Could PILCO be ahead of the default method? `python -m benchmarks.hidden_robots.ahead [seeds=1-3] [workers=1]`.

The default learns each robot of the published tables with several seeds of the learner, until it solves the robot.
PILCO has no simulation, so before its policy 0 it drives at random. It could be ahead of the default by more than one
update, or by more than 3 s of driving, on robots only on which the default needs more than one update or more than 3 s,
in the tables or by the median of these seeds. On these robots PILCO learns its policy 0 with as many seeds, which takes
five random rollouts and ten trials. A policy of a later update is not faster by 3 s: until then PILCO has driven its
policy 0 as well, for as long as it lasts in the trials, or for 2 s.

Raw results go to benchmarks/results/pilco_ahead.json, robot by robot; robots that are there are not learned again.
"""

import json
import sys
import threading
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from math import inf
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

from benchmarks.hidden_robots.robots import iterate, learn_words
from benchmarks.settings import text_settings
from twbal.core.files import write_atomically

ROOT, RESULTS = Path("outputs/bench/pilco_ahead"), Path("benchmarks/results")
FILE = RESULTS / "pilco_ahead.json"
FAMILIES = ("hard", "moderate", "regbot", "balboa", "esp32")
DEFAULTS = {"seeds": "1-3", "workers": "1"}
UPDATES, SECONDS = 1, 3.0
"""By more of which PILCO must not be ahead."""
_WITHIN = (0, 1, 3, 6)  # updates
_ROLLOUT = 2.0  # s; rollouts of an update may be cut where trials go on


class Learned(NamedTuple):
    """What the default method needed on a robot.

    Attributes:
        family: of the robot.
        robot: its seed.
        updates: up to the first policy all of whose trials succeed.
        seconds: of driving up to it.
    """

    family: str
    robot: int
    updates: float
    seconds: float

    @property
    def may_be_behind(self) -> bool:
        """Whether any method could be ahead by so much."""
        return self.updates > UPDATES or self.seconds > SECONDS


def by_default() -> list[Learned]:
    """What the default method needed on all robots of the tables that it solved."""
    found = []
    for family in FAMILIES:
        for robot in json.loads((RESULTS / f"hidden_robots_{family}.json").read_text())["robots"]:
            solved = next(step for step in robot["iterations"] if step["successes"] == len(step["trials"]))
            found.append(Learned(family, robot["seed"], solved["index"], solved["real_seconds"]))
    return found


def iterations(robot: Learned, name: str, seed: int, words: Sequence[str]) -> Sequence[Mapping[str, Any]]:
    """What a method did on a robot up to the policy that solved it, and no more."""
    words = [*learn_words(robot.family, robot.robot), *words, "improve=false", "calibration_rollouts=0", f"seed={seed}"]
    found: Sequence[Mapping[str, Any]] = iterate(ROOT / f"{robot.family}_{robot.robot}_{name}{seed}", words)[
        "iterations"
    ]
    return found


def learn_by_default(robot: Learned, seed: int) -> dict[str, Any]:
    """What the default needs on a robot; no updates and seconds where it does not solve it."""
    steps = iterations(robot, "default_", seed, ["updates=6"])
    solved = next((step for step in steps if step["successes"] == step["trials"]), None)
    if solved is None:
        return {"seed": seed, "updates": None, "seconds": None}
    return {"seed": seed, "updates": solved["index"], "seconds": solved["real_seconds"]}


def learn(robot: Learned, seed: int) -> dict[str, Any]:
    """PILCO's policy 0 on a robot."""
    (first,) = iterations(robot, "", seed, ["method=pilco", "updates=0"])
    lasted = first["trial_seconds"] / first["trials"]
    return {"seed": seed, "seconds": first["real_seconds"], "successes": first["successes"], "trial_seconds": lasted}


def record(robot: Learned, seeds: Sequence[int]) -> dict[str, Any]:
    """What the default needed on a robot, and PILCO where it may be ahead by more."""
    found = {**robot._asdict(), "default": [learn_by_default(robot, seed) for seed in seeds]}
    usual = robot._replace(**default_medians(found)._asdict())
    if robot.may_be_behind or usual.may_be_behind:
        found["pilco"] = [learn(robot, seed) for seed in seeds]
    return found


class Needed(NamedTuple):
    """Medians over seeds: updates, and seconds of driving; infinite where the robot was not solved."""

    updates: float
    seconds: float


def default_medians(robot: Mapping[str, Any]) -> Needed:
    """What the default needed on a robot, by a record."""
    return Needed(
        *(median(inf if run[what] is None else run[what] for run in robot["default"]) for what in Needed._fields)
    )


def default_seeds(results: Mapping[str, Any]) -> list[str]:
    """One line a family: within how many updates the default solves its robots, over all seeds of the learner."""
    names = ("robots", "runs", *(f"within {n}" for n in _WITHIN), "driven to learn, median / worst")
    lines = [f"| family | {' | '.join(names)} |", "|" + "---|" * (len(names) + 1)]
    for family in (*FAMILIES, "all"):
        robots = [robot for robot in results["robots"] if family in (robot["family"], "all")]
        if robots:
            runs = [run for robot in robots for run in robot["default"]]
            updates, seconds = ([inf if run[what] is None else run[what] for run in runs] for what in Needed._fields)
            within = [f"{sum(each <= n for each in updates)} of {len(runs)}" for n in _WITHIN]
            cells = (len(robots), len(runs), *within, f"{_seconds(median(seconds))} / {_seconds(max(seconds))}")
            lines.append(f"| {family} | {' | '.join(map(str, cells))} |")
    return lines


def _seconds(seconds: float) -> str:
    return "never" if seconds == inf else f"{seconds:.1f} s"


def pilco_ahead(results: Mapping[str, Any]) -> list[str]:
    """One line a robot on which the default needs more than one update or 3 s."""
    lines = [
        "| robot | default in the tables: updates, driven | default, medians "
        "| PILCO, medians: driven before policy 0 | its trials that succeed "
        "| driven before policy 1, at least | ahead by more | by half the driving |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for robot in results["robots"]:
        if "pilco" not in robot:
            continue
        runs = robot["pilco"]
        seconds, won = median(run["seconds"] for run in runs), median(run["successes"] for run in runs)
        later = median(run["seconds"] + min(run["trial_seconds"], _ROLLOUT) for run in runs)
        updates, driven = default_medians(robot)
        is_far = updates > UPDATES or driven - seconds > SECONDS
        is_ahead = (won == 10 and is_far) or updates - 1 > UPDATES or driven - later > SECONDS
        least = seconds if won == 10 else later
        cells = [f"`{robot['family']}` {robot['robot']}", f"{robot['updates']}, {robot['seconds']:.1f} s"]
        cells += [f"{updates:.0f}, {driven:.1f} s", f"{seconds:.1f} s", f"{won:.0f} of 10", f"{later:.1f} s"]
        cells += ["yes" if each else "no" for each in (is_ahead, least < 0.5 * driven)]
        lines.append(f"| {' | '.join(cells)} |")
    return lines


def main(words: Sequence[str]) -> None:
    """Learn, write and print."""
    settings = text_settings(DEFAULTS, words, __doc__ or "")
    first, _, last = settings["seeds"].partition("-")
    seeds = range(int(first), int(last or first) + 1)
    known = by_default()
    order = {(robot.family, robot.robot): number for number, robot in enumerate(known)}
    done = json.loads(FILE.read_text())["robots"] if FILE.exists() else []
    lock, there = threading.Lock(), {(robot["family"], robot["robot"]) for robot in done}

    def learned(robot: Learned) -> None:
        found = record(robot, seeds)
        with lock:
            done.append(found)
            done.sort(key=lambda each: order[each["family"], each["robot"]])
            write_atomically(FILE, written(done, len(known)))

    with ThreadPoolExecutor(int(settings["workers"])) as pool:
        list(pool.map(learned, [robot for robot in known if (robot.family, robot.robot) not in there]))
    print("\n".join(pilco_ahead(json.loads(FILE.read_text()))))


def written(robots: Sequence[Mapping[str, Any]], compared: int) -> str:
    """As JSON with one robot a line."""
    text = ",\n".join(json.dumps(each) for each in robots)
    return f'{{"compared": {compared}, "robots": [\n{text}\n]}}\n'


if __name__ == "__main__":
    main(sys.argv[1:])
