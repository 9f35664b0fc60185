from pathlib import Path

import pytest
from hydra.utils import instantiate
from omegaconf import OmegaConf

from twbal.sim.bullet_plant import SimPlant

CONF = Path(__file__).parents[2] / "conf"


@pytest.fixture
def conf():
    """Builds what one yaml describes: conf("robot/paper")."""
    return lambda name: instantiate(OmegaConf.load(CONF / f"{name}.yaml"))


@pytest.fixture
def sim_plant(conf):
    """A simulated robot with sensor noise."""
    effects = [conf("hidden/recipe").noise]
    robot, start = conf("robot/paper"), conf("start/leaning")
    with SimPlant(robot=robot, effects=effects, start=start, physics_step=0.001, seed=5) as plant:
        yield plant
