"""The hidden robots of the benchmarks, and what drives them."""

import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from hydra import compose
from hydra.utils import instantiate

from benchmarks.hidden_robots.families import FAMILIES, Family
from benchmarks.hidden_robots.reference import Rules
from twbal.algorithm.tested_robot import TestedRobot
from twbal.cli.artefacts import read_logs
from twbal.cli.composition import composing
from twbal.core.robot_parameters import RobotParameters
from twbal.virtual_robot.drawn import draw_ground_truth
from twbal.virtual_robot.ground_truth import GroundTruth
from twbal.virtual_robot.mujoco_robot import MujocoRobot


class Workshop:
    """Makes the robots of a family, and knows the rules that they are judged by.

    Attributes:
        sheet: their data sheet.
        rules: the default one and that for robots that stick.
    """

    def __init__(self, family: Family) -> None:
        with composing():
            served = compose("virtual_robot", [f"robot={family.sheet}", f"faults={family.faults}"])
            ideal = compose("virtual_robot", [f"robot={family.sheet}", "faults=none"])
            asked = [compose("iterate", [f"robot={family.sheet}", f"success={rule}"]) for rule in Rules._fields]
            self.rules = Rules(*(instantiate(cfg.success) for cfg in asked))
        self.sheet: RobotParameters = instantiate(served.robot)
        self._ideal = instantiate(ideal.faults)
        self._faults, self._start = instantiate(served.faults), instantiate(served.start)
        self._physics_step = served.physics_step

    def truth(self, seed: int) -> GroundTruth:
        """What the robot `seed` is."""
        return draw_ground_truth(self._faults, self.sheet, seed)

    def ideal(self) -> GroundTruth:
        """The robot that the data sheet describes."""
        return draw_ground_truth(self._ideal, self.sheet, 0)

    def tested(self, seed: int) -> TestedRobot:
        """The robot `seed`, that can be changed."""
        return TestedRobot(self.sheet, self.truth(seed), self._start, self._physics_step, seed)

    def robot(self, seed: int, truth: GroundTruth | None = None) -> MujocoRobot:
        """The robot `seed` as `twbal virtual-robot` serves it, or with its start poses and noise another truth."""
        return self.tested(seed).plant(truth)


def learn_words(family: str, seed: int) -> list[str]:
    """Settings of `twbal iterate` that choose the robot `seed` of a family."""
    sheet, faults = FAMILIES[family]
    return [f"robot={sheet}", f'link.overrides=["idle_timeout=300","faults={faults}"]', f"link.seed={seed}"]


def iterate(folder: Path, words: Sequence[str]) -> dict[str, Any]:
    """Run `twbal iterate` into `folder` (or go on there) and return its summary."""
    run("iterate", folder, words)
    summary: dict[str, Any] = json.loads((folder / "summary.json").read_text())
    return summary


class Told(NamedTuple):
    """What a rollout tells of a robot before it is learned.

    Attributes:
        words: settings of `twbal iterate` that say it.
        seconds: of driving.
    """

    words: list[str]
    seconds: float


def identified(folder: Path, family: str, seed: int) -> Told:
    """Drive the robot `seed` of a family once, with an exciting command, and identify it."""
    excited, told = folder / "excited", folder / "identified"
    run("real-rollout", excited, [*learn_words(family, seed), "experiment=excite", "trials=1", f"seed={seed}"])
    run("identify", told, [f"robot={FAMILIES[family].sheet}", f"episodes={excited}"])
    seconds = sum(len(episode.commands) * episode.control_period for episode in read_logs([excited]))
    return Told([f"sim={told / 'identified.yaml'}", f"known={told}"], seconds)


def run(command: str, folder: Path, words: Sequence[str]) -> None:
    """Run a stage of twbal into `folder`, or go on there; what it says goes to output.log."""
    folder.mkdir(parents=True, exist_ok=True)
    line = [sys.executable, "-m", "twbal", command, *words, f"hydra.run.dir={folder}"]
    with (folder / "output.log").open("a") as output:
        subprocess.run(line, stdout=output, stderr=subprocess.STDOUT, check=True)
