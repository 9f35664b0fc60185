"""Which hidden robots the benchmark is run on."""

import json
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path

from hydra import compose
from hydra.utils import instantiate

from benchmarks.hidden_robots.yardstick import drops
from twbal.cli.composition import composing
from twbal.effects.effect import Effect
from twbal.effects.sensor_noise import SensorNoise
from twbal.sim.bullet_plant import SimPlant
from twbal.virtual_robot.faults import draw_faults

PHYSICS_STEP = 0.0005  # s, of the virtual robot


def dropped_by_the_data_sheet(first_seed: int) -> Iterator[tuple[int, list[Effect]]]:
    """Seeds from `first_seed` on, with their effects, of the hidden robots that the data sheet's regulator drops."""
    with composing():
        cfg = compose("iterate")
        recipe = instantiate(compose("virtual_robot").hidden)
    robot, rule, start = instantiate(cfg.robot), instantiate(cfg.success), instantiate(cfg.start)
    seed = first_seed
    while True:
        effects = draw_faults(recipe, robot, seed)
        with SimPlant(robot=robot, effects=effects, start=start, physics_step=PHYSICS_STEP, seed=seed) as plant:
            if drops(plant, robot, rule, trials=1):
                yield seed, effects
        seed += 1


def as_simulation(effects: Sequence[Effect]) -> list[str]:
    """Overrides that put these effects into the simulation: what learns from it then knows the true dynamics.

    The sensors' noise is left out: it is no part of the dynamics.
    """
    words = []
    for effect in effects:
        if isinstance(effect, SensorNoise):
            continue
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
