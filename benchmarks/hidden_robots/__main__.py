"""Run the benchmark: `python -m benchmarks.hidden_robots [recipe=default] [robots=20] [first_seed=8000] [updates=6]`.

For each hidden robot: (1) the data sheet's regulator drops it, else it is passed over; (2) a policy searched on the
simulation with the nearest effects balances it, else it is drawn anew; (3) Algorithm 1 learns it, from simulation alone
to at most `updates` updates, by a recipe: the default, `paper` (the paper's own) or `one_simulation`. `workers=2`: how
many at a time. What is done already in outputs/bench/hidden_robots is not done again. Raw results go to
benchmarks/results/hidden_robots.json, or hidden_robots_<recipe>.json.
"""

import json
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from itertools import islice
from pathlib import Path
from typing import Any

from benchmarks.hidden_robots.robots import Drawn, as_simulation, dropped_by_the_data_sheet, iterate

ROOT = Path("outputs/bench/hidden_robots")
RESULTS = Path("benchmarks/results/hidden_robots.json")
ALL = 10  # trials of each policy
RECIPES = {"default": [], "paper": ["experiment=paper"], "one_simulation": ["method=one_simulation"]}


def learn(robot: Drawn, updates: int, recipe: str) -> dict[str, Any] | None:
    """All that is to be known about one robot; None where it is drawn anew."""
    seed = robot.seed
    folder = ROOT / f"robot_{seed}"
    truth = iterate(
        folder / "truth", [f"link.seed={seed}", "updates=0", "ensemble=none", *as_simulation(robot.effects)]
    )
    known: Any = truth["iterations"]
    if known[-1]["successes"] < ALL:
        print(f"robot {seed}: {known[-1]['successes']} of {ALL} with the true dynamics, drawn anew", flush=True)
        return None
    words = [f"seed={seed}", f"link.seed={seed}", f"updates={updates}", *RECIPES[recipe]]
    summary = iterate(folder / recipe, words)
    found: Any = summary["iterations"]
    print(f"robot {seed}: {[i['successes'] for i in found]} of {ALL} by update", flush=True)
    keep = ("index", "successes", "trials", "coverage95", "real_seconds", "real_cost", "predicted_cost", "drift_m")
    return {"seed": seed, "hidden": asdict(robot.truth), "iterations": [{k: i[k] for k in keep} for i in found]}


def main(words: Sequence[str]) -> None:
    """Run with settings of the form key=value."""
    settings = dict(word.split("=", 1) for word in words)
    robots, first, updates, workers = (
        int(settings.pop(name, default))
        for name, default in (("robots", "20"), ("first_seed", "8000"), ("updates", "6"), ("workers", "2"))
    )
    recipe = settings.pop("recipe", "default")
    if settings or recipe not in RECIPES:
        raise SystemExit(f"unknown settings: {', '.join(settings) or f'recipe={recipe}'}")
    source = dropped_by_the_data_sheet(first)
    done: list[dict[str, Any]] = []
    tried = 0
    with ThreadPoolExecutor(workers) as pool:
        while len(done) < robots:
            batch = list(islice(source, robots - len(done)))
            tried += len(batch)
            found = pool.map(lambda drawn: learn(drawn, updates, recipe), batch)
            done += [result for result in found if result is not None]
    results = {
        "recipe": recipe,
        "first_seed": first,
        "drawn_until": max(r["seed"] for r in done),
        "dropped_by_the_data_sheet": tried,
        "robots": sorted(done, key=lambda r: r["seed"]),
    }
    target = RESULTS if recipe == "default" else RESULTS.with_name(f"hidden_robots_{recipe}.json")
    target.parent.mkdir(exist_ok=True)
    target.write_text(json.dumps(results, indent=1) + "\n")
    print(f"{target} written")


if __name__ == "__main__":
    main(sys.argv[1:])
