"""What the disk says of a run, and whether its report and its printed summary say that and nothing else.

Everything is read from the manifests and the episodes alone, not from the summary.
"""

import math
import re
from dataclasses import replace
from html.parser import HTMLParser
from itertools import pairwise, takewhile
from pathlib import Path
from typing import NamedTuple

import yaml

from twbal.algorithm.summary import Summary
from twbal.cli.manifest import read_manifest
from twbal.core.files import file_hash
from twbal.io.logs import read_episodes


class Iteration(NamedTuple):
    """What the disk says of an iteration."""

    policy: str
    first_had: int
    searched: bool
    kept: bool
    rollouts: int
    rollout_seconds: float
    drivers: set[str]
    trials: int
    successes: int
    trial_seconds: float
    diagnosed: bool
    f_learned_again: bool


def on_disk(folder: Path) -> list[Iteration]:
    """All iterations of a run."""
    rule = yaml.safe_load(read_manifest(folder).settings)["success"]
    found: list[Iteration] = []
    for index in range(100):
        place = folder / f"iteration_{index}"
        if not place.exists():
            break
        made = place / "policy" if index else first_policy(folder)
        policy, manifest = file_hash(made / "policy.pt"), read_manifest(made)
        searches = manifest.stage == "optimise-policy" and yaml.safe_load(manifest.settings)["optimise"]
        given = {record.sha256 for record in manifest.inputs.get("initial_policies", ())}
        earlier = folder / f"iteration_{index - 1}"
        before = [*sorted(earlier.glob("rollout*/episodes")), *sorted(earlier.glob("calibration*/episodes"))]
        rollouts = [episode for driven in before for episode in read_episodes(driven)]
        first = next((i for i, other in enumerate(found) if other.policy == policy), index)
        tested = place / "trials" / "episodes"
        is_tested = first == index or tested.exists()  # a policy that an update keeps is not tested again
        trials = read_episodes(tested) if is_tested else []
        found.append(
            Iteration(
                policy,
                first,
                searches,
                searches and policy in given,
                len(rollouts),
                seconds(rollouts),
                {e.provenance.policy_hash for e in rollouts},
                len(trials) if is_tested else found[first].trials,
                sum(holds(trial, rule) for trial in trials) if is_tested else found[first].successes,
                seconds(trials),
                (place / "diagnosis" / "manifest.json").exists(),
                (place / "sim_model" / "manifest.json").exists(),
            )
        )
    return found


def first_policy(folder: Path) -> Path:
    """The folder in which policy 0 was made."""
    searched = sorted(folder.glob("simulation/*_policy"))
    return searched[-1] if searched else folder / "regulator"


def seconds(episodes) -> float:
    return sum(float(e.observations[-1, 0] - e.observations[0, 0]) for e in episodes)


def holds(trial, rule) -> bool:
    """The success rule, written once more; the robot behind the port knows its true pose."""
    steps, settle, place = (
        math.ceil(round(rule[name] / rule["control_period"], 6)) for name in ("duration", "settle_time", "place_time")
    )
    tilt = [abs(value) for value in trial.observations[: steps + 1, 1].tolist()]
    inside = list(takewhile(lambda value: value <= rule["tilt_limit"], tilt))
    if len(inside) != steps + 1 or not all(v < rule["settled_tilt_limit"] for v in tilt[settle:]):
        return False
    away = [math.hypot(x, y) for x, y, *_ in trial.poses[place : steps + 1].tolist()]
    if rule["place_radii"] is not None and max(away) > rule["place_radii"] * rule["wheel_radius"]:
        return False
    sent = trial.commands[settle:steps].tolist()
    changes = [(after - before) ** 2 for before, after in pairwise(sent)]
    most = rule["command_change"]
    return most is None or math.sqrt(sum(changes) / len(changes)) < most * rule["torque_limit"]


