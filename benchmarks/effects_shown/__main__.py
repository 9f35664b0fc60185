"""`python -m benchmarks.effects_shown [strata=eight] [seeds=0-2] [root=...] [results=...]`: what could be found.

Any search of effects is limited by what the recordings show through the forms that twbal knows. So the effects that are
hidden in a set are fitted all at once, from their true values, and then without each of them in turn. An effect counts
as *shown* where it is worth the penalty that a diagnosis asks for, beside all others. No search is made, and only this
program and the scoring of `benchmarks.other_robots` open what is hidden. The sets are those that it recorded.
"""

import json
import sys
from collections.abc import Mapping, Sequence
from math import isfinite, log1p
from pathlib import Path
from typing import Any

import twbal
from benchmarks.other_robots.__main__ import Places, seeds_of
from benchmarks.other_robots.sets import Set, sets
from benchmarks.settings import text_settings
from twbal.cli.diagnosis_config import composed_diagnosis, diagnosis_of
from twbal.diagnosis.candidates import Candidate, always_free
from twbal.diagnosis.hypothesis import FittedHypothesis
from twbal.diagnosis.problem import Problem
from twbal.diagnosis.removal import without
from twbal.planar.parameters import planar_parameters
from twbal.sysid.model import Field, Model

DEFAULTS = {
    "strata": "eight",
    "seeds": "0-2",
    "root": "outputs/bench/other_robots",
    "results": "benchmarks/results/effects_shown.json",
}
_IN_BRIEF = (
    *("diagnosis.max_effects=1", "diagnosis.shortlist=1", "diagnosis.tempered_search=false"),
    *("starts=1", "next_experiment=false", "free_form=false"),
)
"""For a diagnosis that is made for its recordings and its refitted data sheet."""
_ROUNDS = 12  # of values and noise in turn
_NOISE_ITERATIONS = 30
_RESTARTS, _BETTER = 4, 1.0  # and the gain in BIC that another one must bring
Values = dict[Field, float]
_OWN_NAMES = {"phase": ("own_phase", "own_left"), "rotor_share": ("own_share",)}  # of the generator


def shown(each: Set, places: Places) -> dict[str, Any]:
    """How well the true set explains a set of recordings, and which of its effects are worth their penalty.

    Returns:
        stratum, seed: of the set.
        autocorrelation: of the errors that the true set leaves; None where its predictions diverge.
        shown: by effect that the library has, its score beside the others: the gain in BIC over the autocorrelation,
            which counts as no more than that from which on a diagnosis stays `unknown`.
    """
    label = json.loads(places.label(each).read_text())
    words = [f"robot.control_period={1.0 / each.rate}", f"diagnosis.tolerances.data_sheet={each.tolerance}", *_IN_BRIEF]
    comparison = twbal.diagnose(places.root / each.name, each.sheet, words).findings.comparison
    assert comparison is not None
    simulation, settings, _ = diagnosis_of(composed_diagnosis([f"robot={each.sheet}", *words]))
    planar = planar_parameters(simulation.robot, simulation.effects)
    always = always_free(settings.tolerances.for_robot(simulation.robot), planar, len(comparison.data.recordings))
    chosen = comparison.chosen
    base = chosen.fit.model.put({field: value for c in chosen.candidates for field, value in c.none.items()})
    sheet = base.put({free.field: free.mean for free in always})
    problem = Problem(comparison.data, base, always, comparison.candidates, settings)
    true = _true_set(comparison.candidates, label)
    values = {candidate.name: _values(candidate, label) for candidate in true}
    wanted = [candidate for candidate in true if candidate.name in label["hidden"]]
    whole = min((_fitted(problem, start, true, values) for start in (base, sheet)), key=lambda w: w.bic)
    lighter = _lighter(problem, sheet, whole, values, wanted)
    for _ in range(_RESTARTS):  # a set that does better without an effect was not fitted as well as it can be
        name, best = min(lighter.items(), key=lambda item: item[1].bic)
        again = problem.fit(best.fit.model.put(values[name]), true, _ROUNDS)
        if again.bic > whole.bic - _BETTER or not isfinite(again.bic):
            break
        whole = again
        lighter = _lighter(problem, sheet, whole, values, wanted)
    known: dict[str, Any] = {"stratum": each.stratum, "seed": each.seed}
    if not isfinite(whole.bic):
        return {**known, "autocorrelation": None, "shown": dict.fromkeys((c.name for c in wanted), 0.0)}
    weight = min(whole.autocorrelation, settings.thresholds.max_autocorrelation)
    scores = {name: round((less.bic - whole.bic) / weight, 1) for name, less in lighter.items()}
    return {**known, "autocorrelation": round(whole.autocorrelation, 2), "shown": scores}


def _lighter(
    problem: Problem, sheet: Model, whole: FittedHypothesis, values: Mapping[str, Values], wanted: Sequence[Candidate]
) -> dict[str, FittedHypothesis]:
    """The true set without each of these effects: from what the whole came to, or from true values, whichever fits."""
    found = {}
    for candidate in wanted:
        rest = [other for other in whole.candidates if other is not candidate]
        tried = [without(problem, whole, candidate)] if isfinite(whole.bic) else []
        found[candidate.name] = min((*tried, _fitted(problem, sheet, rest, values)), key=lambda w: w.bic)
    return found


def _true_set(candidates: Sequence[Candidate], label: Mapping[str, Any]) -> list[Candidate]:
    """Effects of a set that the library has, with the filter that its tilt comes from."""
    there = {*label["hidden"], *(["tilt_filter"] if label["sensor_values"]["tilt_constant"] > 0 else [])}
    return [candidate for candidate in candidates if candidate.name in there]


def _values(candidate: Candidate, label: Mapping[str, Any]) -> Values:
    """True values of an effect within the ranges of a fit, as far as its form has them."""
    hidden = dict(label["hidden"].get(candidate.name, {}))
    if candidate.name == "tilt_filter":
        constant, period = label["sensor_values"]["tilt_constant"], 1.0 / label["rate"]
        hidden["rate"] = log1p(period / constant) / period
    found: Values = {}
    for p in candidate.parameters:
        names = [name for name in (p.name, *_OWN_NAMES.get(p.name, ())) if name in hidden]
        if names:
            found[candidate.field(p)] = min(max(hidden[names[0]], p.low), p.high)
    return found


def _fitted(
    problem: Problem, start: Model, candidates: Sequence[Candidate], values: Mapping[str, Values]
) -> FittedHypothesis:
    """A set fitted from its true values, and a data sheet, on."""
    own = {field: value for candidate in candidates for field, value in values[candidate.name].items()}
    return problem.fit(problem.data.with_noise(start.put(own), _NOISE_ITERATIONS), candidates, _ROUNDS)


def main(words: Sequence[str]) -> None:
    """See what each set shows, and write a line for each."""
    settings = text_settings(DEFAULTS, words)
    places = Places(Path(settings["root"]), Path(), "shown", ())
    rows = []
    for each in sets(settings["strata"].split(","), seeds_of(settings["seeds"])):
        rows.append(shown(each, places))
        print(json.dumps(rows[-1]), flush=True)
    Path(settings["results"]).write_text('{"sets": [\n' + ",\n".join(json.dumps(row) for row in rows) + "\n]}\n")


if __name__ == "__main__":
    main(sys.argv[1:])
