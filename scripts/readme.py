"""Fill the README with what the tool itself drew and measured.

    python scripts/readme.py tables                the tables, from benchmarks/results/*.json
    python scripts/readme.py pictures <run folder> the pictures, from the figures/ of a run of `twbal iterate`

Nothing in these tables is typed by hand.
"""

import json
import re
import shutil
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import Any

HOUSE = Path(__file__).resolve().parent.parent
RESULTS = HOUSE / "benchmarks" / "results"
PICTURES = HOUSE / "docs" / "pictures"
PAGES = (HOUSE / "README.md", HOUSE / "docs" / "benchmarks.md")
BAND = (0.85, 0.99)  # where the share inside a 95 % band should lie


def main(words: Sequence[str]) -> None:
    """Do what the first word says."""
    match words:
        case ["tables"]:
            for page in PAGES:
                page.write_text(filled(page.read_text()))
        case ["pictures", folder]:
            copy_pictures(Path(folder) / "figures")
        case _:
            raise SystemExit(__doc__)


def copy_pictures(figures: Path) -> None:
    """The pictures of a run that the pages show; its last prediction as `prediction_last`."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    predictions = sorted(figures.glob("prediction_*.svg"), key=lambda path: int(path.stem.split("_")[1]))
    shown = {name: figures / f"{name}.svg" for name in ("tilt", "learning", "drift", "cost", "prediction_0")}
    for name, picture in {**shown, "prediction_last": predictions[-1]}.items():
        shutil.copy(picture, PICTURES / f"{name}.svg")


def filled(page: str) -> str:
    """`page` with each `<!-- table NAME -->...<!-- end -->` filled anew."""

    def table(found: re.Match[str]) -> str:
        name = found.group(1)
        part, _, file = name.partition(" of ")
        results = json.loads((RESULTS / f"{file}.json").read_text())
        lines = {"summary": summary, "robots": robots, "figures": figures, "missed": missed, "times": times}[part](
            results
        )
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
    inside = sum(c is not None and BAND[0] <= c <= BAND[1] for c in last)
    rows = [
        ("robots", f"{len(found)}"),
        ("trials that the policy from f alone balances", f"{alone} of {trials} ({alone / trials:.0%})"),
        ("robots at 10 of 10 within 3 updates", f"{sum(f is not None and f <= 3 for f in first)}"),
        ("robots at 10 of 10 within 6 updates", f"{sum(f is not None and f <= 6 for f in first)}"),
        ("real seconds driven up to there, median (worst)", f"{median(solved):.1f} s ({solved[-1]:.1f} s)"),
        (f"robots with {BAND[0]:g}-{BAND[1]:g} of the real states in the last 95 % band", f"{inside}"),
        ("share in the first band (f alone), median", f"{median(r['iterations'][0]['coverage95'] for r in found):.2f}"),
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
    """One line a set that was not diagnosed right."""
    lines = ["| stratum | hidden | verdict | named |", "|---|---|---|---|"]
    for row in results["sets"]:
        if not row["right"]:
            hidden = ", ".join(f"{n} ({next(iter(p.values())):.3g})" for n, p in row["hidden"].items()) or "nothing"
            lines.append(f"| {row['stratum']} | {hidden} | {row['verdict']} | {', '.join(row['said']) or '-'} |")
    return lines


def times(results: Mapping[str, Any]) -> list[str]:
    """One line a case of the moment matching."""
    names = "engine, policy, samples, f's variance, CPU s, by pairs alone, cost off by, gradient off by, peak memory"
    lines = [f"| {names.replace(', ', ' | ')} |", "|" + "---|" * 9]
    for case in results["cases"]:
        s, r = case["settings"], case["result"]
        engine = "torchrl" if case["module"] == "peer" else "twbal"
        kept = "kept" if engine == "torchrl" or s["keep_variance"] else "dropped"
        samples = f"{s['n']} + {s['difference']}" if s.get("difference") else f"{s['n']}"
        optional = [f"{r[k]:{form}}" if k in r else "-" for k, form in _OPTIONAL.items()]
        lines.append(
            f"| {engine} | {s['policy']} | {samples} | {kept} | {r['cpu_s']:.3f} | {' | '.join(optional)} "
            f"| {r['memory_mb']:.0f} MB |"
        )
    return lines


_OPTIONAL = {"pairs_cpu_s": ".3f", "cost_error": ".0e", "gradient_error": ".0e"}


def solved_at(robot: Mapping[str, Any]) -> int | None:
    """Updates after which all trials balance for the first time; None where they never do."""
    return next((s["index"] for s in robot["iterations"] if s["successes"] == s["trials"]), None)


def seconds_to(robot: Mapping[str, Any]) -> float | None:
    """Seconds for which the robot was driven up to there (trials not counted); None where they never all balance."""
    index = solved_at(robot)
    return None if index is None else float(robot["iterations"][index]["real_seconds"])


if __name__ == "__main__":
    main(sys.argv[1:])
