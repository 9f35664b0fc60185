"""What policies survive that were learned once, by several methods on the same robots.

    python -m benchmarks.robustness [robots=5] [first_seed=880] [trials=2]

Each recipe of `RECIPES` in benchmarks/hidden_robots learns the moderate robots with seeds from `first_seed` on, with
six updates at most. Its best policy drives the robot changed along six axes, as in `twbal compare robustness=true`,
with the levels of conf/compare.yaml. What is done already in outputs/bench/robustness is not done again.
Raw results go to benchmarks/results/robustness.json, the chart to docs/pictures/robustness.svg, after each robot.
"""

import json
import sys
from collections.abc import Sequence
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

from hydra import compose
from hydra.utils import instantiate

from benchmarks.hidden_robots.__main__ import INTEGRAL, RECIPES
from benchmarks.hidden_robots.families import FAMILIES
from benchmarks.hidden_robots.robots import Workshop, iterate, learn_words
from benchmarks.robustness.integral_policy import IntegralPolicy
from benchmarks.settings import text_settings
from twbal.algorithm.perturbations import Perturbations
from twbal.algorithm.robustness import (
    MethodRobustness,
    PolicyRobustness,
    Robustness,
    axes_of,
    policy_robustness,
)
from twbal.cli.composition import composing
from twbal.cli.manifest import read_manifest
from twbal.core.channels import Channels
from twbal.core.files import write_atomically
from twbal.core.json_records import encoded, read_record, write_record
from twbal.policies.saved import load_policy
from twbal.viz.canvas import svg
from twbal.viz.robustness_figure import robustness_figure

ROOT = Path("outputs/bench/robustness")
RESULTS = Path("benchmarks/results/robustness.json")
PICTURE = Path("docs/pictures/robustness.svg")
FAMILY = "moderate"
METHODS = ("default", "pilco", "paper", "lqr", INTEGRAL, "lqr_identified")
UPDATES = 6
DEFAULTS = {"robots": "5", "first_seed": "880", "trials": "2"}


def perturbations(trials: int) -> Perturbations:
    """Those of `twbal compare`, with so many trials a level and robot."""
    with composing():
        found: Perturbations = instantiate(compose("compare", ["runs=none"]).perturbation)
    return replace(found, trials=trials)


def learned(recipe: str, seed: int) -> Path:
    """The best policy of a recipe for a robot, which is learned where it is not there."""
    folder, how = ROOT / recipe / f"robot_{seed}", RECIPES[recipe]
    updates = [f"updates={UPDATES}"] if how.learns else []
    made = read_manifest(folder)
    if made is None or not made.complete:  # one that another version of twbal learned is taken as it is
        iterate(folder, [*learn_words(FAMILY, seed), *how.words, f"seed={seed}", *updates])
    return folder / "best_policy.pt"


def driven(recipe: str, seed: int, shop: Workshop, asked: Perturbations) -> PolicyRobustness:
    """What becomes of a recipe's policy on its robot, which is driven where that is not known."""
    file = ROOT / recipe / f"robot_{seed}" / f"robustness_{_key(asked, shop)}.json"
    if file.exists():
        return read_record(PolicyRobustness, file)
    if recipe == INTEGRAL:
        integral = IntegralPolicy(shop)
        found = policy_robustness(integral, integral.channels, shop.tested(seed), asked, shop.rules.default, 0)
    else:
        policy = load_policy(learned(recipe, seed))
        channels = Channels(policy.channels, shop.sheet.wheel_radius, shop.sheet.control_period)
        found = policy_robustness(policy, channels, shop.tested(seed), asked, shop.rules.default, 0)
    file.parent.mkdir(parents=True, exist_ok=True)
    write_record(file, found)
    return found


def _key(asked: Perturbations, shop: Workshop) -> str:
    """Of all that is asked: other levels, trials or rules of success are driven anew."""
    return sha256(json.dumps(encoded([asked, shop.rules.default])).encode()).hexdigest()[:12]


def keep(done: Sequence[Sequence[PolicyRobustness]], asked: Perturbations) -> None:
    """Write results and chart of the robots that all methods have driven.

    Args:
        done: by robot, the policies of `METHODS`.
        asked: of them.
    """
    methods = [
        MethodRobustness(name, policies) for name, policies in zip(METHODS, zip(*done, strict=True), strict=True)
    ]
    found = Robustness(0, asked.trials, axes_of(asked), tuple(methods))
    write_atomically(RESULTS, json.dumps(encoded(found), ensure_ascii=False) + "\n")
    write_atomically(PICTURE, svg(robustness_figure(found)))


def main(words: Sequence[str]) -> None:
    """Run with settings of the form key=value."""
    settings = text_settings(DEFAULTS, words)
    shop, asked, first = Workshop(FAMILIES[FAMILY]), perturbations(int(settings["trials"])), int(settings["first_seed"])
    done: list[list[PolicyRobustness]] = []
    for seed in range(first, first + int(settings["robots"])):
        done.append([driven(recipe, seed, shop, asked) for recipe in METHODS])
        for recipe, policy in zip(METHODS, done[-1], strict=True):
            print(f"{seed} {recipe}: {MethodRobustness(recipe, (policy,)).overall():.2f}", flush=True)
        keep(done, asked)


if __name__ == "__main__":
    main(sys.argv[1:])
