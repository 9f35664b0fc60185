"""Algorithm 1 on hidden robots of a family, and beside it other recipes on the same ones.

    python -m benchmarks.hidden_robots family=hard [robots=20] [first_seed=781] [updates=6] [recipe=default] [workers=2]
        [results=benchmarks/results/hidden_robots_hard.json]

`robots` and `first_seed` are those of the docs' tables if not given. The README's table is made by `family=hard
first_seed=810 results=benchmarks/results/hidden_robots_hard_current.json`.

(1) The reference search tells what is reachable at all (`reference.py`); robots where it finds nothing are listed and
not learned. Consecutive seeds are taken until there are `robots` that are reachable. (2) `twbal iterate` learns each,
to at most `updates` updates, by the rule of success that is the default. (3) Its best policy stands a minute five
times, and on moderate robots is pushed ten times. All trials are judged by the default rule and by that for robots that
stick.

Runs lie in outputs/bench/hidden_robots/<family>/<recipe>; a robot that is done is not done again. Raw results go to
benchmarks/results/hidden_robots_<family>.json, or hidden_robots_<family>_<recipe>.json, after each robot, with
_from_<first_seed> where that is not the one of the tables. `results` is another file. A file that holds robots that are
not asked for is not replaced.
"""

import json
import sys
import threading
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple

from hydra import compose
from hydra.utils import instantiate

from benchmarks.hidden_robots.afterwards import push, stand_a_minute
from benchmarks.hidden_robots.data_sheet import with_integral_action
from benchmarks.hidden_robots.families import FAMILIES
from benchmarks.hidden_robots.pushes import RESULTS_OF_PUSHES
from benchmarks.hidden_robots.reached import References
from benchmarks.hidden_robots.record import iteration_records, robot_record
from benchmarks.hidden_robots.reference import Reached
from benchmarks.hidden_robots.robots import Workshop, identified, iterate, learn_words
from benchmarks.hidden_robots.tables import successes
from benchmarks.settings import refuse_to_replace, rows_in, text_settings
from twbal.cli.composition import composing
from twbal.core.channels import Channels
from twbal.core.files import write_atomically
from twbal.policies.saved import load_policy

ROOT = Path("outputs/bench/hidden_robots")
RESULTS = Path("benchmarks/results")
DEFAULTS = {
    "family": "",
    "robots": "",
    "first_seed": "",
    "updates": "6",
    "recipe": "default",
    "workers": "2",
    "results": "",
}
INTEGRAL = "lqr_integral"
"""The data sheet's regulator with integral action; twbal's own (`lqr`) leaves the place alone, so it is made here."""


class Recipe(NamedTuple):
    """A way to learn.

    Attributes:
        words: settings of `twbal iterate`.
        state: choice of the state that its policies see.
        learns: whether it makes updates.
        is_identified: whether one rollout with an exciting command identifies the robot before.
    """

    words: tuple[str, ...] = ()
    state: str = "default"
    learns: bool = True
    is_identified: bool = False


RECIPES = {
    "default": Recipe(),
    "paper": Recipe(("experiment=paper",), "paper"),
    "one_simulation": Recipe(("method=one_simulation",)),
    "pilco": Recipe(("method=pilco",)),
    "lqr": Recipe(("method=lqr",), learns=False),
    "lqr_identified": Recipe(("method=lqr_identified",)),
    INTEGRAL: Recipe(learns=False),
    "identified": Recipe(("updates=0", "improve=false", "calibration_rollouts=0"), learns=False, is_identified=True),
}


