"""The compiled header beside the policy, in value and in gain, for a policy of each kind.

    python -m benchmarks.on_boards.agreement [states=1000000] [workers=2]

States are drawn from the working range of the robot `paper`. A policy that is done is not done again; results are in
benchmarks/results/on_board_agreement.json. Needs a C compiler.
"""

import json
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from hydra import compose
from hydra.utils import instantiate

from benchmarks.on_boards.kinds_of_policies import POLICIES, compiled, widths_of
from benchmarks.settings import number_settings
from benchmarks.side_by_side import side_by_side
from twbal.cli.composition import composing
from twbal.core.files import write_atomically
from twbal.core.robot_parameters import RobotParameters
from twbal.embedded.agreement import agreement

RESULTS = Path("benchmarks/results/on_board_agreement.json")
DEFAULTS = {"states": 1_000_000, "workers": 2}
SEED = 12
NAMES = {
    "searched": "30 basis functions, 5 channels (searched on a model)",
    "place": "12 basis functions, 7 channels",
    "friction": "the same, with compensation of friction",
    "paper": "50 basis functions, 3 channels",
    "regulator_with_friction": "regulator with compensation of friction, 7 channels",
    "linear": "linear, 7 channels",
    "tanh": "layers of 64 and 32 tanh, 7 channels",
    "relu": "a layer of 16 relu, 7 channels",
}


def paper() -> RobotParameters:
    """The data sheet `paper`."""
    with composing():
        found = instantiate(compose("real_rollout", ["policy.path=none"]).robot)
    assert isinstance(found, RobotParameters)
    return found


def compared(name: str, robot: RobotParameters, states: int) -> dict[str, Any]:
    """How far the header of a policy is from it, and how long a call takes here [s]."""
    policy = POLICIES[name]
    with compiled(policy, robot) as header:
        found = agreement(header, policy, widths_of(policy, robot), states, np.random.default_rng(SEED))
        equal = {"is_equal": found.is_equal, "max_command": policy.max_command, "seconds": header.seconds_per_call}
    return {"policy": name, **asdict(found), **equal}


def main(words: Sequence[str]) -> None:
    """Run with settings of the form key=value."""
    settings = number_settings(DEFAULTS, words)
    results: dict[str, Any] = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    names = [name for name in POLICIES if results.get(name, {}).get("states") != settings["states"]]
    robot = paper()

    def work(jobs: Iterable[int]) -> Iterator[dict[str, Any]]:
        for job in jobs:
            yield compared(names[job], robot, settings["states"])

    for found in side_by_side(work, len(names), settings["workers"]):
        results[found.pop("policy")] = found
        write_atomically(
            RESULTS, json.dumps({name: results[name] for name in POLICIES if name in results}, indent=1) + "\n"
        )
        print(found, flush=True)


def on_board_agreement(results: Mapping[str, Any]) -> list[str]:
    """One line a policy."""
    lines = [
        "| policy | states | largest error of the command | of what single precision explains | largest error of a gain"
        " | a call on this PC |",
        "|---|---|---|---|---|---|",
    ]
    for name, found in results.items():
        error = f"{1e6 * found['max_error'] / found['max_command']:.2g}·10⁻⁶ of its limit"
        share, gain = f"{100 * found['max_of_bound']:.0f} %", f"{100 * found['max_gain_error']:.1g} % of the largest"
        lines.append(
            f"| {NAMES[name]} | {found['states']:,} | {error} | {share} | {gain} | {1e6 * found['seconds']:.2g} µs |"
        )
    return lines


if __name__ == "__main__":
    main(sys.argv[1:])
