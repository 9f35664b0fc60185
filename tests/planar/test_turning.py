"""What turning does to the tilt, by a body of point masses, and by the physics engine."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from twbal.core.plant import Observation
from twbal.core.start_pose import InitialState
from twbal.effects.body_inertia import BodyInertia
from twbal.effects.body_mass import BodyMass
from twbal.effects.com_offset import ComOffset
from twbal.effects.flexible_frame import FlexibleFrame
from twbal.effects.library import values_of
from twbal.planar.constants import constants
from twbal.planar.forces import forces
from twbal.planar.parameters import planar_parameters
from twbal.planar.planar_state import PlanarState, turning_at
from twbal.sim.replay import ReplayStart, replay
from twbal.sim.restart_state import RestartState
from twbal.sysid.kalman_predictor import STATE_COLUMNS
from twbal.sysid.open_loop import EARLIEST, predict_open_loop
from twbal.sysid.recording import Recording

STEP, PERIODS = 0.0005, 15
SEEN = [Observation._fields.index(name) for name in ("tilt", "tilt_rate", "wheel_angle", "wheel_rate")]


def point_masses(robot):
    """Masses, and places (N, 3) in an upright body whose axle is the origin: pairs on each of the body's axes.

    Of a body with the sheet's mass, centre of mass and moments of inertia about its own axes.
    """
    roll, pitch, yaw = robot.body_inertia_roll, robot.body_inertia_pitch, robot.body_inertia_yaw
    spread = 0.5 * np.array([pitch + yaw - roll, roll + yaw - pitch, roll + pitch - yaw])  # Σ m x², Σ m y², Σ m z²
    away = np.sqrt(3.0 * spread / robot.body_mass)
    places = np.concatenate([np.diag(away), -np.diag(away)])
    sideways = np.array([np.sin(robot.com_offset), 0.0, np.cos(robot.com_offset)])
    return np.full(6, robot.body_mass / 6.0), places + robot.com_height * sideways


def energy_of_turning(robot, tilt, rate):
    """Kinetic energy of a body that turns about the vertical through its axle [J]."""
    masses, places = point_masses(robot)
    at = Rotation.from_rotvec([0.0, tilt, 0.0]).apply(places)
    return 0.5 * float(np.sum(masses * (at[:, 0] ** 2 + at[:, 1] ** 2))) * rate**2


@pytest.mark.parametrize("name", ["paper", "regbot"])
@pytest.mark.parametrize("offset", [0.0, 0.2, -0.1])
@pytest.mark.parametrize("slope", [0.0, 0.15])
def test_turning_tips_the_body_over_by_the_slope_of_its_energy(name, offset, slope, request):
    robot = replace(request.getfixturevalue(name), com_offset=offset)
    planar, rate = planar_parameters(robot, {"ground_slope": {"angle": slope}}), 2.5
    k = constants(planar, 0.001)
    for tilt in (-0.4, 0.0, 0.3):
        state = PlanarState(tilt, *(0.0,) * (len(PlanarState._fields) - 1))
        turning, straight = (forces(planar, k, state, 0.0, 0.0, turning_at(w, 0.0)).on_body for w in (rate, 0.0))
        energies = [energy_of_turning(robot, tilt + slope + e, rate) for e in (-1e-4, 1e-4)]
        assert turning - straight == pytest.approx((energies[1] - energies[0]) / 2e-4, rel=1e-6, abs=1e-9)


def courses(robot, effects, turning, tilt):
    """Of a robot that turns: in the physics engine, and of the planar model."""
    commands = np.full(PERIODS, 0.015 * robot.torque_limit)
    yaw_rates, held = np.full(EARLIEST + PERIODS + 1, turning), np.concatenate([np.zeros(EARLIEST), commands])
    measured, known = np.zeros((len(yaw_rates), 4)), np.ones(len(yaw_rates), dtype=bool)
    ride = Recording("ride", robot.control_period, held, measured, yaw_rates, known, np.ones(4, dtype=bool))
    states = np.zeros((len(yaw_rates), STATE_COLUMNS))
    states[:, [PlanarState._fields.index(name) for name in ("tilt", "wheel", "rotor")]] = tilt
    planar, start, off = planar_parameters(robot, values_of(effects)), np.array([EARLIEST]), np.zeros((1, 8))
    substeps = round(robot.control_period / STEP)
    expected = predict_open_loop(planar, ride, substeps, states, start, off, PERIODS, np.inf).readings[0]
    restart = RestartState(0.0, heading=float(ride.heading[EARLIEST]), yaw_rate=turning)
    initial = InitialState(tilt, 0.0, 0.0)
    turns = ReplayStart(initial, restart, np.zeros(EARLIEST), np.zeros((0, 3)), yaw_rates[EARLIEST:])
    return replay(robot, effects, STEP, [turns], commands[None])[0, 1:][:, SEEN], expected


EFFECTS = {
    "nothing": [],
    "twice the inertia": [BodyInertia(2.0)],
    "half of the inertia": [BodyInertia(0.5)],
    "twice the mass": [BodyMass(2.0)],
    "a part that swings": [FlexibleFrame(0.1, 5.0, 0.05, 1.8)],
    "the centre of mass ahead": [ComOffset(0.15)],
    "the centre of mass ahead, and half of the inertia": [ComOffset(0.15), BodyInertia(0.5)],
}


@pytest.mark.parametrize("kind", EFFECTS)
@pytest.mark.parametrize("tilt", [0.1, -0.05])
def test_a_body_that_turns_tips_over_as_in_the_physics_engine(paper, kind, tilt):
    (found, expected), (_, straight) = (courses(paper, EFFECTS[kind], turning, tilt) for turning in (3.0, 0.0))
    off, moved = np.abs(found - expected).max(axis=0), np.ptp(expected, axis=0)
    assert (off < 0.02 * moved).all()
    assert (np.abs(expected - straight).max(axis=0) > 5.0 * off)[:2].all()  # of what turning does to the body
