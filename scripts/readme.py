"""Fill the README with what the tool itself drew and measured.

    python scripts/readme.py tables                the tables, from benchmarks/results/*.json
    python scripts/readme.py pictures <run folder> the pictures and the film, from a run of `twbal iterate`
    python scripts/readme.py paper <run folder>    those of the paper's own recipe, from a run with experiment=paper
    python scripts/readme.py diagnosis <run folder> the picture of a gap, from a run of `twbal diagnose`

Nothing in these tables is typed by hand.
"""

import json
import re
import shutil
import subprocess
import sys
import tempfile
import textwrap
from collections.abc import Callable, Mapping, Sequence
from math import inf
from pathlib import Path
from statistics import median
from typing import Any

HOUSE = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(HOUSE))  # `benchmarks` is not installed

from benchmarks.hidden_robots.prediction import prediction_table, reliability_table  # noqa: E402

RESULTS = HOUSE / "benchmarks" / "results"
PICTURES = HOUSE / "docs" / "pictures"
PAGES = (HOUSE / "README.md", *(HOUSE / "docs" / name for name in ("methods.md", "benchmarks.md", "speed.md")))


def main(words: Sequence[str]) -> None:
    """Do what the first word says."""
    match words:
        case ["tables"]:
            for page in PAGES:
                page.write_text(filled(page.read_text()))
        case ["pictures", folder]:
            copy_pictures(Path(folder) / "figures", PICTURES)
            draw_film(Path(folder))
        case ["paper", folder]:
            copy_pictures(Path(folder) / "figures", PICTURES / "paper", ("cost",))
        case ["diagnosis", folder]:
            shutil.copy(Path(folder) / "figures" / "gap.svg", PICTURES / "gap.svg")
        case _:
            raise SystemExit(__doc__)


def copy_pictures(figures: Path, target: Path, names: Sequence[str] = ("tilt", "learning", "drift", "cost")) -> None:
    """The pictures of a run that the pages show, with its first prediction, and its last as `prediction_last`."""
    target.mkdir(parents=True, exist_ok=True)
    predictions = sorted(figures.glob("prediction_*.svg"), key=lambda path: int(path.stem.split("_")[1]))
    shown = {name: figures / f"{name}.svg" for name in (*names, "prediction_0")}
    for name, picture in {**shown, "prediction_last": predictions[-1]}.items():
        shutil.copy(picture, target / f"{name}.svg")


def draw_film(run: Path) -> None:
    """The first trial of the policy from f alone, and beside it that of the last policy."""
    trials = sorted(run.glob("iteration_*/trials/episodes"), key=lambda path: int(path.parts[-3].split("_")[1]))
    first, last = (min(folder.glob("*.mcap")) for folder in (trials[0], trials[-1]))
    settings = [f"episode={last}", f"compare_with=[{first}]", "captions=[after learning,before]", "simulate=false"]
    settings += ["seconds=6", "width=560", "height=260"]
    with tempfile.TemporaryDirectory() as out:
        command = [sys.executable, "-m", "twbal", "plot", *settings, f"hydra.run.dir={out}"]
        subprocess.run(command, check=True)
        shutil.copy(Path(out) / "film.gif", PICTURES / "film.gif")


def filled(page: str) -> str:
    """`page` with each `<!-- table PART of FILES -->...<!-- end -->` filled anew, from those files that are there."""

    def table(found: re.Match[str]) -> str:
        name = found.group(1)
        part, _, files = name.partition(" of ")
        paths = [RESULTS / f"{file}.json" for file in files.split()]
        measured = [json.loads(path.read_text()) for path in paths if path.exists()]
        lines = PARTS[part](*measured) if measured else ["Not measured yet."]
        return "\n".join([f"<!-- table {name} -->", *lines, "<!-- end -->"])

    return re.sub(r"<!-- table ([\w ]+) -->.*?<!-- end -->", table, page, flags=re.DOTALL)


RULES = {"default": "default rule", "sticky": "sticky rule"}
COLUMNS = {**RULES, "due": "each by its own"}
_WITHIN = (0, 1, 3, 6)  # updates
_BESIDE = ("", "pilco", "lqr", "lqr_integral", "lqr_identified", "one_simulation", "paper")


