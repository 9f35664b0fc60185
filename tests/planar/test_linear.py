from dataclasses import replace

import numpy as np
from equations_of_motion import accelerations
from scipy.linalg import solve_continuous_are

from twbal.core.start_pose import StartPose
from twbal.planar.equations import coefficients
from twbal.planar.linearised import linearise
from twbal.sim.bullet_plant import SimPlant


def slope(robot, x, u):
    bend = accelerations(coefficients(robot), x[0] - robot.com_offset, x[1], u)
    return np.array([x[1], bend.tilt, robot.wheel_radius * bend.wheel])


def test_it_is_the_derivative_of_the_equations_of_motion_at_the_balance(paper, regbot):
    for robot in (paper, replace(regbot, com_offset=0.1)):
        A, B = linearise(robot)
        e = 1e-6
        np.testing.assert_allclose(slope(robot, np.zeros(3), 0.0), 0, atol=1e-12)
        for i, direction in enumerate(np.eye(3)):
            numeric = (slope(robot, e * direction, 0.0) - slope(robot, -e * direction, 0.0)) / (2 * e)
            np.testing.assert_allclose(A[:, i], numeric, rtol=1e-7, atol=1e-8)
        np.testing.assert_allclose(
            B, (slope(robot, np.zeros(3), e) - slope(robot, np.zeros(3), -e)) / (2 * e), rtol=1e-7
        )


def test_a_regulator_built_on_it_holds_the_simulated_robot(paper):
    A, B = linearise(paper)
    effort = 10 / paper.torque_limit**2
    gain = B @ solve_continuous_are(A, B[:, None], np.diag([1, 0.1, 0.1]), np.array([[effort]])) / effort
    start = StartPose(-0.17, 0.01, 0.05, 0.0)
    with SimPlant(robot=paper, effects=[], start=start, physics_step=0.001, seed=0) as plant:
        seen = plant.reset(0)
        for _ in range(300):
            speed = paper.wheel_radius * (seen.wheel_rate + seen.tilt_rate)
            seen = plant.step(-gain @ [seen.tilt, seen.tilt_rate, speed])
    assert abs(seen.tilt) < 1e-3
    assert abs(seen.acceleration) < 1e-2
