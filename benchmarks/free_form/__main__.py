"""`python -m benchmarks.free_form [seeds=6000-6001] [clean=6000-6019] [results=benchmarks/results/free_form.json]`.

In robots of `benchmarks.other_robots` a function of one variable is hidden that no effect of the library is, or an
effect that the diagnosis must do without; in others nothing is hidden. Each is diagnosed, without the second search,
and what is drawn is held against the truth. Where nothing remains, `twbal diagnose` looks for no function; here one is
looked for all the same. Sets that the same commit did already, in `root` (outputs/bench/free_form), are not done again.
A file of results that holds sets that are not asked for is not replaced. Seeds 5000 and 5001 were for development.
"""

import json
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.free_form.tables import PARTS
from benchmarks.free_form.truth import comparable, hidden_function, visited
from benchmarks.measure import version_of
from benchmarks.other_robots.__main__ import seeds_of, sheet_of, written
from benchmarks.other_robots.kinds import KNOWN_SINCE, SHAPES, alike
from benchmarks.other_robots.recording import Recorded, driven, episode_of
from benchmarks.other_robots.sets import Set, designed
from benchmarks.settings import refuse_to_replace, rows_in, text_settings
from twbal.cli.diagnosis_config import composed_diagnosis, diagnosis_of
from twbal.core.channels import Channels
from twbal.core.episode import Provenance
from twbal.core.files import write_atomically
from twbal.core.robot_parameters import RobotParameters
from twbal.diagnosis.free_form import free_forms
from twbal.diagnosis.free_form_record import FreeForm
from twbal.diagnosis.inputs import NamedEpisodes
from twbal.diagnosis.pipeline import diagnose_episodes, free_form_inputs
from twbal.diagnosis.record import Diagnosis

DEFAULTS = {
    "seeds": "6000-6001",
    "clean": "6000-6019",
    "root": "outputs/bench/free_form",
    "results": "benchmarks/results/free_form.json",
}
IN_NO_LIBRARY = (*SHAPES, "quadratic_drag")
LEFT_OUT = ("viscous_friction", "coulomb_friction", "cable_spring", "cogging", "dead_zone")
_WORDS = ("diagnosis.tempered_search=false", "diagnosis.max_effects=3", "next_experiment=false")
_RATE, _TOLERANCE, _FITTED = 50, 0.03, 3  # Hz; of the sheet; recordings of four that are fitted


def cases(seeds: Sequence[int], clean: Sequence[int]) -> list[tuple[str, str, Set]]:
    """Kinds of sets, what is hidden, and the sets."""
    found = []
    for seed in seeds:
        found += [("in no library", name, _set(seed, name, _since(name))) for name in IN_NO_LIBRARY]
        found += [("left out", name, _set(seed, name, tuple(sorted(alike(name))))) for name in LEFT_OUT]
    return found + [("nothing", "", _set(seed, "", ())) for seed in clean]


def _since(name: str) -> tuple[str, ...]:
    """What the diagnosis must do without, so that it is still in no library."""
    return (name,) if name in KNOWN_SINCE else ()


def _set(seed: int, name: str, left_out: tuple[str, ...]) -> Set:
    usual = designed("clean", seed)._replace(excitation="E", sensors="ideal", rate=_RATE, sheet="paper")
    return usual._replace(tolerance=_TOLERANCE, effects={name: 1.0} if name else {}, left_out=left_out)


