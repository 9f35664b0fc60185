"""A folder with what the commands of README, docs and help read, where they name it."""

import json
import shutil
from pathlib import Path

import numpy as np
from foreign_logs import columns, text
from how_to_run import MODEL, POLICY, RECORDED, SMALL
from shown import ROOT

from twbal.cli.main import main

DATA = ROOT / "data" / "regression"
SMALL_FIT = ("model.fit_f.settings.fit.starts=1", "model.fit_g.settings.starts=1", "model.smoothing=null")


def furnish(folder: Path) -> None:
    """Put it there; `folder` is the working directory."""
    for place in (folder / "data" / "regression", folder / "my_robot"):
        shutil.copytree(DATA, place)
    _make("lqr", "lqr")
    recording = ("policy.path=lqr/policy.pt", 'link.overrides=["faults=none"]', "trials=2", "steps=120")
    _make("real-rollout", RECORDED, *recording)
    simulated = "outputs/sim-collect/2026-11-20_10-00-00-000000"
    _make("sim-collect", simulated, "rollouts=6", "steps=20")
    for run, trials in (("run1", range(3)), ("run2", range(3, 6))):
        _copy(Path(simulated), trials, folder / run)
    for trial, name in enumerate(("before.mcap", "after.mcap")):
        shutil.copy(Path(RECORDED, "episodes", f"trial_{trial:03d}.mcap"), folder / name)
    for name, skipped in (("ride.csv", 0), ("log.csv", 0), ("a.csv", 0), ("b.csv", 1)):
        (folder / name).write_text(text(_ride()[skipped:]))
    for name, skipped in (("test3a.txt", 0), ("test4.txt", 1)):
        (folder / name).write_text(regbot_log(skipped))
    (folder / "datalog.json").write_text(ev3_log())
    shutil.copytree(ROOT / "data" / "ev3", folder / "data" / "ev3")
    sheet = folder / "my_conf" / "robot" / "my_robot.yaml"
    sheet.parent.mkdir(parents=True)
    sheet.write_text((ROOT / "conf" / "robot" / "paper.yaml").read_text().replace("name: paper", "name: my_robot"))
    for seed in (1, 2):
        _make("sim-collect", f"run_{seed}", "robot=regbot", "policy=excite", "rollouts=1", "steps=100", f"seed={seed}")
    f, g = Path(MODEL), Path(MODEL.replace("sim", "diff"))
    _make("fit-sim-gp", f.parent, "episodes=run1", *SMALL_FIT)
    _make("fit-diff-gp", g.parent, f"dynamics={f}", "episodes=before.mcap", *SMALL_FIT)
    _make("optimise-policy", Path(POLICY).parent, f"dynamics={f}", *SMALL["optimise-policy"])


def _make(stage: str, out: Path | str, *words: str) -> None:
    assert main([stage, *words, f"hydra.run.dir={out}"]) == 0


def _copy(run: Path, trials: range, other: Path) -> None:
    """Some logs of a run as those of another."""
    (other / "episodes").mkdir(parents=True)
    for trial in trials:
        name = f"trial_{trial:03d}.mcap"
        shutil.copy(run / "episodes" / name, other / "episodes" / name)


def _ride() -> np.ndarray:
    """A log at the paper's robot's control period."""
    rows = columns(200)
    rows[:, 0] *= 2.0
    return rows


def ev3_log() -> str:
    """A log as an EV3 segway's program writes it: JSON of columns."""
    t = 0.031 * np.arange(400)
    tilt = 0.02 * np.sin(3 * t)
    columns = {
        "tLoopStart": t,
        "motorAngle": np.sin(2 * t),
        "motorDutyCycle": 20 * np.sin(5 * t),
        "gyroEstimatedAngle": tilt,
        "gyroRate": np.gradient(tilt, t),
        "motorAngularSpeed": 2 * np.cos(2 * t),
    }
    return json.dumps({name: values.tolist() for name, values in columns.items()})


def regbot_log(skipped: int = 0) -> str:
    """A log as REGBOT writes it: time in column 1, voltages in 8 and 9, pose in 14 to 16, tilt in 17; zeros elsewhere.

    Args:
        skipped: rows at its beginning that are left out.
    """
    t = 0.015 * np.arange(400)
    rows = np.zeros((len(t), 17))
    rows[:, 0], rows[:, 7], rows[:, 8] = t, np.sin(5 * t), np.sin(5 * t)
    rows[:, 13], rows[:, 16] = 0.06 * np.sin(2 * t), 0.05 * np.sin(3 * t)
    return text(rows[skipped:], delimiter=" ", names=())
