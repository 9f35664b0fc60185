"""Run the benchmark: `python -m benchmarks.mending [robots=10] [workers=2]`.

The first robots of benchmarks/results/hidden_robots_hard_one_simulation.json once more, with `iterate diagnose=true`.
For each: the variance of what f leaves of the real transitions at the time (which g must explain) with the f of the
data sheet and with that of the mended simulation, channel by channel; how often a policy was searched until it balanced
in that simulation (`search_retries`); and the real seconds up to 10 of 10 beside those without. What is done already in
outputs/bench/mending is not done again. Results go to benchmarks/results/mending.json.
"""

import json
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from benchmarks.hidden_robots.robots import iterate
from benchmarks.hidden_robots.tables import successes
from benchmarks.settings import number_settings
from twbal.algorithm.model_file import load_model
from twbal.core.gaussian import Array
from twbal.io.logs import read_episodes
from twbal.models.dataset import residuals, transitions

ROOT = Path("outputs/bench/mending")
RESULTS = Path("benchmarks/results")
UPDATES, ALL = 6, 10


def left_over(model: Path, rollouts: Sequence[Path]) -> Array:
    """Variance of what the f of a model leaves of real transitions, per channel."""
    dynamics = load_model(model).model
    episodes = [episode for rollout in rollouts for episode in read_episodes(rollout / "episodes")]
    return np.asarray((residuals(transitions(episodes, dynamics.channels), dynamics.f).targets ** 2).mean(axis=0))


def mended(folder: Path) -> list[dict[str, Any]]:
    """What became of each diagnosis of a run."""
    first = max(folder.glob("simulation/*_model"), key=lambda path: path.name) / "model.pt"
    found = []
    for place in sorted(folder.glob("iteration_*"), key=lambda path: int(path.name.split("_")[1])):
        if not (place / "diagnosis" / "diagnosis.json").exists():
            continue
        diagnosis = json.loads((place / "diagnosis" / "diagnosis.json").read_text())
        entry: dict[str, Any] = {"update": int(place.name.split("_")[1]), "closed": diagnosis["gap"]["closed"]}
        models = [place / "sim_model" / "model.pt", *sorted(place.glob("again_*/sim_model/model.pt"))]
        if models[0].exists():
            inputs = json.loads((place / "diagnosis" / "manifest.json").read_text())["inputs"]["episodes"]
            rollouts = sorted({Path(record["path"]).parents[1] for record in inputs})
            before, after = (left_over(model, rollouts) for model in (first, models[-1]))
            entry |= {"left": (after / before).tolist(), "searches": len(models)}
        found.append(entry)
    return found


def seconds_to_all(iterations: Sequence[dict[str, Any]]) -> float | None:
    """Real seconds driven up to the first policy with all trials balanced; None without one."""
    return next((i["real_seconds"] for i in iterations if i["successes"] == ALL), None)


def learn(known: dict[str, Any]) -> dict[str, Any]:
    """One robot with diagnoses, beside what is known of it without."""
    seed = known["seed"]
    folder = ROOT / f"robot_{seed}"
    words = [f"seed={seed}", f"link.seed={seed}", f"updates={UPDATES}", "method=one_simulation", "diagnose=true"]
    found: Any = iterate(folder, words)["iterations"]
    result = {
        "seed": seed,
        "successes": [i["successes"] for i in found],
        "seconds_without": seconds_to_all([{**i, "successes": successes(i, "default")} for i in known["iterations"]]),
        "seconds_with": seconds_to_all(found),
        "diagnoses": mended(folder),
    }
    print(result, flush=True)
    return result


def main(words: Sequence[str]) -> None:
    """Run with settings of the form key=value."""
    settings = number_settings({"robots": 10, "workers": 2}, words)
    known = json.loads((RESULTS / "hidden_robots_hard_one_simulation.json").read_text())["robots"][: settings["robots"]]
    with ThreadPoolExecutor(settings["workers"]) as pool:
        found = list(pool.map(learn, known))
    (RESULTS / "mending.json").write_text(json.dumps({"updates": UPDATES, "robots": found}, indent=1) + "\n")
    falls = [1 - float(np.mean(d["left"])) for r in found for d in r["diagnoses"] if "left" in d]
    if falls:
        print(f"median fall of the variance: {median(falls):.0%}, over {len(falls)} mended simulations")


if __name__ == "__main__":
    main(sys.argv[1:])
