"""Fill the README with what the tool itself drew and measured.

    python scripts/readme.py tables                the tables, from benchmarks/results/*.json
    python scripts/readme.py pictures <run folder> the pictures and the film, from a run of `twbal iterate`
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
from pathlib import Path
from statistics import median
from typing import Any

HOUSE = Path(__file__).resolve().parent.parent
RESULTS = HOUSE / "benchmarks" / "results"
PICTURES = HOUSE / "docs" / "pictures"
PAGES = (HOUSE / "README.md", *(HOUSE / "docs" / name for name in ("methods.md", "benchmarks.md", "speed.md")))
BAND = (0.85, 0.99)  # where the share inside a 95 % band should lie


def main(words: Sequence[str]) -> None:
    """Do what the first word says."""
    match words:
        case ["tables"]:
            for page in PAGES:
                page.write_text(filled(page.read_text()))
        case ["pictures", folder]:
            copy_pictures(Path(folder) / "figures")
            draw_film(Path(folder))
        case ["diagnosis", folder]:
            shutil.copy(Path(folder) / "figures" / "gap.svg", PICTURES / "gap.svg")
        case _:
            raise SystemExit(__doc__)


def copy_pictures(figures: Path) -> None:
    """The pictures of a run that the pages show; its last prediction as `prediction_last`."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    predictions = sorted(figures.glob("prediction_*.svg"), key=lambda path: int(path.stem.split("_")[1]))
    shown = {name: figures / f"{name}.svg" for name in ("tilt", "learning", "drift", "cost", "prediction_0")}
    for name, picture in {**shown, "prediction_last": predictions[-1]}.items():
        shutil.copy(picture, PICTURES / f"{name}.svg")


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
    """`page` with each `<!-- table NAME -->...<!-- end -->` filled anew."""

    def table(found: re.Match[str]) -> str:
        name = found.group(1)
        part, _, file = name.partition(" of ")
        measured = RESULTS / f"{file}.json"
        lines = PARTS[part](json.loads(measured.read_text())) if measured.exists() else ["Not measured yet."]
        return "\n".join([f"<!-- table {name} -->", *lines, "<!-- end -->"])

    return re.sub(r"<!-- table ([\w ]+) -->.*?<!-- end -->", table, page, flags=re.DOTALL)


def summary(results: Mapping[str, Any]) -> list[str]:
    """One line a figure."""
    found = results["robots"]
    first = [solved_at(robot) for robot in found]
    seconds = [seconds_to(robot) for robot in found]
    solved = sorted(s for s in seconds if s is not None)
    alone = sum(robot["iterations"][0]["successes"] for robot in found)
    trials = sum(robot["iterations"][0]["trials"] for robot in found)
    last = [robot["iterations"][-1]["coverage95"] for robot in found]
    updates = max(robot["iterations"][-1]["index"] for robot in found)
    inside = sum(c is not None and BAND[0] <= c <= BAND[1] for c in last)
    rows = [
        ("robots", f"{len(found)}"),
        ("successful trials of policy 0, before any real data", f"{alone} of {trials} ({alone / trials:.0%})"),
        ("robots at 10 of 10 within 3 updates", f"{sum(f is not None and f <= 3 for f in first)}"),
        *([("robots at 10 of 10 within 6 updates", f"{sum(f is not None and f <= 6 for f in first)}")] * (updates > 4)),
        ("real seconds driven until 10 of 10, median (worst)", f"{median(solved):.1f} s ({solved[-1]:.1f} s)"),
        (f"robots with {BAND[0]:g}-{BAND[1]:g} of the real states in the last 95 % band", f"{inside}"),
        (
            "share in the first band, before any real data, median",
            f"{median(r['iterations'][0]['coverage95'] for r in found):.2f}",
        ),
        ("share in the last band, median", f"{median(c for c in last if c is not None):.2f}"),
    ]
    return ["| figure | value |", "|---|---|", *(f"| {name} | {value} |" for name, value in rows)]


def robots(results: Mapping[str, Any]) -> list[str]:
    """One line a robot."""
    names = "robot, torque gain, dead zone, delay, mass, COM height, COM offset, balance by update, real s, in band"
    lines = [f"| {names.replace(', ', ' | ')} |", "|" + "---|" * 10]
    for robot in results["robots"]:
        hidden, steps = robot["hidden"], robot["iterations"]
        seconds = seconds_to(robot)
        lines.append(
            f"| {robot['seed']} | {hidden['TorqueGain']['gain']:.2f} | {hidden['DeadZone']['width']:.1f} N·m "
            f"| {1000 * hidden['ActuationDelay']['delay']:.0f} ms | × {hidden['BodyMass']['factor']:.2f} "
            f"| × {hidden['ComHeight']['factor']:.2f} | {57.2958 * hidden['ComOffset']['angle']:+.1f}° "
            f"| {', '.join(str(step['successes']) for step in steps)} "
            f"| {'-' if seconds is None else f'{seconds:.1f}'} | {steps[-1]['coverage95']:.2f} |"
        )
    return lines


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


def methods(results: Mapping[str, Any]) -> list[str]:
    """One line a method, beside the main one."""
    shown = {"seconds": "real seconds", "cost": "real cost", "coverage": "in the band", "drift": "drift [m]"}
    names = ["method", "balanced", *shown.values(), "fits, searches [s]", "better, worse, p"]
    lines = [f"| {' | '.join(names)} |", "|" + "---|" * len(names)]
    for row in results["methods"]:
        beside = row["seconds_p"]
        if not row["runs"]:
            continue
        cells = [row["method"], f"{row['solved']} of {row['runs']}"]
        cells += [(row[metric] or "-").replace(" to ", "-") for metric in shown]
        cells.append((row["search"] or "-").split(" ")[0])
        cells.append(f"{beside['better']}, {beside['worse']}, {beside['p']:.2g}" if beside["pairs"] else "-")
        lines.append(f"| {' | '.join(map(str, cells))} |")
    robots = ", ".join(map(str, results["robots"]))
    took = f"The runs took {results['work_s'] / 60:.0f} minutes together, {results['machine']}."
    return [*lines, "", f"Robots {robots}.", took]


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


def where(results: Mapping[str, Any]) -> str:
    """On what machine and when."""
    return f"{results['machine']}, {results['date']}."


_OPTIONAL = {"steps_by_pairs": "d", "pairs_cpu_s": ".3f", "cost_error": ".0e", "gradient_error": ".0e"}
PARTS: Mapping[str, Callable[[Mapping[str, Any]], list[str]]] = {
    "summary": summary,
    "robots": robots,
    "figures": figures,
    "missed": missed,
    "mending": mending,
    "methods": methods,
    "times": times,
    "ratios": ratios,
    "steps": steps,
    "fits": fits,
    "running": running,
}


def solved_at(robot: Mapping[str, Any]) -> int | None:
    """Updates after which all trials balance for the first time; None where they never do."""
    return next((s["index"] for s in robot["iterations"] if s["successes"] == s["trials"]), None)


def seconds_to(robot: Mapping[str, Any]) -> float | None:
    """Seconds for which the robot was driven up to there (trials not counted); None where they never all balance."""
    index = solved_at(robot)
    return None if index is None else float(robot["iterations"][index]["real_seconds"])


if __name__ == "__main__":
    main(sys.argv[1:])