def summary(results: Mapping[str, Any]) -> list[str]:
    """One line a figure of a family of hidden robots, and a column for each rule of success.

    The last column judges robots that stick by the sticky rule, and the others by the default one.
    """
    found, missing = [_with_due(robot) for robot in results["robots"]], results["unreachable"]
    sticky = sum(robot["reference"]["is_sticky"] for robot in found)
    rows = [
        ("robots", [f"{len(found)}"] * len(COLUMNS)),
        ("robots that stick", [f"{sticky}"] * len(COLUMNS)),
        *((f"all trials succeed within {n} updates", _by_rule(found, _solved_within, n)) for n in _WITHIN),
        ("place of the successes, median / worst", _by_rule(found, _spread, "farthest", " m", ".2f")),
        ("tilt from peak to peak, median / worst", _by_rule(found, _spread, "oscillation_deg", "°", ".1f")),
        ("the same under the reference search", [_reference(found)] * len(COLUMNS)),
        ("driven to learn, median / worst", _by_rule(found, _seconds, "real_seconds")),
        ("driven to decide, median / worst", _by_rule(found, _seconds, "trial_seconds")),
        ("robots that stand a minute, in five of five trials", _by_rule(found, _minutes)),
    ]
    pushes = [push for robot in found for push in robot.get("pushes", ())]
    reference = _reference_pushes(results["family"], [robot["seed"] for robot in found])
    for driven, by in ((pushes, ""), (reference, " under the reference search")) if pushes else ():
        for name, words in (("survived", "pushes survived"), ("back", "and back in place within 5 s")):
            cell = f"{sum(push[name] for push in driven)} of {len(driven)}" if driven else "not measured"
            rows.append((f"{words}{by}", [cell] * len(COLUMNS)))
    lines = [f"| figure | {' | '.join(COLUMNS.values())} |", "|---|---|---|---|"]
    lines += [f"| {name} | {' | '.join(cells)} |" for name, cells in rows]
    listed = ", ".join(map(str, missing)) or "none"
    return [*lines, "", f"Left out, as the reference search finds nothing that passes: {listed}."]


def _reference_pushes(family: str, seeds: Sequence[int]) -> list[Mapping[str, bool]]:
    """Those of these robots under the reference search; none, unless all are known."""
    file = RESULTS / f"reference_{family}.json"
    known = json.loads(file.read_text()).get("pushes", {}) if file.exists() else {}
    every = [known.get(str(seed)) for seed in seeds]
    return [push for pushes in every for push in pushes] if all(every) else []


