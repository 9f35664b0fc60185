from dataclasses import replace

import numpy as np
import pytest

from twbal.engine.machine import Drive
from twbal.planar.dynamics import PlanarState, accelerations, coefficients, step
from twbal.robot.parameters import GRAVITY


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


def swing(robot, drive, torque, physics_step, seconds):
    state = PlanarState(0.3, 0.0, -0.5, 2.0)
    states = [state]
    for _ in range(round(seconds / physics_step)):
        state = step(coefficients(robot), drive, state, torque, physics_step)
        states.append(state)
    return states


def total_energy(robot, state):
    return sum(energies(robot, (state.wheel, state.tilt), (state.wheel_speed, state.tilt_rate)))


def test_energy_is_kept_but_for_an_error_of_first_order(robot):
    drifts = []
    for h in (2e-4, 1e-4):
        energy = np.array([total_energy(robot, s) for s in swing(robot, Drive(), 0.0, h, 0.2)])
        drifts.append(np.abs(energy - energy[0]).max() / energy[0])
    assert drifts[1] < 5e-3
    assert drifts[0] / drifts[1] == pytest.approx(2, rel=0.1)


def test_torque_changes_the_wheels_momentum_by_its_impulse(robot):
    torque = 0.2 * robot.torque_limit
    states = swing(robot, Drive(), torque, 1e-5, 0.1)
    first, last = [momenta(robot, (s.wheel, s.tilt), (s.wheel_speed, s.tilt_rate))[0] for s in (states[0], states[-1])]
    assert last - first == pytest.approx(0.1 * torque, rel=2e-3)


@pytest.mark.parametrize("drive", [Drive(coulomb_friction=0.005), Drive(viscous_friction=0.001)])
def test_friction_takes_away_as_much_energy_as_it_does_work(regbot, drive):
    h = 1e-5
    states = swing(regbot, drive, 0.0, h, 0.03)
    relative = np.array([s.wheel_speed - s.tilt_rate for s in states])
    resisting = 2 * (drive.coulomb_friction * np.sign(relative) + drive.viscous_friction * relative)
    lost = total_energy(regbot, states[0]) - total_energy(regbot, states[-1])
    assert lost == pytest.approx(h * (resisting * relative).sum(), rel=3e-2)


def test_coulomb_friction_holds_the_wheel_to_the_body_where_less_is_asked(paper):
    state = PlanarState(0.1, 0.1, 0.0, 0.0)
    for _ in range(100):
        state = step(coefficients(paper), Drive(coulomb_friction=5.0), state, 1.0, 0.001)
    assert state.wheel_speed - state.tilt_rate == pytest.approx(0, abs=1e-12)
    assert state.tilt_rate > 0.05
