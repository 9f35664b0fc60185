"""The analytic twin and PyBullet, two independent ways to the same motion; every fault of either shows here."""

import numpy as np
import pytest
from scipy.linalg import solve_continuous_are

from twbal.planar.dynamics import PlanarState, coefficients, step
from twbal.planar.linear import linearise
from twbal.planar.plant import PlanarPlant
from twbal.robot.start_pose import StartPose
from twbal.sim.effects.actuation_delay import ActuationDelay
from twbal.sim.effects.body_mass import BodyMass
from twbal.sim.effects.com_height import ComHeight
from twbal.sim.effects.com_offset import ComOffset
from twbal.sim.effects.coulomb_friction import CoulombFriction
from twbal.sim.effects.dead_zone import DeadZone
from twbal.sim.effects.effect import assemble
from twbal.sim.effects.motor_lag import MotorLag
from twbal.sim.effects.torque_gain import TorqueGain
from twbal.sim.effects.viscous_friction import ViscousFriction
from twbal.sim.plant import SimPlant

START = StartPose(-0.17, 0.02, 0.2, 0.1)
RATE = 1e-4  # rad/s a control period
EFFECTS = {
    "none": lambda robot: [],
    "dead_zone": lambda robot: [DeadZone(0.1 * robot.torque_limit)],
    "torque_gain": lambda robot: [TorqueGain(0.6)],
    "coulomb_friction": lambda robot: [CoulombFriction(0.025 * robot.torque_limit)],
    "viscous_friction": lambda robot: [ViscousFriction(0.0025 * robot.torque_limit)],
    "actuation_delay": lambda robot: [ActuationDelay(0.77 * robot.control_period)],
    "motor_lag": lambda robot: [MotorLag(robot.control_period)],
    "body_mass": lambda robot: [BodyMass(1.5)],
    "com_height": lambda robot: [ComHeight(1.3)],
    "com_offset": lambda robot: [ComOffset(-0.08)],
}
EFFECTS["all"] = lambda robot: [effect for name, make in EFFECTS.items() if name != "all" for effect in make(robot)]


def regulator(robot):
    """Feedback on (tilt, tilt rate, speed) that keeps the nominal robot up."""
    A, B = linearise(robot)
    effort = 10 / robot.torque_limit**2
    return B @ solve_continuous_are(A, B[:, None], np.diag([1, 0.1, 0.1]), np.array([[effort]])) / effort


def excited(robot, gain, seen, rng):
    """The regulator's command and a random torque [N·m]."""
    speed = robot.wheel_radius * (seen.wheel_rate + seen.tilt_rate)
    return 0.1 * robot.torque_limit * rng.standard_normal() - gain @ [seen.tilt, seen.tilt_rate, speed]


def twin_of_one_period(machine, running, seen, command, physics_step):
    """Tilt rate and wheel rate one control period after `seen`, by the twin."""
    state = PlanarState(seen.tilt, seen.wheel_angle + seen.tilt, seen.tilt_rate, seen.wheel_rate + seen.tilt_rate)
    for _ in range(round(machine.robot.control_period / physics_step)):
        torque = running.actuate(machine.clip(command))
        state = step(coefficients(machine.robot), machine.drive, state, torque, physics_step)
    return state


def gaps(robot, effects, start, physics_step, drive):
    """Twin less engine after each control period from the engine's motion: tilt, tilt rate, wheel rate, (T, 3).

    Twenty-five periods, or until the robot leans by half a radian; `drive` gives the command for an observation.
    """
    machine = assemble(robot, effects)
    rows = []
    with SimPlant(robot=robot, effects=effects, start=start, physics_step=physics_step, seed=0) as plant:
        running = machine.start(physics_step, np.random.default_rng(0))
        seen = plant.reset(0)
        while len(rows) < 25 and abs(seen.tilt) < 0.5:
            command = drive(seen)
            twin = twin_of_one_period(machine, running, seen, command, physics_step)
            seen = plant.step(command)
            rate = twin.wheel_speed - twin.tilt_rate
            rows.append([twin.tilt - seen.tilt, twin.tilt_rate - seen.tilt_rate, rate - seen.wheel_rate])
    return np.array(rows)


@pytest.mark.parametrize("name", EFFECTS)
@pytest.mark.parametrize(("which", "tolerance"), [("paper", RATE), ("regbot", 4 * RATE)])
def test_every_control_period_ends_as_in_the_physics_engine(request, which, tolerance, name):
    robot = request.getfixturevalue(which)
    gain, rng = regulator(robot), np.random.default_rng(0)
    effects = EFFECTS[name](robot)
    worst = np.abs(gaps(robot, effects, START, 0.001, lambda seen: excited(robot, gain, seen, rng))).max(0)
    assert (worst < np.array([0.02, 1, 5]) * tolerance).all()


@pytest.mark.parametrize("name", ["none", "coulomb_friction", "all"])
@pytest.mark.parametrize("which", ["paper", "regbot"])
def test_in_a_fall_the_gap_is_the_integrators_and_shrinks_with_the_step(request, which, name):
    robot = request.getfixturevalue(which)
    torque, start = 0.02 * robot.torque_limit, StartPose(-0.17, 0, 0, 0)
    coarse, fine = [
        np.abs(gaps(robot, EFFECTS[name](robot), start, step, lambda seen: torque)).max(0) for step in (5e-4, 2.5e-4)
    ]
    assert fine[1] < 2e-3
    assert coarse / fine == pytest.approx(2, rel=0.1)


def test_the_twin_behind_the_seam_sees_what_the_simulated_robot_sees(paper):
    effects = EFFECTS["all"](paper)
    gain, rng = regulator(paper), np.random.default_rng(0)
    twin = PlanarPlant(machine=assemble(paper, effects), start=START, physics_step=0.001, seed=4)
    with SimPlant(robot=paper, effects=effects, start=START, physics_step=0.001, seed=4) as plant, twin:
        seen, shadow = plant.reset(1), twin.reset(1)
        assert np.abs(np.subtract(seen, shadow)).max() < 1e-12
        for _ in range(10):
            command = excited(paper, gain, seen, rng)
            seen, shadow = plant.step(command), twin.step(command)
            assert (np.abs(np.subtract(seen, shadow)) < [1e-12, 1e-4, 2e-3, 2e-2, 1e-3, 5e-3, 1e-4]).all()