def diagnosed(each: Set, sheet: RobotParameters, recorded: Recorded) -> tuple[Diagnosis, list[FreeForm], float]:
    """The diagnosis of a set, what is drawn (where nothing remains, if it is asked all the same), and CPU time [s]."""
    channels = Channels(("tilt", "tilt_rate", "speed"), sheet.wheel_radius, sheet.control_period)
    episodes = [
        episode_of(
            rollout, each, sheet.control_period, channels, Provenance("hidden", "robot", seed=each.seed, trial=k)
        )
        for k, rollout in enumerate(recorded.rollouts)
    ]
    words = [*_WORDS, f"robot={each.sheet}", f"robot.control_period={sheet.control_period}"]
    if each.left_out:
        words.append(f"diagnosis.exclude=[{','.join(each.left_out)}]")
    simulation, settings, data = diagnosis_of(composed_diagnosis(words))
    names = [f"trial {k}" for k in range(len(episodes))]
    result = diagnose_episodes(
        NamedEpisodes(episodes, names), NamedEpisodes((), ()), simulation, settings, replace(data, free_form=False)
    )
    comparison = result.findings.comparison
    assert comparison is not None
    began = time.process_time()
    drawn = free_forms(free_form_inputs(comparison, result.split, simulation, settings))
    return result.diagnosis, list(drawn), time.process_time() - began


def judged(kind: str, name: str, each: Set) -> dict[str, Any]:
    """What was drawn of a set, and how near it is to the truth."""
    sheet = sheet_of(each)
    recorded = driven(each, sheet)
    diagnosis, found, cpu_s = diagnosed(each, sheet, recorded)
    drawn = found[0] if found else None
    row: dict[str, Any] = {"kind": kind, "hidden": name, "seed": each.seed, "verdict": str(diagnosis.verdict)}
    row |= {"remains": diagnosis.has_remains, "likely": [[e.name, round(e.probability, 3)] for e in diagnosis.effects]}
    row |= {"stays_up": recorded.stays_up, "cpu_s": round(cpu_s, 2), "right": False}
    row["drawn"] = None if drawn is None else drawn._asdict()
    if drawn is not None and name:
        row |= _beside_truth(name, recorded, drawn, sheet.control_period)
    return row


def _beside_truth(name: str, recorded: Recorded, drawn: FreeForm, period: float) -> dict[str, Any]:
    """Whether quantity and variable are right; if so, rms error over that of the truth, and points in the band."""
    hidden = hidden_function(name, recorded.robot, recorded.sensors)
    if (hidden.quantity, hidden.variable) != (drawn.quantity, drawn.variable):
        return {}
    values = visited(hidden.variable, recorded.rollouts[:_FITTED], recorded.robot.radius, period)
    truth = comparable(hidden, np.array(drawn.grid), values)
    off = np.array(drawn.mean) - truth
    inside = (truth >= np.array(drawn.low95)) & (truth <= np.array(drawn.high95))
    error = float(np.sqrt(np.mean(off**2) / np.mean(truth**2)))
    return {"right": True, "error": error, "covered": float(inside.mean()), "truth": truth.tolist()}


def _kept(file: Path, kind: str, name: str, each: Set) -> dict[str, Any]:
    """What was drawn of a set; from its file, where a version that is committed judged it before."""
    if not file.exists() or file.parent.name.endswith("+"):
        file.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(file, json.dumps(judged(kind, name, each)))
    found: dict[str, Any] = json.loads(file.read_text())
    return found


def main(words: Sequence[str]) -> None:
    """Record, diagnose, and write the results."""
    settings = text_settings(DEFAULTS, words)
    results = Path(settings["results"])
    asked = cases(seeds_of(settings["seeds"]), seeds_of(settings["clean"]))
    there = ((row["kind"], row["hidden"], row["seed"]) for row in rows_in(results))
    refuse_to_replace(results, there, ((kind, name, each.seed) for kind, name, each in asked))
    root, rows = Path(settings["root"]) / version_of(Path()), list[dict[str, Any]]()
    for kind, name, each in asked:
        rows.append(_kept(root / f"{kind}_{name}_{each.seed}.json".replace(" ", "_"), kind, name, each))
        results.write_text(written({"sets": rows}))
        print({key: value for key, value in rows[-1].items() if key not in ("truth", "drawn")}, flush=True)
    for part in PARTS.values():
        print("\n".join(part({"sets": rows})), end="\n\n")


if __name__ == "__main__":
    main(sys.argv[1:])