def _with_due(robot: Mapping[str, Any]) -> Mapping[str, Any]:
    """A robot whose trials are judged by the rule that it is due, too."""
    rule = "sticky" if robot["reference"]["is_sticky"] else "default"

    def judged(trials: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
        return [{**trial, "due": trial[rule]} for trial in trials]

    steps = [{**step, "trials": judged(step["trials"])} for step in robot["iterations"]]
    minute = {"minute": judged(robot["minute"])} if "minute" in robot else {}
    return {**robot, "iterations": steps, **minute}


def robots(results: Mapping[str, Any]) -> list[str]:
    """One line a hidden robot."""
    names = (
        "robot, sticks, torque gain, dead zone, delay, friction, mass, COM height, COM offset, successes by update, "
    )
    names += "by the sticky rule, place [m], real s"
    lines = [f"| {names.replace(', ', ' | ')} |", "|" + "---|" * 13]
    for robot in results["robots"]:
        hidden, steps = robot["hidden"], robot["iterations"]
        places = [t["farthest"] for t in steps[robot["best"]]["trials"] if t["farthest"] is not None]
        seconds = seconds_to(robot, "default")
        by_rule = [", ".join(str(successes(step, rule)) for step in steps) for rule in RULES]
        lines.append(
            f"| {robot['seed']} | {'yes' if robot['reference']['is_sticky'] else 'no'} | {hidden['torque_gain']:.2f} "
            f"| {hidden['dead_zone']:.2g} N·m | {hidden['delay_ms']:.0f} ms | {hidden['coulomb_friction']:.2g} N·m "
            f"| × {hidden['body_mass']:.2f} | × {hidden['com_height']:.2f} | {hidden['com_offset_deg']:+.1f}° "
            f"| {' | '.join(by_rule)} | {f'{median(places):.2f}' if places else '-'} "
            f"| {'-' if seconds is None else f'{seconds:.1f}'} |"
        )
    return lines


def beside(results: Mapping[str, Any]) -> list[str]:
    """One line a recipe that learned robots of this family: seconds of driving, learning and deciding apart."""
    lines = [
        "| recipe | robots | solved | driven to learn, median / worst | driven to decide |",
        "|---|---|---|---|---|",
    ]
    for recipe in _BESIDE:
        file = RESULTS / f"hidden_robots_{results['family']}{recipe and f'_{recipe}'}.json"
        if file.exists():
            found = json.loads(file.read_text())["robots"]
            solved = sum(solved_at(robot, "default") is not None for robot in found)
            seconds = [_seconds(found, "default", name) for name in ("real_seconds", "trial_seconds")]
            lines.append(f"| {recipe or 'default'} | {len(found)} | {solved} | {' | '.join(seconds)} |")
    return lines


def paper(results: Mapping[str, Any]) -> list[str]:
    """One line a robot that the paper's own recipe learned, by the paper's own rule; and whether it stands a minute."""
    lines = [
        "| robot | successes by update, of ten | driven to learn | cost predicted / real, last | stands a minute |",
        "|---|---|---|---|---|",
    ]
    for robot in results["robots"]:
        steps, minute = robot["iterations"], robot["minute"]
        last, count = steps[-1], sum(trial["default"]["succeeded"] for trial in minute)
        cost = f"{last['predicted_cost']:.1f} / {last['real_cost']:.1f}"
        by_update = ", ".join(str(step["successes"]) for step in steps)
        lines.append(
            f"| {robot['seed']} | {by_update} | {last['real_seconds']:.1f} s | {cost} | {count} of {len(minute)} |"
        )
    return lines


def reachable(results: Mapping[str, Any]) -> list[str]:
    """What the reference search alone found."""
    found = results["robots"]
    reached = [robot for robot in found.values() if robot["reachable"]]
    missing = ", ".join(seed for seed, robot in found.items() if not robot["reachable"]) or "none"
    return [
        f"{len(reached)} of {len(found)} robots are reachable, {sum(r['tried'] == 1 for r in reached)} by the first "
        f"controller. Not reachable: {missing}."
    ]


def reproduced(results: Mapping[str, Any]) -> list[str]:
    """How many runs were made again by their own commands."""
    same = sum(run["same"] for run in results.values())
    different = ", ".join(name for name, run in results.items() if not run["same"]) or "none"
    artefacts = sum(run["artefacts"] for run in results.values())
    return [
        f"{same} of {len(results)} runs that were done by hand again made the same bytes ({artefacts} artefacts). "
        f"Different: {different}."
    ]


def _by_rule(found: Sequence[Mapping[str, Any]], figure: Callable[..., str], *more: Any) -> list[str]:
    return [figure(found, rule, *more) for rule in COLUMNS]


def _solved_within(found: Sequence[Mapping[str, Any]], rule: str, updates: int) -> str:
    after = [solved_at(robot, rule) for robot in found]
    return f"{sum(index is not None and index <= updates for index in after)}"


def _spread(found: Sequence[Mapping[str, Any]], rule: str, name: str, unit: str, form: str) -> str:
    """Over the successful trials of each robot's best policy."""
    trials = [trial for robot in found for trial in robot["iterations"][robot["best"]]["trials"]]
    return _median_worst([trial[name] for trial in trials if trial[rule]["succeeded"]], unit, form)


def _reference(found: Sequence[Mapping[str, Any]]) -> str:
    return _median_worst([robot["reference"]["oscillation"] for robot in found], "°", ".1f")


def _seconds(found: Sequence[Mapping[str, Any]], rule: str, name: str) -> str:
    """Seconds up to the first policy all of whose trials succeed; those of robots without one are endless."""
    values = [seconds_to(robot, rule, name) for robot in found]
    return _median_worst([inf if value is None else value for value in values], " s", ".1f")


def _minutes(found: Sequence[Mapping[str, Any]], rule: str) -> str:
    driven = [robot["minute"] for robot in found if "minute" in robot]
    return f"{sum(all(trial[rule]['succeeded'] for trial in trials) for trials in driven)} of {len(driven)}"


def _median_worst(values: Sequence[float], unit: str, form: str) -> str:
    if not values:
        return "-"
    return " / ".join("never" if each == inf else f"{each:{form}}{unit}" for each in (median(values), max(values)))


def figures(results: Mapping[str, Any]) -> list[str]:
    """One line a figure of the hidden effects."""
    return ["| figure | value |", "|---|---|", *(f"| {name} | {value} |" for name, value in results["figures"].items())]


def missed(results: Mapping[str, Any]) -> list[str]:
    """One entry a set that was not diagnosed right."""
    lines = []
    for row in results["sets"]:
        if not row["right"]:
            hidden = ", ".join(f"{n} ({next(iter(p.values())):.3g})" for n, p in row["hidden"].items()) or "nothing"
            said = ", ".join(row["said"]) or "nothing"
            entry = f"- {row['stratum']}: `{row['verdict']}`, named {said}. Hidden: {hidden}."
            lines += textwrap.wrap(entry, 118, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)
    return lines


def mending(results: Mapping[str, Any]) -> list[str]:
    """One line a robot of those that diagnose themselves while they learn."""
    names = "robot, trials that balance by update, real seconds without it, with it, gap closed, left for g, searches"
    lines = [f"| {names.replace(', ', ' | ')} |", "|" + "---|" * 7]
    falls = []
    for robot in results["robots"]:
        found = robot["diagnoses"]
        closed = ", ".join("-" if d["closed"] is None else f"{d['closed']:.0%}" for d in found) or "not enough data"
        left = [sum(d["left"]) / len(d["left"]) for d in found if "left" in d]
        falls += [1 - share for share in left]
        seconds = ["never" if s is None else f"{s:.1f}" for s in (robot["seconds_without"], robot["seconds_with"])]
        shares = ", ".join(f"{share:.0%}" for share in left) or "-"
        searches = ", ".join(str(d["searches"]) for d in found if "searches" in d) or "-"
        trials = " ".join(map(str, robot["successes"]))
        lines.append(f"| {robot['seed']} | {trials} | {' | '.join(seconds)} | {closed} | {shares} | {searches} |")
    both = [(r["seconds_without"], r["seconds_with"]) for r in results["robots"]]
    known = [(a, b) for a, b in both if a is not None and b is not None]
    fall = f"{median(falls):.0%}" if falls else "nothing mended"
    sums = (
        f"{sum(a for a, _ in known):.0f} s without and {sum(b for _, b in known):.0f} s with, over {len(known)} robots"
    )
    median_fall = f"Median fall of the variance that g must explain, where a simulation was corrected: {fall}."
    return [*lines, "", median_fall, f"Real seconds: {sums}."]


def times(results: Mapping[str, Any]) -> list[str]:
    """One line a case of the moment matching."""
    names = "engine, policy, samples, f's variance, CPU s, steps by pairs, all by pairs, cost off, gradient off, memory"
    lines = [f"| {names.replace(', ', ' | ')} |", "|" + "---|" * 10]
    for case in results["cases"]:
        s, r = case["settings"], case["result"]
        engine = "torchrl" if case["module"].endswith("peer") else "twbal"
        kept = "kept" if engine == "torchrl" or s["keep_variance"] else "dropped"
        samples = f"{s['n']} + {s['difference']}" if s.get("difference") else f"{s['n']}"
        optional = [f"{r[k]:{form}}" if k in r else "-" for k, form in _OPTIONAL.items()]
        lines.append(
            f"| {engine} | {s['policy']} | {samples} | {kept} | {r['cpu_s']:.3f} | {' | '.join(optional)} "
            f"| {r['memory_mb']:.0f} MB |"
        )
    return [*lines, "", where(results)]


def ratios(results: Mapping[str, Any]) -> list[str]:
    """How many times faster than the peer, whose time does not depend on the policy."""
    ours = {(c["settings"]["n"], c["settings"]["policy"]): c["result"]["cpu_s"] for c in with_variance(results)}
    lines = ["| samples | torchrl, CPU s | times faster: found policy | random policy |", "|---|---|---|---|"]
    for case in results["cases"]:
        if case["module"].endswith("peer"):
            n, seconds = case["settings"]["n"], case["result"]["cpu_s"]
            faster = [f"{seconds / ours[n, policy]:.0f}" for policy in ("found", "random")]
            lines.append(f"| {n} | {seconds:.2f} | {' | '.join(faster)} |")
    return lines


def with_variance(results: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Our cases with f's variance kept, as the peer keeps it."""
    return [case for case in results["cases"] if case["settings"].get("keep_variance")]


def steps(results: Mapping[str, Any]) -> list[str]:
    """Where the time of one step goes, one line a part and one column a size."""
    found = [case["result"] for case in results["cases"]]
    lines = [f"| µs a step, samples | {' | '.join(str(r['n']) for r in found)} |", "|---|" + "---|" * len(found)]
    for name, part in _STEP_PARTS.items():
        lines.append(f"| {name} | {' | '.join(f'{part(r):.0f}' for r in found)} |")
    return [*lines, "", where(results)]


_MEASURED_PARTS = ("sums_over_points_us", "policy_forward_us", "policy_back_us", "cost_us")
_STEP_PARTS: Mapping[str, Callable[[Mapping[str, Any]], float]] = {
    "sums over f's points: weights": lambda r: r["weights_us"],
    "sums over f's points: series": lambda r: r["sums_over_points_us"] - r["weights_us"],
    "policy, forward": lambda r: r["policy_forward_us"],
    "policy, back": lambda r: r["policy_back_us"],
    "cost": lambda r: r["cost_us"],
    "small matrices, and noise of these figures": lambda r: r["step_us"] - sum(r[part] for part in _MEASURED_PARTS),
    "**all**": lambda r: r["step_us"],
    "floor of the sums over points": lambda r: r["floor_us"],
}


def fits(results: Mapping[str, Any]) -> list[str]:
    """One line a size of the fits."""
    names = "samples, data sets, twbal: CPU s, BoTorch: CPU s a fit, evidence short of BoTorch's best of 20 [nats]"
    lines = [f"| {names.replace(', ', ' | ')}, worst | what the limits cost [nats], worst |", "|" + "---|" * 6]
    for n in sorted({case["settings"]["n"] for case in results["cases"]}):
        found = [case["result"] for case in results["cases"] if case["settings"]["n"] == n]
        lines.append(
            f"| {n} | {len(found)} | {median(r['cpu_s'] for r in found):.2f} "
            f"| {median(r['botorch_cpu_s'] for r in found):.2f} | {max(r['short_by'] for r in found):+.3f} "
            f"| {max(r['limits_cost'] for r in found):.1f} |"
        )
    return [*lines, "", where(results)]


def running(results: Mapping[str, Any]) -> list[str]:
    """Plant, collection and start."""
    found = {case["module"].rpartition(".")[-1]: case["result"] for case in results["cases"]}
    plant, collection, start, logs = (found[name] for name in ("plant", "collection", "start", "logs"))
    memory = f"{logs['import_memory_mb']:.0f} MB"
    rows = [
        ("control periods a second of the plant, beside a bare PyBullet loop", f"{plant['share_of_bare']:.2f}"),
        ("`sim-collect` on two processes, times faster than on one", f"{collection['times_faster']:.2f}"),
        (
            "`import-log` of 1,000,000 rows, s (CPU s, memory)",
            f"{logs['import_s']:.1f} ({logs['import_cpu_s']:.1f}, {memory})",
        ),
        (
            "reading an episode log, over the bare protobuf decoding of its messages",
            f"{logs['read_over_bare_decode']:.2f}",
        ),
        ("`twbal --help`, CPU s (an empty Python)", f"{start['help_cpu_s']:.2f} ({start['python_cpu_s']:.2f})"),
    ]
    return ["| figure | value |", "|---|---|", *(f"| {name} | {value} |" for name, value in rows), "", where(results)]


def validation(results: Mapping[str, Any]) -> list[str]:
    """One line a size of the validation of a policy."""
    lines = ["| samples of f | of g | CPU s | by PyTorch, CPU s | costs apart |", "|---|---|---|---|---|"]
    for case in results["cases"]:
        n, found = case["settings"], case["result"]
        times = f"{found['cpu_s']:.3f} | {found['torch_cpu_s']:.2f}"
        lines.append(f"| {n['f']} | {n['g']} | {times} | {found['gap']:.0e} |")
    return [*lines, "", where(results)]


def where(results: Mapping[str, Any]) -> str:
    """On what machine and when."""
    return f"{results['machine']}, {results['date']}."


_OPTIONAL = {"steps_by_pairs": "d", "pairs_cpu_s": ".3f", "cost_error": ".0e", "gradient_error": ".0e"}
PARTS: Mapping[str, Callable[..., list[str]]] = {
    "summary": summary,
    "robots": robots,
    "beside": beside,
    "paper": paper,
    "reachable": reachable,
    "reproduced": reproduced,
    "figures": figures,
    "missed": missed,
    "mending": mending,
    "times": times,
    "ratios": ratios,
    "steps": steps,
    "fits": fits,
    "running": running,
    "validation": validation,
    "prediction": lambda *families: prediction_table(families),
    "reliability": lambda *families: reliability_table(families),
}


def successes(iteration: Mapping[str, Any], rule: str) -> int:
    """Trials of an iteration that succeed by a rule."""
    return sum(trial[rule]["succeeded"] for trial in iteration["trials"])


def solved_at(robot: Mapping[str, Any], rule: str) -> int | None:
    """Updates after which all trials succeed for the first time; None where they never do."""
    steps = robot["iterations"]
    return next((s["index"] for s in steps if s["trials"] and successes(s, rule) == len(s["trials"])), None)


def seconds_to(robot: Mapping[str, Any], rule: str, name: str = "real_seconds") -> float | None:
    """Seconds for which the robot was driven up to there, to learn or (`trial_seconds`) to decide; None: never."""
    index = solved_at(robot, rule)
    if index is None:
        return None
    upto = robot["iterations"][: index + 1]
    return float(upto[-1][name] if name == "real_seconds" else sum(step[name] or 0.0 for step in upto))


if __name__ == "__main__":
    main(sys.argv[1:])
