"""Each packaged robot stands by the regulator of its own sheet, and two engines agree on how."""

import numpy as np
import pytest
from hydra import compose, initialize_config_dir
from hydra.utils import instantiate

from twbal.algorithm.rollout import rollout
from twbal.cli.conf_folder import conf_folder
from twbal.cli.main import main
from twbal.core.episode import Outcome, Provenance
from twbal.planar.planar_plant import PlanarPlant
from twbal.policies.saved import load_policy
from twbal.sim.bullet_plant import SimPlant

ROBOTS = sorted(path.stem for path in (conf_folder() / "robot").glob("*.yaml"))
SECONDS = 4.0
TILT_LIMIT = np.radians(30.0)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_robot_stands_by_the_regulator_of_its_sheet(name, tmp_path, as_from_a_shell):
    """From the paper's start, 10° back; where its centre of mass is off, it comes to rest leaning against that."""
    assert main(["lqr", f"robot={name}", f"hydra.run.dir={tmp_path}"]) == 0
    with initialize_config_dir(str(conf_folder()), version_base="1.3"):
        cfg = compose("sim_collect", [f"robot={name}"])
    robot, start, channels = instantiate(cfg.robot), instantiate(cfg.start), instantiate(cfg.state)
    settings = {"robot": robot, "start": start, "physics_step": cfg.sim.physics_step, "seed": 1}
    periods, source = round(SECONDS / robot.control_period), Provenance(name, "simulation", seed=1, trial=0)
    policy = load_policy(tmp_path / "policy.pt", channels.names)
    driven = []
    for plant in (SimPlant(effects=[], **settings), PlanarPlant(effects={}, **settings)):
        with plant:
            driven.append(rollout(plant, policy, channels, periods, TILT_LIMIT, source))
    for episode in driven:
        assert episode.outcome is Outcome.COMPLETED
        assert abs(episode.tilt[-1] + robot.com_offset) < np.radians(0.5)
    bullet, planar = (episode.tilt for episode in driven)
    assert np.abs(bullet - planar).max() < 1e-4