class Text(HTMLParser):
    """The text of a page, and its list items apart."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.items: list[str] = []
        self.words: list[str] = []
        self.depth = 0
        self.feed(page)

    def handle_starttag(self, tag, attrs) -> None:
        if tag == "li":
            self.items.append("")
            self.depth += 1

    def handle_endtag(self, tag) -> None:
        self.depth -= tag == "li"

    def handle_data(self, data) -> None:
        self.words.append(data)
        if self.depth:
            self.items[-1] += data


def check(folder: Path, printed: str) -> list[Iteration]:
    """Hold every sentence of the printed summary and the report against the disk; returns what the disk says."""
    disk = on_disk(folder)
    page = Text((folder / "report.html").read_text())
    text = " ".join("".join(page.words).split())
    check_headline(folder, disk, printed)
    check_headline(folder, disk, text)
    check_table(disk, printed)
    for index, (step, iteration) in enumerate(zip(page.items, disk, strict=False)):
        check_step(index, " ".join(step.split()), iteration, disk)
        assert (f"Iteration {index}: The same policy as iteration {iteration.first_had}" in printed) == (
            iteration.first_had != index
        )
    return disk


def check_headline(folder: Path, disk: list[Iteration], said: str) -> None:
    best = next(i for i, iteration in enumerate(disk) if iteration.policy == file_hash(folder / "best_policy.pt"))
    tested = [iteration for iteration in disk if iteration.trial_seconds > 0.0]
    having = [iteration for iteration in tested if iteration.first_had == best]
    successes, trials = sum(i.successes for i in having), sum(i.trials for i in having)
    driven = sum(i.rollout_seconds for i in disk[: best + 1])
    if successes:
        assert f"policy {best} succeeded in {successes} of {trials} trials." in said
        assert ("Nothing was learned from the robot for it." in said) == (driven == 0)
        assert (f"It was learned from {driven:.1f} s of driving the robot" in said) == (driven > 0)
    else:
        assert f"no policy succeeded in any of {sum(i.trials for i in tested)} trials" in said
    assert ("The robot is balanced: " in said) == (successes == trials)
    learn, judge = sum(i.rollout_seconds for i in disk), sum(i.trial_seconds for i in disk)
    assert f"The robot was driven for {learn:.1f} s to learn, and for {judge:.1f} s in trials." in said


def check_table(disk: list[Iteration], printed: str) -> None:
    lines = printed.splitlines()
    header = next(i for i, line in enumerate(lines) if line.startswith("iteration "))
    driven = 0.0
    for index, (line, iteration) in enumerate(zip(lines[header + 1 :], disk, strict=False)):
        driven += iteration.rollout_seconds
        again = f"that of {iteration.first_had}" if iteration.first_had != index else "new"
        said = rf"[* ] {index} +{again}(, [a-z ]+)? +\d+ samples, {driven:.1f} s .* {iteration.successes} of "
        time = f"{iteration.trial_seconds:.1f} s" if iteration.trial_seconds else f"those of {iteration.first_had}"
        assert re.search(rf"{said}{iteration.trials}  +{time} ", line), (said, line)


def check_step(index: int, step: str, iteration: Iteration, disk: list[Iteration]) -> None:
    """What the report says was done in an iteration."""
    policy = iteration.first_had
    told = f"In its trials policy {policy} succeeded in {iteration.successes} of {iteration.trials}."
    assert (told in step) == (iteration.trial_seconds > 0.0)
    new_search = iteration.searched and not iteration.kept
    assert bool(re.search(r"A search on .* found policy|Policy 0 was searched", step)) == new_search
    assert ("found nothing better" in step) == iteration.kept
    if index:
        driver = disk[index - 1]
        assert iteration.drivers == {driver.policy}
        count = f"{iteration.rollouts} rollout" + "s" * (iteration.rollouts != 1)
        assert f"Policy {driver.first_had} drove the robot in {count} ({iteration.rollout_seconds:.1f} s)." in step
        assert ("No policy was searched" in step) == (policy != index and not iteration.searched)
    else:
        assert "drove" not in step
    assert ("diagnos" in step) == iteration.diagnosed
    assert ("f was learned again" in step) == iteration.f_learned_again


def untimed(summary: Summary) -> Summary:
    """A summary without how long it took."""
    iterations = tuple(replace(iteration, fit_s=0.0, search_s=0.0) for iteration in summary.iterations)
    return replace(summary, iterations=iterations, wall_s=0.0)
