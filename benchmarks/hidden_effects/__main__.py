"""`python -m benchmarks.hidden_effects generate|diagnose|score|all|again [seeds=5,6] [strata=clean,pairs] [workers=1]`.

`generate` drives the hidden robots and logs what they do; what is hidden goes to one file, which only `score` opens.
`diagnose` runs `twbal diagnose` on each set, `score` compares. What is there already in outputs/bench/hidden_effects is
not done again, but by `again`: it diagnoses `count` sets (120) once more, for their CPU time, and tells how many of
these diagnoses are the same to the byte. Results of seeds or strata that are not asked for are not replaced; choose
another file by `results=` (benchmarks/results/hidden_effects.json). Seeds 0 to 4 and those from 100 on are for
development; without `seeds=`, they are those of the published table.
"""

import json
import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from functools import cache, partial
from itertools import product
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from hydra import compose
from hydra.utils import instantiate

from benchmarks.diagnosing import timed_diagnosis, version_in
from benchmarks.hidden_effects.faults import parameters
from benchmarks.hidden_effects.noise_free import closed_noise_free
from benchmarks.hidden_effects.robot import drawn
from benchmarks.hidden_effects.score import score
from benchmarks.hidden_effects.serial import RECORDED, record
from benchmarks.hidden_effects.sets import SERIAL, STRATA, Set, sets
from benchmarks.hidden_effects.truth import HiddenRobot
from benchmarks.settings import refuse_to_replace
from twbal.algorithm.rollout import rollout
from twbal.cli.composition import composing
from twbal.core.episode import Provenance
from twbal.io.logs import write_episode

ROOT, RESULTS = Path("outputs/bench/hidden_effects"), Path("benchmarks/results/hidden_effects.json")
AGAIN = RESULTS.with_name("hidden_effects_again.json")
_EPISODES, _PERIODS = 4, 500
_TOLERANCE, _ASYMMETRY = 0.03, 0.02


def generate(wanted: Sequence[Set], labels: Path, workers: int) -> None:
    """Drive the robots and log what they do."""
    known: dict[str, Any] = json.loads(labels.read_text()) if labels.exists() else {}
    missing = [each for each in wanted if each.name not in known]
    with ProcessPoolExecutor(workers) as processes:
        for each, hidden in zip(missing, processes.map(drive, missing), strict=True):
            known[each.name] = {"stratum": each.stratum, "hidden": hidden, "severity": each.effects}
            labels.write_text(json.dumps(known, indent=1) + "\n")


def drive(each: Set) -> Mapping[str, Any]:
    """Drive the robot of one set, log what it does, and return what it hides."""
    folder = ROOT / each.name
    if each.stratum == SERIAL:
        return record(folder, each.seed)
    robot, policy, channels = _driver()
    rng = np.random.default_rng(each.seed)
    body = drawn(robot, rng, _TOLERANCE, _ASYMMETRY)
    hidden = {name: parameters(name, severity, rng) for name, severity in each.effects.items()}
    driven = replace(policy, multisine=0.0, prbs=0.0, speed=0.0) if each.still else policy
    plant = HiddenRobot(robot, body, hidden, each.surface, each.seed)
    for trial in range(_EPISODES):
        source = Provenance(robot.name, "robot", seed=each.seed, trial=trial)
        write_episode(
            folder / "episodes" / f"trial_{trial}.mcap", rollout(plant, driven, channels, _PERIODS, 0.6, source)
        )
    return hidden


@cache
def _driver() -> tuple[Any, Any, Any]:
    with composing():
        cfg = compose("real_rollout", ["experiment=excite"])
    return instantiate(cfg.robot), instantiate(cfg.policy), instantiate(cfg.state)


def diagnose(each: Set, place: str = "diagnosis") -> None:
    """Run the command on one set, in a process of its own, and note its CPU time."""
    out = ROOT / each.name / place
    if (out / "cpu.json").exists():
        return
    recorded = ROOT / each.name / RECORDED if each.stratum == SERIAL else ROOT / each.name
    words = [f"episodes={recorded}"]
    if each.left_out:
        words.append(f"diagnosis.exclude=[{','.join(each.left_out)}]")
    if each.stratum == SERIAL:
        words.append("diagnosis.tolerances.data_sheet=0.15")
    timed_diagnosis(each.name, words, out)


