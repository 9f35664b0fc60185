"""The planar model and PyBullet, two independent ways to the same motion; every fault of either shows here."""

import numpy as np
import pytest
from scipy.linalg import solve_continuous_are

from twbal.core.start_pose import StartPose
from twbal.effects.actuation_delay import ActuationDelay
from twbal.effects.body_mass import BodyMass
from twbal.effects.com_height import ComHeight
from twbal.effects.com_offset import ComOffset
from twbal.effects.coulomb_friction import CoulombFriction
from twbal.effects.dead_zone import DeadZone
from twbal.effects.motor_lag import MotorLag
from twbal.effects.torque_gain import TorqueGain
from twbal.effects.viscous_friction import ViscousFriction
from twbal.planar.actuation import EVEN
from twbal.planar.constants import constants
from twbal.planar.linearised import linearise
from twbal.planar.parameters import planar_parameters
from twbal.planar.planar_plant import PlanarPlant, hold, standing
from twbal.planar.planar_state import STRAIGHT
from twbal.sim.bullet_plant import SimPlant

START = StartPose(-0.17, 0.02, 0.2, 0.1)
RATE = 1e-4  # rad/s a control period
KINDS = {
    "dead_zone": DeadZone,
    "torque_gain": TorqueGain,
    "coulomb_friction": CoulombFriction,
    "viscous_friction": ViscousFriction,
    "actuation_delay": ActuationDelay,
    "motor_lag": MotorLag,
    "body_mass": BodyMass,
    "com_height": ComHeight,
    "com_offset": ComOffset,
}


def values(name, robot):
    """Values of the effects of a case, by effect and parameter."""
    some = {
        "dead_zone": {"width": 0.1 * robot.torque_limit},
        "torque_gain": {"gain": 0.6},
        "coulomb_friction": {"torque": 0.025 * robot.torque_limit},
        "viscous_friction": {"coefficient": 0.0025 * robot.torque_limit},
        "actuation_delay": {"delay": 0.77 * robot.control_period},
        "motor_lag": {"time_constant": robot.control_period},
        "body_mass": {"factor": 1.5},
        "com_height": {"factor": 1.3},
        "com_offset": {"angle": -0.08},
    }
    return {"none": {}, "all": some}.get(name) if name in ("none", "all") else {name: some[name]}


def simulated(name, robot):
    return [KINDS[effect](**parameters) for effect, parameters in values(name, robot).items()]


def regulator(robot):
    """Feedback on (tilt, tilt rate, speed) that keeps the nominal robot up."""
    A, B = linearise(robot)
    effort = 10 / robot.torque_limit**2
    return B @ solve_continuous_are(A, B[:, None], np.diag([1, 0.1, 0.1]), np.array([[effort]])) / effort


def excited(robot, gain, seen, rng):
    """The regulator's command and a random torque [N·m]."""
    speed = robot.wheel_radius * (seen.wheel_rate + seen.tilt_rate)
    return 0.1 * robot.torque_limit * rng.standard_normal() - gain @ [seen.tilt, seen.tilt_rate, speed]


def gaps(robot, name, start, physics_step, drive):
    """Planar model less engine after each control period from the engine's motion: tilt, tilt rate, wheel rate, (T, 3).

    Twenty-five periods, or until the robot leans by half a radian; `drive` gives the command for an observation.
    """
    planar = planar_parameters(robot, values(name, robot))
    k, substeps = constants(planar, physics_step), round(robot.control_period / physics_step)
    rows, commands, state = [], [], standing(k, 0.0, 0.0, 0.0, 0.0)
    effects = simulated(name, robot)
    with SimPlant(robot=robot, effects=effects, start=start, physics_step=physics_step, seed=0) as plant:
        seen = plant.reset(0)
        while len(rows) < 25 and abs(seen.tilt) < 0.5:
            command = np.clip(drive(seen), -robot.torque_limit, robot.torque_limit)
            commands.append(command)
            state = state._replace(
                tilt=seen.tilt,
                wheel=seen.wheel_angle + seen.tilt,
                tilt_rate=seen.tilt_rate,
                wheel_speed=seen.wheel_rate + seen.tilt_rate,
            )
            imu = np.zeros((substeps, 4))
            state = hold(planar, k, state, np.array(commands), len(rows), substeps, STRAIGHT, imu, EVEN)
            seen = plant.step(command)
            rate = state.wheel_speed - state.tilt_rate
            rows.append([state.tilt - seen.tilt, state.tilt_rate - seen.tilt_rate, rate - seen.wheel_rate])
    return np.array(rows)


@pytest.mark.parametrize("name", ["none", *KINDS, "all"])
@pytest.mark.parametrize(("which", "tolerance"), [("paper", RATE), ("regbot", 4 * RATE)])
def test_every_control_period_ends_as_in_the_physics_engine(request, which, tolerance, name):
    robot = request.getfixturevalue(which)
    gain, rng = regulator(robot), np.random.default_rng(0)
    start = StartPose(-0.17, 0, 0, 0)  # the gap grows with the motion: this one bounds it for the same motion each time
    worst = np.abs(gaps(robot, name, start, 0.001, lambda seen: excited(robot, gain, seen, rng))).max(0)
    assert (worst < np.array([0.02, 1, 5]) * tolerance).all()


@pytest.mark.parametrize("name", ["none", "coulomb_friction", "all"])
@pytest.mark.parametrize("which", ["paper", "regbot"])
def test_in_a_fall_the_gap_is_the_integrators_and_shrinks_with_the_step(request, which, name):
    robot = request.getfixturevalue(which)
    torque, start = 0.02 * robot.torque_limit, StartPose(-0.17, 0, 0, 0)
    coarse, fine = [np.abs(gaps(robot, name, start, step, lambda seen: torque)).max(0) for step in (5e-4, 2.5e-4)]
    assert fine[1] < 2e-3
    assert coarse / fine == pytest.approx(2, rel=0.1)


def test_the_planar_model_behind_the_seam_sees_what_the_simulated_robot_sees(paper):
    gain, rng = regulator(paper), np.random.default_rng(0)
    planar = PlanarPlant(robot=paper, effects=simulated("all", paper), start=START, physics_step=0.001, seed=4)
    effects = simulated("all", paper)
    with SimPlant(robot=paper, effects=effects, start=START, physics_step=0.001, seed=4) as plant, planar:
        seen, shadow = plant.reset(1), planar.reset(1)
        assert np.abs(np.subtract(seen, shadow)).max() < 1e-12
        for _ in range(10):
            command = excited(paper, gain, seen, rng)
            seen, shadow = plant.step(command), planar.step(command)
            assert (np.abs(np.subtract(seen, shadow)) < [1e-12, 1e-4, 2e-3, 2e-2, 1e-3, 5e-3, 1e-4]).all()
