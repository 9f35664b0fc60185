from dataclasses import replace

import numpy as np
import pytest
from equations_of_motion import accelerations

from twbal.core.robot_parameters import GRAVITY
from twbal.planar.equations import coefficients


@pytest.fixture(params=["paper", "regbot"])
def robot(request):
    return replace(request.getfixturevalue(request.param), com_offset=0.15)


def energies(robot, q, rates):
    """Kinetic and potential energy from the velocities of the bodies; q = (wheel, tilt). Complex-step safe."""
    (_, tilt), (wheel_rate, tilt_rate) = q, rates
    alpha, r, h = tilt + robot.com_offset, robot.wheel_radius, robot.com_height
    vx = r * wheel_rate + h * np.cos(alpha) * tilt_rate
    vz = -h * np.sin(alpha) * tilt_rate
    wheels = 2 * (robot.wheel_mass * (r * wheel_rate) ** 2 + robot.wheel_inertia * wheel_rate**2)
    kinetic = (robot.body_mass * (vx**2 + vz**2) + robot.body_inertia_pitch * tilt_rate**2 + wheels) / 2
    return kinetic, robot.body_mass * GRAVITY * h * np.cos(alpha)


def momenta(robot, q, rates):
    """∂T/∂rates by complex step."""
    slopes = []
    for i in range(2):
        moved = np.array(rates, complex)
        moved[i] += 1e-30j
        slopes.append(energies(robot, q, moved)[0].imag / 1e-30)
    return np.array(slopes)


def test_accelerations_satisfy_lagranges_equations_of_the_energies(robot):
    rng = np.random.default_rng(0)
    for tilt, wheel_rate, tilt_rate, torque in rng.uniform(-1, 1, (20, 4)) * [1.0, 20.0, 5.0, robot.torque_limit]:
        q, rates = np.array([0.0, tilt]), np.array([wheel_rate, tilt_rate])
        bend = np.array(accelerations(coefficients(robot), tilt, tilt_rate, torque))
        e = 1e-6
        change = momenta(robot, q + e * rates, rates + e * bend) - momenta(robot, q - e * rates, rates - e * bend)
        kinetic, potential = energies(robot, np.array([0, tilt + 1e-30j]), rates)
        slope = np.array([0.0, (kinetic - potential).imag / 1e-30])
        np.testing.assert_allclose(change / (2 * e) - slope, [torque, -torque], rtol=1e-6, atol=1e-7)
