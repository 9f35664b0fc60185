"""Compile what commands run, once: `python -m twbal.cli.warm`, as a part of setting up."""

import io
import multiprocessing
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from contextlib import redirect_stdout
from pathlib import Path

import numpy as np

from twbal.algorithm.rollout import rollout
from twbal.cli.main import main as twbal
from twbal.core.channels import Channels
from twbal.core.cost import cost_over
from twbal.core.episode import Provenance
from twbal.core.errors import TwbalError
from twbal.core.evaluation import SuccessCriterion
from twbal.core.robot_parameters import RobotParameters
from twbal.core.start_pose import StartPose
from twbal.diagnosis.experiments import experiments_of, simulate
from twbal.effects.library import library
from twbal.models.smoothing import compile_filter
from twbal.planar.parameters import planar_parameters
from twbal.planar.planar_plant import PlanarPlant
from twbal.planar.robot_distribution import prior_of
from twbal.policies.random import RandomPolicy
from twbal.search.margin import Margin
from twbal.search.robust import RobustSettings, SampledRobots
from twbal.search.start_state import start_state
from twbal.search.warm import compile_search, is_compiled
from twbal.sysid.linear_response import match_each, respond_each
from twbal.sysid.model import Data, Model
from twbal.sysid.noise import NoiseModel
from twbal.sysid.posterior import posterior
from twbal.sysid.recording import Recording

_ROBOT = RobotParameters(
    name="any",
    body_mass=10.0,
    com_height=0.3,
    com_offset=0.0,
    body_inertia_pitch=0.3,
    body_inertia_roll=0.4,
    body_inertia_yaw=0.2,
    wheel_mass=1.0,
    wheel_radius=0.15,
    wheel_inertia=0.01,
    wheel_width=0.04,
    track=0.4,
    torque_limit=20.0,
    control_period=0.02,
)
_STEPS = 12
INTERRUPTED = 130
"""Exit code of a command that was stopped by Ctrl-C."""


def compile_robots() -> None:
    """Find regulators for robots that are known by a rollout; the machine code stays in the cache folder."""
    channels = Channels(("tilt", "tilt_rate", "speed", "command_1"), _ROBOT.wheel_radius, _ROBOT.control_period)
    cost = cost_over(channels.names, {"tilt": 0.25, "tilt_rate": 2.5, "speed": 1.0}, None, _ROBOT.torque_limit)
    start = StartPose(0.05, 0.01, 0.01, 0.01)
    plant = PlanarPlant(robot=_ROBOT, effects=[], start=start, physics_step=0.001, seed=0)
    driver = RandomPolicy(0.2, _ROBOT.torque_limit, 1)
    episode = rollout(plant, driver, channels, _STEPS, 1.0, Provenance(_ROBOT.name, "simulation"))
    rule = SuccessCriterion(tilt_limit=1.0, settled_tilt_limit=1.0, settle_step=1, steps=_STEPS)
    settings = RobustSettings(
        robots=1,
        designs=1,
        screening=1,
        finalists=1,
        width_scales={},
        position_scales=(1.0,),
        change_scales=(1.0,),
        command_widths=(1.0,),
        compensations=(0.1,),
        compensation_tilt=0.015,
        improved=1,
        evaluations=2,
        improving=1,
        enough=1.0,
        doubt=1.0,
        margin=Margin(doubt=0.0, delay=0.0, noise=1.0, push=0.0, push_duration=0.1),
    )
    known = posterior(prior_of(_ROBOT), [episode])
    SampledRobots(known, channels, cost, rule, start_state(start, channels.names), settings, 0).regulators()


def compile_robot_and_diagnosis() -> None:
    """Record the virtual robot and diagnose the record, as small as can be.

    Raises:
        TwbalError: a command failed.
    """
    others = sorted(set(library()) - {"dead_zone"})
    with tempfile.TemporaryDirectory() as folder:
        record = Path(folder, "record")
        _run("real-rollout", record, "experiment=excite", "trials=3", "steps=60", 'link.overrides=["faults=none"]')
        _run(
            *("diagnose", Path(folder, "diagnosis"), f"episodes='{record}'", "horizons=[0.06]", "starts=2", "bins=2"),
            *("min_length=15", "min_samples=90", "diagnosis.max_effects=1", "diagnosis.substeps=4"),
            *("diagnosis.shortlist=1", f"diagnosis.exclude=[{','.join(others)}]"),
        )


def compile_what_few_diagnoses_need() -> None:
    """Simulate an experiment that one may suggest, and try a wave; the machine code stays in the cache folder."""
    nothing = np.zeros((4, 4))
    seen = Recording(
        "any", _ROBOT.control_period, nothing[:3, 0], nothing, nothing[0], nothing[0] == 0, nothing[0] == 0
    )
    model = Model(planar_parameters(_ROBOT, {}), 0.0, NoiseModel(np.full(4, 0.01), np.zeros(2)))
    data = Data([seen], 1)
    simulate(experiments_of(_ROBOT)[0][0], _ROBOT, model, data, 0)
    linear = data.linear(model)
    kalman, push = data.filter(model), linear.B[:, 0].copy()
    respond_each(linear.F, linear.C, kalman.gains, push, np.zeros((3, 2)))
    waves = np.zeros((3, 2, 1)), kalman.whiteners, np.zeros(4), np.zeros((3, 4))
    match_each(linear.F, linear.C, kalman.gains, push, *waves)


def _run(stage: str, out: Path, *words: str) -> None:
    with redirect_stdout(io.StringIO()):
        code = twbal([stage, *words, f"hydra.run.dir='{out}'"])
    if code:  # it has said why
        raise TwbalError(
            f"What `twbal {stage}` runs was not compiled. Set up once more; commands compile it otherwise."
        )


def main() -> None:
    """Compile everything, the policy search beside what it shares no kernels with: it takes half of the time.

    Two processes must not add to the index of one kernel in numba's cache at once.
    """
    print("compiling, once for this version (two to three minutes) ...", flush=True)
    compile_filter()
    compile_robots()
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as beside:
        search = None if is_compiled() else beside.submit(compile_search)
        compile_robot_and_diagnosis()
        compile_what_few_diagnoses_need()
        if search is not None:
            search.result()


if __name__ == "__main__":
    try:
        main()
    except TwbalError as error:  # the environment is well all the same
        print(f"twbal: {error}", file=sys.stderr)
    except KeyboardInterrupt:
        raise SystemExit(INTERRUPTED) from None
