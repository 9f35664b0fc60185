"""`python -m benchmarks.what_next [strata=single_1/4,pairs] [ways=usual,standing] [seeds=2005-2014] ...`.

For each stratum, way to record first and seed: the hidden robot of that set of `benchmarks.other_robots`, with ideal
sensors, is recorded and diagnosed. Where that stays open, so that an experiment is suggested, the robot is
recorded for another 10 s in the same way, and for 10 s by the suggested experiment; each is diagnosed together with the
first recording. What is there already is not done again, but one version must have diagnosed it. The results are of the
strata, ways and seeds that are asked for. Further settings, with their defaults:

    root=outputs/bench/what_next            folder of the recordings
    code=.                                  folder of the twbal that diagnoses
    results=benchmarks/results/what_next.json
    enough=40                               open sets after which no other robot is recorded
"""

import json
import sys
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.diagnosing import diagnosis_of
from benchmarks.measure import version_of
from benchmarks.other_robots.__main__ import seeds_of, sheet_of
from benchmarks.other_robots.kinds import FOREIGN, equivalents
from benchmarks.other_robots.recording import Recorded
from benchmarks.other_robots.score import presliding_of
from benchmarks.other_robots.sets import Set, designed
from benchmarks.settings import refuse_to_replace, rows_in, text_settings
from benchmarks.what_next.recording import WAYS, first_and_repetition, suggested
from benchmarks.what_next.tables import PARTS

DEFAULTS = {
    "strata": "single 1/8,pairs,triples",
    "ways": ",".join(WAYS),
    "seeds": "2005-2014",
    "root": "outputs/bench/what_next",
    "code": ".",
    "results": "benchmarks/results/what_next.json",
    "enough": "40",
}
_SURE = 0.8  # probability of a set of effects below which a diagnosis suggests an experiment


class Case(NamedTuple):
    """A hidden robot and the way in which it is recorded first.

    Attributes:
        each: the set.
        way: its name.
        folder: of its recordings and diagnoses.
        code: folder of the twbal that diagnoses.
    """

    each: Set
    way: str
    folder: Path
    code: Path

    def diagnosis(self, name: str, recordings: Sequence[str]) -> Mapping[str, Any]:
        """The diagnosis of some of its recordings, under a name; from its file, where it was made before."""
        return diagnosis_of(self.each, [self.folder / log for log in recordings], self.folder / name, self.code)


def judged(case: Case) -> dict[str, Any]:
    """What became of a case; its second recordings are made only where the first diagnosis stays open."""
    file = case.folder / "judged.json"
    if file.exists():
        known: dict[str, Any] = json.loads(file.read_text())
        if known.get("commit") != version_of(case.code):
            raise SystemExit(
                f"{case.folder} was diagnosed by commit {known.get('commit', 'unknown')}, not {version_of(case.code)}: "
                "remove it, or change root= or code=."
            )
        return known
    sheet = sheet_of(case.each)
    recorded = first_and_repetition(case.each, sheet, WAYS[case.way], case.folder)
    first = case.diagnosis("diagnosis", ["first"])
    row: dict[str, Any] = {"stratum": case.each.stratum, "seed": case.each.seed, "way": case.way}
    row |= {key: getattr(case.each, key) for key in ("rate", "sheet", "tolerance")}
    row["commit"] = version_of(case.code)
    row |= {"hidden": sorted(recorded.hidden), "first": _said(first, recorded)}
    row["next"] = offered = first.get("next_experiment")
    if row["first"]["open"]:
        row["repetition"] = _said(case.diagnosis("with_repetition", ["first", "repetition"]), recorded)
        if offered:
            row["seconds_up"] = suggested(case.each, sheet, recorded, offered["settings"], case.folder)
            row["suggested"] = _said(case.diagnosis("with_suggested", ["first", "suggested"]), recorded)
    file.write_text(json.dumps(row, indent=1) + "\n")
    return row


def _said(diagnosis: Mapping[str, Any], recorded: Recorded) -> dict[str, Any]:
    """The verdict, whether it is open, what is named and whether it is right, and what is missed.

    It is open where nothing is named, where other effects do as well, or where no set of effects is sure.
    """
    hidden = [name for name in recorded.hidden if name not in FOREIGN]
    there = {*hidden, *presliding_of(hidden)}
    named = [effect for effect in diagnosis["effects"] if effect["is_named"]]
    return {
        "verdict": diagnosis["verdict"],
        "open": diagnosis["verdict"] in ("unknown", "undecided")
        or _surest(diagnosis["rivals"]) < _SURE
        or any(set(effect["equivalents"]) - equivalents(effect["name"]) for effect in named),
        "named": [[effect["name"], bool(equivalents(effect["name"]) & there)] for effect in named],
        "likely": [[effect["name"], round(effect["probability"], 4)] for effect in diagnosis["effects"]],
        "rivals": [[rival["names"], round(rival["probability"], 4)] for rival in diagnosis["rivals"][:5]],
        "missed": [name for name in hidden if not any(name in equivalents(effect["name"]) for effect in named)],
    }


def _surest(rivals: Sequence[Mapping[str, Any]]) -> float:
    """Probability of the likeliest set of effects, with those that are declared the same.

    What a diagnosis calls a negligible effect of a set counts as none.
    """
    found: dict[tuple[str, ...], float] = {}
    for rival in rivals:
        names = tuple(sorted(min(equivalents(name)) for name in rival["names"] if name not in rival["negligible"]))
        found[names] = found.get(names, 0.0) + rival["probability"]
    return max(found.values())


def main(words: Sequence[str]) -> None:
    """Record, diagnose, and write the results."""
    settings = text_settings(DEFAULTS, words)
    strata, ways, seeds = settings["strata"].split(","), settings["ways"].split(","), seeds_of(settings["seeds"])
    root, code, results = (Path(settings[name]) for name in ("root", "code", "results"))
    there = ((row["seed"], row["stratum"], row["way"]) for row in rows_in(results))
    refuse_to_replace(results, there, product(seeds, strata, ways))
    rows = list[dict[str, Any]]()
    for seed, stratum, how in product(seeds, strata, ways):
        each = designed(stratum, seed)._replace(excitation="E", sensors="ideal")
        row = judged(Case(each, how, root / f"{each.name}_{how}", code))
        after = {name: row[name]["verdict"] for name in ("first", "repetition", "suggested") if name in row}
        print(stratum, seed, how, after, flush=True)
        rows = sorted([*rows, row], key=lambda row: (row["seed"], row["stratum"], row["way"]))
        results.write_text('{"sets": [\n' + ",\n".join(map(json.dumps, rows)) + "\n]}\n")
        if sum(row["first"]["open"] for row in rows) >= int(settings["enough"]):
            break
    for part in PARTS.values():
        print("\n".join(part({"sets": rows})), end="\n\n")


if __name__ == "__main__":
    main(sys.argv[1:])