def again(wanted: Sequence[Set], workers: int) -> None:
    """Diagnose sets once more, and write down what that took and whether anything differs."""
    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(partial(diagnose, place="again"), wanted))
    seconds, same = [], 0
    for each in wanted:
        before, after = (ROOT / each.name / place for place in ("diagnosis", "again"))
        seconds.append(json.loads((after / "cpu.json").read_text())["cpu_s"])
        first, second = (place / "diagnosis.json" for place in (before, after))
        same += first.exists() and second.exists() and first.read_bytes() == second.read_bytes()
    figures = {
        "diagnosed once more": len(wanted),
        "the same to the byte": f"{same} of {len(wanted)}",
        "CPU seconds of the whole command, median": round(median(seconds), 1),
        "90 % of them take at most": round(float(np.quantile(seconds, 0.9)), 1),
    }
    AGAIN.write_text(json.dumps({"figures": figures}, indent=1) + "\n")
    print(json.dumps(figures, indent=1))


def noise_free(each: Set, hidden: dict[str, dict[str, float]]) -> float | None:
    """Share of the gap to the noise-free truth that a diagnosis closes; None for a robot behind a port."""
    if each.stratum == SERIAL:
        return None
    return closed_noise_free(each, hidden, ROOT / each.name, (_TOLERANCE, _ASYMMETRY))


def main(words: Sequence[str]) -> None:
    """Do what the first word says."""
    what, *rest = words or ["all"]
    settings = dict(word.split("=", 1) for word in rest)
    seeds = [int(seed) for seed in settings.pop("seeds", "5,6,7,8,9").split(",")]
    strata = settings.pop("strata", ",".join(STRATA)).split(",")
    workers, count = int(settings.pop("workers", "1")), int(settings.pop("count", "120"))
    results = Path(settings.pop("results", str(RESULTS)))
    if settings or what not in ("generate", "diagnose", "score", "all", "again") or not set(strata) <= set(STRATA):
        raise SystemExit(f"{__doc__}\nStrata: {', '.join(STRATA)}.")
    if what in ("score", "all"):
        before = json.loads(results.read_text()) if results.exists() else {}
        there = product(before.get("seeds", ()), before.get("strata", ()))
        refuse_to_replace(results, there, product(seeds, strata))
    wanted = sets(seeds, strata)
    labels = ROOT / f"labels_{seeds[0]}.json"
    ROOT.mkdir(parents=True, exist_ok=True)
    if what in ("generate", "all"):
        generate(wanted, labels, workers)
    if what in ("diagnose", "all"):
        with ThreadPoolExecutor(workers) as pool:
            list(pool.map(diagnose, wanted))
    if what == "again":
        again(wanted[:count], workers)
    if what in ("score", "all"):
        tried = [each for each in wanted if (ROOT / each.name / "diagnosis" / "cpu.json").exists()]
        diagnoses = {
            each.name: json.loads((ROOT / each.name / "diagnosis" / "diagnosis.json").read_text())
            for each in tried
            if (ROOT / each.name / "diagnosis" / "diagnosis.json").exists()
        }
        cpu = {name: json.loads((ROOT / name / "diagnosis" / "cpu.json").read_text())["cpu_s"] for name in diagnoses}
        known = json.loads(labels.read_text())
        named = [each for each in wanted if diagnoses.get(each.name, {}).get("verdict") == "named"]
        with ProcessPoolExecutor(workers) as processes:
            hidden = [known[each.name]["hidden"] for each in named]
            closed = list(processes.map(noise_free, named, hidden))
        truly = dict(zip([each.name for each in named], closed, strict=True))
        result = {
            "seeds": seeds,
            "strata": strata,
            **version_in(ROOT / each.name / "diagnosis" for each in tried).record(),
            **score({each.name: known[each.name] for each in tried}, diagnoses, cpu, truly),
        }
        results.write_text(json.dumps(result, indent=1) + "\n")
        print(json.dumps(result["figures"], indent=1))


if __name__ == "__main__":
    main(sys.argv[1:])
