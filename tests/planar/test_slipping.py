"""Friction of tyres, joints and ground in one physics step, against a quadratic programme within bounds."""

import numpy as np
import pytest
from hydra.utils import instantiate
from omegaconf import OmegaConf
from scipy.optimize import lsq_linear

from twbal.cli.conf_folder import conf_folder
from twbal.core.robot_parameters import GRAVITY
from twbal.planar.constants import constants
from twbal.planar.motion import step
from twbal.planar.parameters import planar_parameters
from twbal.planar.planar_state import PlanarState, turning_at

REST = PlanarState(*(0.0,) * len(PlanarState._fields))
STEP, FRICTION, STEPS = 2e-3, 0.3, 400
AHEAD = turning_at(0.0, 0.0)


def rates(robot, state):
    """Speed of the axle, tilt rate and wheel rate."""
    return np.array([state.slip + robot.wheel_radius * state.wheel_speed, state.tilt_rate, state.wheel_speed])


def mass_matrix(robot, tilt):
    """Of axle speed, tilt rate and wheel rate."""
    m, h = robot.body_mass, robot.com_height
    bent = m * h * np.cos(tilt)
    return np.array(
        [
            [m + 2 * robot.wheel_mass, bent, 0.0],
            [bent, robot.body_inertia_pitch + m * h**2, 0.0],
            [0.0, 0.0, 2 * robot.wheel_inertia],
        ]
    )


def random_start(rng, scale):
    """Slipping or not, with joints and wheels that turn or nearly stand still."""
    tilt_rate = rng.normal(0.0, 0.5)
    wheel_speed = rng.choice([1.0, 0.02]) * rng.normal() + rng.choice([0.0, tilt_rate])
    start = {"tilt": rng.normal(0.0, 0.1), "tilt_rate": tilt_rate, "wheel_speed": wheel_speed}
    return REST._replace(**start, slip=rng.choice([0.0, 0.02]) * rng.normal()), rng.normal(0.0, 0.1 * scale)


@pytest.mark.parametrize("frictions", [(0.03, 0.0), (0.0, 0.03), (0.03, 0.03)])
@pytest.mark.parametrize("name", ["paper", "esp32"])
def test_frictions_are_the_least_squares_within_their_bounds(name, frictions):
    """What remains of the rates of slip, wheels and joints is least, weighed by the inertias; 1 of 100 may fall short.

    Impulses within bounds that each bring their own rate to 0 are the solution of such a programme (J. J. Moreau:
    Quadratic programming in mechanics: dynamics of one-sided constraints, SIAM J. Control 4 (1), 1966).
    """
    robot, rng = instantiate(OmegaConf.load(conf_folder() / "robot" / f"{name}.yaml")), np.random.default_rng(7)
    joint, ground = (share * robot.torque_limit for share in frictions)
    effects = {"coulomb_friction": {"torque": joint}, "rolling_resistance": {"torque": ground}}
    planar = planar_parameters(robot, {"wheel_slip": {"friction": FRICTION}, **effects})
    smooth = planar_parameters(robot, {"wheel_slip": {"friction": 1e-15}})
    k, free = constants(planar, STEP), constants(smooth, STEP)
    m, h, r = robot.body_mass, robot.com_height, robot.wheel_radius
    short, bounded = 0, 0
    for _ in range(STEPS):
        start, torque = random_start(rng, robot.torque_limit)
        found = rates(robot, step(planar, k, start, torque, 0.0, AHEAD))
        before = rates(robot, step(smooth, free, start, torque, 0.0, AHEAD))
        bend = (before[1] - start.tilt_rate) / STEP
        weight = (m + 2 * robot.wheel_mass) * GRAVITY - m * h * (
            np.cos(start.tilt) * start.tilt_rate**2 + np.sin(start.tilt) * bend
        )
        ways = np.array([[1.0, 0.0, -r], [0.0, 0.0, 1.0], [0.0, -1.0, 1.0]])  # slip; wheels; wheels less body
        bounds = STEP * np.array([FRICTION * weight, 2 * ground, 2 * joint])
        there = bounds > 0.0
        root = np.linalg.cholesky(np.linalg.inv(mass_matrix(robot, start.tilt)))
        rooted = root.T @ ways[there].T  # of the rates, weighed by the inertias
        scaled = rooted * bounds[there]
        best = lsq_linear(scaled, -np.linalg.solve(root, before), (-1.0, 1.0), method="bvls", tol=1e-15)
        expected = before + root @ (scaled @ best.x)
        short += np.abs(found - expected).max() > 1e-7 * np.abs(before).max()
        bounded += (best.active_mask != 0).sum()
    assert short <= STEPS / 100
    assert 0.1 < bounded / (STEPS * there.sum()) < 0.95  # some slide, some hold
