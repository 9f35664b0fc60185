from pathlib import Path

import pytest
from hydra.utils import instantiate
from omegaconf import OmegaConf

from twbal.sim.bullet_plant import SimPlant

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
    effects = [conf("faults/random").noise]
    robot, start = conf("robot/paper"), conf("task/start")
    with SimPlant(robot=robot, effects=effects, start=start, physics_step=0.001, seed=5) as plant:
        yield plant
