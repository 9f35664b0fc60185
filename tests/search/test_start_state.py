import numpy as np

from twbal.core.channels import Channels, StateTracker
from twbal.core.start_pose import StartPose
from twbal.search.start_state import start_state
from twbal.sim.bullet_plant import SimPlant

NAMES = ("tilt_rate", "speed", "acceleration", "tilt", "yaw_rate", "command_1", "command_2")
DRAWS = 600


def test_it_is_the_distribution_of_where_the_simulated_robot_begins(paper):
    pose = StartPose(tilt_mean=-0.17, tilt_sd=0.02, tilt_rate_sd=0.05, speed_sd=0.3)
    channels = Channels(NAMES, paper.wheel_radius)
    with SimPlant(robot=paper, effects=(), start=pose, physics_step=0.001, seed=0) as plant:
        states = np.array([StateTracker(channels).state(plant.reset(trial), []) for trial in range(DRAWS)])
    expected = start_state(pose, NAMES)
    assert np.all(np.abs(states.mean(axis=0) - expected.mean) <= 4 * expected.sd / np.sqrt(DRAWS) + 1e-9)
    assert np.allclose(states.std(axis=0), expected.sd, rtol=0.12, atol=1e-9)
    correlation_bound = 4 / np.sqrt(DRAWS) * np.outer(expected.sd, expected.sd) + 1e-9
    off_diagonal = ~np.eye(len(NAMES), dtype=bool)
    assert np.all(np.abs(np.cov(states.T) - expected.covariance)[off_diagonal] <= correlation_bound[off_diagonal])
