"""Fill the README with what the tool itself drew and measured.

    python scripts/readme.py tables                the tables, from benchmarks/results/*.json
    python scripts/readme.py pictures <run folder> the pictures and the film, from a run of `twbal iterate`
    python scripts/readme.py paper <run folder>    those of the paper's own recipe, from a run with experiment=paper
    python scripts/readme.py diagnosis <run folder> the picture of a gap, from a run of `twbal diagnose`
    python scripts/readme.py free_form <hidden> <seed> the curve that was drawn of it, by benchmarks.free_form

Nothing in these tables is typed by hand.
"""

import json
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))  # `benchmarks` is not installed

from benchmarks.agreement.tables import agreement  # noqa: E402
from benchmarks.calibration.tables import calibration_table, other_robots_reliability  # noqa: E402
from benchmarks.diagnosis_tables import figures, mending, missed  # noqa: E402
from benchmarks.driving.tables import driving, misses  # noqa: E402
from benchmarks.effects_shown.tables import effects_shown  # noqa: E402
from benchmarks.free_form.tables import PARTS as FREE_FORM  # noqa: E402
from benchmarks.hidden_robots.ahead import default_seeds, pilco_ahead  # noqa: E402
from benchmarks.hidden_robots.prediction import prediction_table, reliability_table  # noqa: E402
from benchmarks.hidden_robots.tables import (  # noqa: E402
    beside,
    first_policies,
    paper,
    reachable,
    reproduced,
    robots,
    summary,
    three_seeds,
)
from benchmarks.import_tables import import_checks, import_misses  # noqa: E402
from benchmarks.latency.tables import (  # noqa: E402
    keys,
    latency,
    latency_asked,
    latency_histogram,
    line_alone,
    losses,
    viewed,
)
from benchmarks.link_faults.tables import link_fault_misses, link_faults  # noqa: E402
from benchmarks.link_fuzz.tables import link_noise, link_sessions  # noqa: E402
from benchmarks.on_boards.__main__ import on_board_cycles  # noqa: E402
from benchmarks.on_boards.agreement import on_board_agreement  # noqa: E402
from benchmarks.on_boards.distilling import distilled_policies  # noqa: E402
from benchmarks.on_firmware.tables import on_firmware  # noqa: E402
from benchmarks.other_robots.power import POWER_PARTS  # noqa: E402
from benchmarks.other_robots.tables import PARTS as OTHER_ROBOTS  # noqa: E402
from benchmarks.other_robots.versions import VERSIONS  # noqa: E402
from benchmarks.robustness.tables import robustness  # noqa: E402
from benchmarks.speed_tables import fits, ratios, running, steps, times, validation  # noqa: E402
from benchmarks.what_next.tables import PARTS as WHAT_NEXT  # noqa: E402
from benchmarks.whole_run import whole_run  # noqa: E402
from twbal.diagnosis.free_form_record import FreeForm  # noqa: E402
from twbal.viz.canvas import save  # noqa: E402
from twbal.viz.free_form_figure import free_form_figure  # noqa: E402

RESULTS = ROOT / "benchmarks" / "results"
PICTURES = ROOT / "docs" / "pictures"
PAGES = (
    ROOT / "README.md",
    *(
        ROOT / "docs" / f"{name}.md"
        for name in (
            *("diagnose", "methods", "benchmarks", "benchmarks_diagnosis", "speed", "import", "firmware"),
            *("protocol", "robustness"),
        )
    ),
)


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
        case ["free_form", hidden, seed]:
            draw_curve(hidden, int(seed))
        case _:
            raise SystemExit(__doc__)


def copy_pictures(figures: Path, target: Path, names: Sequence[str] = ("tilt", "learning", "drift", "cost")) -> None:
    """The pictures of a run that the pages show, with its first prediction, and its last as `prediction_last`."""
    target.mkdir(parents=True, exist_ok=True)
    predictions = sorted(figures.glob("prediction_*.svg"), key=lambda path: int(path.stem.split("_")[1]))
    shown = {name: figures / f"{name}.svg" for name in (*names, "prediction_0")}
    for name, picture in {**shown, "prediction_last": predictions[-1]}.items():
        shutil.copy(picture, target / f"{name}.svg")


def draw_curve(hidden: str, seed: int) -> None:
    """The curve that the benchmark has of something hidden, as a report of `twbal diagnose` draws it."""
    rows = json.loads((RESULTS / "free_form.json").read_text())["sets"]
    drawn = next(row["drawn"] for row in rows if (row["hidden"], row["seed"]) == (hidden, seed))
    save(free_form_figure(FreeForm(**drawn)), PICTURES / "free_form.svg")


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

    return re.sub(r"<!-- table ([\w\s]+) -->.*?<!-- end -->", table, page, flags=re.DOTALL)


PARTS: Mapping[str, Callable[..., list[str]]] = {
    "summary": summary,
    "first_policies": first_policies,
    "three_seeds": three_seeds,
    "pilco_ahead": pilco_ahead,
    "default_seeds": default_seeds,
    "robots": robots,
    "beside": beside,
    "paper": paper,
    "robustness": robustness,
    "reachable": reachable,
    "reproduced": reproduced,
    "driving": driving,
    "misses": misses,
    "figures": figures,
    "missed": missed,
    "mending": mending,
    **OTHER_ROBOTS,
    **VERSIONS,
    **POWER_PARTS,
    "calibration": calibration_table,
    "other_robots_reliability": other_robots_reliability,
    "effects_shown": effects_shown,
    **WHAT_NEXT,
    "agreement": agreement,
    **FREE_FORM,
    "times": times,
    "ratios": ratios,
    "steps": steps,
    "fits": fits,
    "running": running,
    "validation": validation,
    "whole_run": whole_run,
    "on_firmware": on_firmware,
    "latency": latency,
    "latency_asked": latency_asked,
    "latency_histogram": latency_histogram,
    "line_alone": line_alone,
    "keys": keys,
    "viewed": viewed,
    "losses": losses,
    "import_checks": import_checks,
    "import_misses": import_misses,
    "link_faults": link_faults,
    "link_fault_misses": link_fault_misses,
    "link_noise": link_noise,
    "on_board_cycles": on_board_cycles,
    "on_board_agreement": on_board_agreement,
    "distilled_policies": distilled_policies,
    "link_sessions": link_sessions,
    "prediction": lambda *families: prediction_table(families),
    "reliability": lambda *families: reliability_table(families),
}


if __name__ == "__main__":
    main(sys.argv[1:])