class Bench:
    """Robots of one family, learned by one recipe.

    Args:
        family: its name.
        recipe: its name.
        updates: at most.
    """

    def __init__(self, family: str, recipe: str, updates: int) -> None:
        self._family, self._recipe, self._updates = family, RECIPES[recipe], updates
        self._is_integral = recipe == INTEGRAL
        self._root = ROOT / family / recipe
        self._workshop = Workshop(FAMILIES[family])
        with composing():
            composed = compose(
                "real_rollout", [f"robot={FAMILIES[family].sheet}", f"state={self._recipe.state}", "policy.path=none"]
            )
            self._channels: Channels = instantiate(composed.state)

    def learn(self, seed: int, reference: Reached) -> dict[str, Any]:
        """All that is to be known about one robot."""
        folder = self._root / f"robot_{seed}"
        file = folder / "result.json"
        if file.exists():
            done: dict[str, Any] = json.loads(file.read_text())
            return done
        shop = self._workshop
        known = {"seed": seed, **robot_record(shop.truth(seed), shop.sheet, reference)}
        found = {**known, **(with_integral_action(shop, seed) if self._is_integral else self._iterated(folder, seed))}
        folder.mkdir(parents=True, exist_ok=True)
        write_atomically(file, json.dumps(found, indent=1) + "\n")
        return found

    def _iterated(self, folder: Path, seed: int) -> dict[str, Any]:
        """What `twbal iterate` came to."""
        updates = [f"updates={self._updates}"] if self._recipe.learns else []
        words = [*learn_words(self._family, seed), *self._recipe.words, f"seed={seed}", *updates]
        before: dict[str, Any] = {}
        if self._recipe.is_identified:
            told = identified(folder / "before", self._family, seed)
            words, before = [*words, *told.words], {"seconds_before": told.seconds}
        summary = iterate(folder, words)
        iterations = iteration_records(folder, summary, self._workshop.rules)
        return {"best": summary["best_iteration"], **before, "iterations": iterations, **self._afterwards(folder, seed)}

    def _afterwards(self, folder: Path, seed: int) -> dict[str, Any]:
        """The best policy for a minute, and pushed where robots are moderate."""
        policy, shop = folder / "best_policy.pt", self._workshop
        words = [*learn_words(self._family, seed), f"state={self._recipe.state}", f"seed={seed}"]
        found: dict[str, Any] = {"minute": stand_a_minute(folder / "minute", policy, words, shop.sheet, shop.rules)}
        return {**found, **self._pushed(folder, seed)}

    def _pushed(self, folder: Path, seed: int) -> dict[str, Any]:
        """What becomes of pushes where robots are moderate; only a policy that sees its place can yield."""
        shop, names = self._workshop, list(self._channels.names)
        if FAMILIES[self._family].faults != "moderate":
            return {}
        driver, found = load_policy(str(folder / "best_policy.pt"), names), dict[str, Any]()
        for name, yields in RESULTS_OF_PUSHES.items():
            if not yields or "position" in names:
                with shop.robot(seed) as robot:
                    found[name] = push(robot, driver, self._channels, shop.sheet, shop.rules.default, yields)
        return found


def reachable(references: References, first_seed: int, robots: int) -> tuple[dict[int, Reached], list[int]]:
    """The first robots from a seed on that are reachable, and the seeds of those before the last that are not."""
    found: dict[int, Reached] = {}
    unreachable: list[int] = []
    for seed in count(first_seed):
        if len(found) == robots:
            break
        reference = references.of(seed)
        if reference.reachable:
            found[seed] = reference
        else:
            unreachable.append(seed)
    return found, unreachable


def _name(family: str, recipe: str, first_seed: int) -> str:
    """What a file of results is called that holds robots from a seed on."""
    name = family if recipe == "default" else f"{family}_{recipe}"
    return name if first_seed == FAMILIES[family].first_seed else f"{name}_from_{first_seed}"


def main(words: Sequence[str]) -> None:
    """Run with settings of the form key=value."""
    settings = text_settings(DEFAULTS, words)
    family, recipe = settings["family"], settings["recipe"]
    if family not in FAMILIES or recipe not in RECIPES:
        raise SystemExit(f"family is one of {', '.join(FAMILIES)}, recipe one of {', '.join(RECIPES)}.")
    first = int(settings["first_seed"] or FAMILIES[family].first_seed)
    robots, updates = int(settings["robots"] or FAMILIES[family].robots), int(settings["updates"])
    chosen, unreachable = reachable(References(family), first, robots)
    target = Path(settings["results"] or RESULTS / f"hidden_robots_{_name(family, recipe, first)}.json")
    refuse_to_replace(target, (row["seed"] for row in rows_in(target, "robots")), chosen)
    bench, lock, done = Bench(family, recipe, updates), threading.Lock(), dict[int, Any]()
    head = {"family": family, "recipe": recipe, "first_seed": first, "updates": updates, "unreachable": unreachable}

    def learn(seed: int) -> None:
        found = bench.learn(seed, chosen[seed])
        with lock:
            done[seed] = found
            learned = [done[each] for each in sorted(done)]
            write_atomically(target, json.dumps({**head, "robots": learned}, indent=1) + "\n")
            by_update = [successes(each, "default") for each in found["iterations"] if each["trials"]]
            print(f"{family} {seed}: {by_update} successes by update", flush=True)

    with ThreadPoolExecutor(int(settings["workers"])) as pool:
        list(pool.map(learn, chosen))


if __name__ == "__main__":
    main(sys.argv[1:])
