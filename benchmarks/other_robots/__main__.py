"""`python -m benchmarks.other_robots generate|diagnose|score|all|power [strata=clean,pairs] [seeds=0-9] [workers=1]`.

`generate` records one set for each stratum and seed; what is hidden goes to labels/, which only `score` opens.
`diagnose` runs `twbal diagnose` on each set, `score` compares and writes the results, with the commit of the code that
diagnosed; it refuses diagnoses of several commits, or with several `words`, and to replace results of other sets.
`power` takes sets that were diagnosed,
records and diagnoses each without its effect, and writes what was said beforehand and what was found. What is there
already is not done again. Further settings, with their defaults:

    root=outputs/bench/other_robots   folder of the sets
    code=.                            folder of the twbal that diagnoses
    place=diagnosis                   name of the diagnoses in the sets' folders, for several versions side by side
    results=ROOT/results.json         those of the docs are in benchmarks/results, under names of their own
    words=                            further settings of `twbal diagnose`, separated by spaces

Seeds below 1000 are for development; the published table has others.
"""

import json
import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

from hydra import compose
from hydra.utils import instantiate

from benchmarks.diagnosing import timed_diagnosis, version_in
from benchmarks.other_robots.power import POWER_PARTS, said_and_found
from benchmarks.other_robots.score import judged
from benchmarks.other_robots.sets import STRATA, Set, sets
from benchmarks.other_robots.tables import PARTS
from benchmarks.settings import refuse_to_replace, rows_in
from twbal.cli.composition import composing
from twbal.core.robot_parameters import RobotParameters

_USUAL_TOLERANCE = 0.03  # of `twbal diagnose`


@dataclass(frozen=True)
class Places:
    """Folders: of the sets, of the code that diagnoses, and the name of the diagnoses."""

    root: Path
    code: Path
    place: str
    words: tuple[str, ...]

    def label(self, each: Set) -> Path:
        """File of what is hidden in a set."""
        return self.root / "labels" / f"{each.name}.json"

    def diagnosis(self, each: Set) -> Path:
        """Folder of the diagnosis of a set."""
        return self.root / each.name / self.place


def generate(each: Set, places: Places) -> None:
    """Record one set, unless it is there."""
    from benchmarks.other_robots.recording import record  # what compiles, and `score` need not

    file = places.label(each)
    if file.exists():
        return
    label = record(each, sheet_of(each), places.root / each.name)
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(label, indent=1) + "\n")


def sheet_of(each: Set) -> RobotParameters:
    """Data sheet of a set, with its control period."""
    return replace(_sheet(each.sheet), control_period=1.0 / each.rate)


@cache
def _sheet(name: str) -> RobotParameters:
    with composing():
        found: RobotParameters = instantiate(compose("sim_collect", [f"robot={name}"]).robot)
    return found


def diagnose(each: Set, places: Places) -> None:
    """Run the command on one set, in a process of its own, and note its CPU time."""
    out = places.diagnosis(each).resolve()
    if (out / "cpu.json").exists():
        return
    recorded = (places.root / each.name).resolve()
    words = [f"episodes={recorded}"]
    words += [f"robot={each.sheet}", f"robot.control_period={1.0 / each.rate}"]
    if each.left_out:
        words.append(f"diagnosis.exclude=[{','.join(each.left_out)}]")
    if each.tolerance != _USUAL_TOLERANCE:
        words.append(f"diagnosis.tolerances.data_sheet={each.tolerance}")
    timed_diagnosis(each.name, words, out, places.code, places.words)


def score(wanted: Sequence[Set], places: Places) -> dict[str, Any]:
    """Records of all sets that were tried, which one version must have diagnosed."""
    rows, tried = [], [each for each in wanted if (places.diagnosis(each) / "cpu.json").exists()]
    version = version_in(map(places.diagnosis, tried))
    for each in tried:
        note, found = places.diagnosis(each) / "cpu.json", places.diagnosis(each) / "diagnosis.json"
        diagnosis = json.loads(found.read_text()) if found.exists() else None
        label = json.loads(places.label(each).read_text())
        rows.append(judged(label, diagnosis, json.loads(note.read_text())["cpu_s"]))
    return {**version.record(), "sets": rows}


def score_power(wanted: Sequence[Set], places: Places) -> dict[str, Any]:
    """Of all sets of one effect that were diagnosed with it and without it, what was said and what was found."""
    rows, folders = [], list[Path]()
    for each in wanted:
        found, bare = (places.diagnosis(one) / "diagnosis.json" for one in (each, each.bare()))
        if found.exists() and bare.exists():
            folders += [found.parent, bare.parent]
            label = json.loads(places.label(each).read_text())
            row = judged(label, json.loads(found.read_text()), 0.0)
            rows.append(said_and_found(row, label, json.loads(bare.read_text())))
    return {**version_in(folders).record(), "power": [row for row in rows if row is not None]}


def written(results: Mapping[str, Any]) -> str:
    """As JSON with one set a line; the sets come last."""
    *head, (key, rows) = results.items()
    known = "".join(f'"{name}": {json.dumps(value)}, ' for name, value in head)
    return f'{{{known}"{key}": [\n' + ",\n".join(json.dumps(row) for row in rows) + "\n]}\n"


def seeds_of(text: str) -> list[int]:
    """Seeds of a text such as `0-2,7`."""
    ranges = [part.split("-") for part in text.split(",")]
    return [seed for ends in ranges for seed in range(int(ends[0]), int(ends[-1]) + 1)]


def main(words: Sequence[str]) -> None:
    """Do what the first word says."""
    what, *rest = words or ["all"]
    settings = dict(word.split("=", 1) for word in rest)
    strata = settings.pop("strata", ",".join(STRATA)).split(",")
    seeds, workers = seeds_of(settings.pop("seeds", "0-2")), int(settings.pop("workers", "1"))
    root, code = settings.pop("root", "outputs/bench/other_robots"), settings.pop("code", ".")
    words_for_it = tuple(settings.pop("words", "").split())
    places = Places(Path(root), Path(code), settings.pop("place", "diagnosis"), words_for_it)
    results = Path(settings.pop("results", places.root / "results.json"))
    if settings or what not in ("generate", "diagnose", "score", "all", "power") or not set(strata) <= set(STRATA):
        raise SystemExit(f"{__doc__}\nStrata: {', '.join(STRATA)}.")
    hidden = sets(strata, seeds)
    wanted = [each.bare() for each in hidden if len(each.effects) == 1] if what == "power" else hidden
    if what in ("score", "all", "power"):
        there = rows_in(results, "power" if what == "power" else "sets")
        asked = ((each.stratum, each.seed) for each in hidden)
        refuse_to_replace(results, ((row["stratum"], row["seed"]) for row in there), asked)
    if what in ("generate", "all", "power"):
        if workers == 1:
            for each in wanted:
                generate(each, places)
        else:
            with ProcessPoolExecutor(workers) as processes:
                list(processes.map(partial(generate, places=places), wanted))
    if what in ("diagnose", "all", "power"):
        with ThreadPoolExecutor(workers) as pool:
            list(pool.map(partial(diagnose, places=places), wanted))
    if what in ("score", "all", "power"):
        found = score_power(hidden, places) if what == "power" else score(wanted, places)
        results.write_text(written(found))
        for part in (POWER_PARTS if what == "power" else PARTS).values():
            print("\n".join(part(found)), end="\n\n")


if __name__ == "__main__":
    main(sys.argv[1:])
