"""Which hidden robots the benchmark is run on."""

import json
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import NamedTuple

from hydra import compose
from hydra.utils import instantiate

from benchmarks.hidden_robots.nearest import nearest_effects
from benchmarks.hidden_robots.yardstick import drops
from twbal.cli.composition import composing
from twbal.core.streams import Stream, child_seed
from twbal.effects.effect import Effect
from twbal.virtual_robot.drawn import draw_ground_truth
from twbal.virtual_robot.ground_truth import GroundTruth
from twbal.virtual_robot.mujoco_robot import MujocoRobot


class Drawn(NamedTuple):
    """A hidden robot.

    Attributes:
        seed: that draws it.
        truth: all that it hides.
        effects: of twbal's, that come nearest to that.
    """

    seed: int
    truth: GroundTruth
    effects: list[Effect]


def dropped_by_the_data_sheet(first_seed: int) -> Iterator[Drawn]:
    """Robots of seeds from `first_seed` on that the data sheet's regulator drops."""
    with composing():
        cfg = compose("iterate")
        served = compose("virtual_robot")
        faults = instantiate(served.faults)
    robot, rule, start = instantiate(cfg.robot), instantiate(cfg.success), instantiate(cfg.start)
    seed = first_seed
    while True:
        truth = draw_ground_truth(faults, robot, seed)
        with MujocoRobot(
            truth=truth,
            control_period=robot.control_period,
            start=start,
            physics_step=served.physics_step,
            seed=child_seed(Stream.VIRTUAL_ROBOT, seed),
        ) as plant:
            if drops(plant, robot, rule, trials=1):
                yield Drawn(seed, truth, nearest_effects(truth, robot))
        seed += 1


def as_simulation(effects: Sequence[Effect]) -> list[str]:
    """Overrides that put these effects into the simulation: what learns from it then nearly knows the dynamics."""
    words = []
    for effect in effects:
        kind, values = type(effect), asdict(effect)  # type: ignore[call-overload]
        node = f"sim.effects.{kind.__name__}"
        words.append(f"++{node}._target_={kind.__module__}.{kind.__name__}")
        words += [f"++{node}.{name}={value!r}" for name, value in values.items()]
    return words


def iterate(folder: Path, words: Sequence[str]) -> dict[str, object]:
    """Run `twbal iterate` into `folder` (or go on there) and return its summary."""
    command = [sys.executable, "-m", "twbal", "iterate", *words, f"hydra.run.dir={folder}"]
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "output.txt").open("a") as output:
        subprocess.run(command, stdout=output, stderr=subprocess.STDOUT, check=True)
    summary: dict[str, object] = json.loads((folder / "summary.json").read_text())
    return summary
