"""Sets from the default virtual robot, recorded through its serial port by `real-rollout experiment=excite`.

It hides several effects at once, and a body and motors far off the data sheet. Some of these robots fall early under
the data sheet's regulator, as a real one would; what they tell until then is the set.
"""

import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

from hydra import compose
from hydra.utils import instantiate

from benchmarks.hidden_robots.nearest import nearest_effects
from twbal.cli.composition import composing
from twbal.effects.library import library
from twbal.virtual_robot.drawn import draw_ground_truth

RECORDED = "recorded"


def record(folder: Path, seed: int) -> dict[str, dict[str, float]]:
    """Record the robot `seed` into a folder and return the effects that it hides."""
    out = folder / RECORDED
    words = ["experiment=excite", "link=virtual", f"link.seed={seed}", f"seed={seed}", f"hydra.run.dir={out}"]
    subprocess.run(
        [sys.executable, "-m", "twbal", "real-rollout", *words],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        check=True,
    )
    with composing():
        cfg = compose("virtual_robot")
    names = {kind: name for name, kind in library().items()}
    sheet = instantiate(cfg.robot)
    effects: list[Any] = [e for e in nearest_effects(draw_ground_truth(instantiate(cfg.faults), sheet, seed), sheet)]
    hidden = {names[type(effect)]: asdict(effect) for effect in effects}
    return {name: values for name, values in hidden.items() if next(iter(values.values())) != 0.0}
