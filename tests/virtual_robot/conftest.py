from dataclasses import replace
from pathlib import Path

import pytest
from hydra.utils import instantiate
from omegaconf import OmegaConf

from twbal.core.start_pose import StartPose
from twbal.effects.sensor_noise import SensorNoise
from twbal.sim.bullet_plant import SimPlant
from twbal.virtual_robot.drawn import draw_ground_truth
from twbal.virtual_robot.mujoco_robot import MujocoRobot

CONF = Path(__file__).parents[2] / "conf"


@pytest.fixture
def conf():
    """Builds what one choice describes: conf("robot/paper")."""

    def build(name):
        group, choice = name.split("/")
        together = CONF / "groups" / f"{group}.yaml"
        return instantiate(
            OmegaConf.load(together)[choice] if together.exists() else OmegaConf.load(CONF / f"{name}.yaml")
        )

    return build


@pytest.fixture
def sim_plant(conf):
    """A simulated robot with sensor noise."""
    effects = [SensorNoise(0.0035, 0.02, 0.3, 0.001, 0.05, 0.02)]
    robot, start = conf("robot/paper"), conf("task/start")
    with SimPlant(robot=robot, effects=effects, start=start, physics_step=0.001, seed=5) as plant:
        yield plant


@pytest.fixture
def make(conf):
    """Builds a robot: make("paper", "none", drive={"delay": 0.01}); `start` is a tilt, or a distribution."""

    def build(sheet="paper", faults="none", seed=0, start=0.0, physics_step=0.00025, **parts):
        sheet = conf(f"robot/{sheet}")
        truth = draw_ground_truth(conf(f"faults/{faults}"), sheet, seed)
        truth = replace(truth, **{name: replace(getattr(truth, name), **values) for name, values in parts.items()})
        start = start if isinstance(start, StartPose) else StartPose(start, 0.0, 0.0, 0.0)
        return MujocoRobot(
            truth=truth, control_period=sheet.control_period, start=start, physics_step=physics_step, seed=seed
        )

    return build
