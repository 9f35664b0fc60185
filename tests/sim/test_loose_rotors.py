"""Rotors behind play in the physics engine, where part of them turns relative to the body."""

from math import pi

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from twbal.core.plant import Observation
from twbal.core.robot_parameters import GRAVITY, RobotParameters
from twbal.core.start_pose import InitialState, StartPose
from twbal.effects.backlash import Backlash
from twbal.effects.backlash_behind_encoder import BacklashBehindEncoder
from twbal.effects.effect import assemble
from twbal.effects.presliding import Presliding
from twbal.effects.rolling_resistance import RollingResistance
from twbal.effects.rotor_inertia import RotorInertia
from twbal.effects.wheel_slip import WheelSlip
from twbal.planar.planar_plant import PlanarPlant
from twbal.sim.bullet_plant import SimPlant
from twbal.sim.world import World

SMALL = RobotParameters(
    name="small",
    body_mass=0.29,
    com_height=0.0143,
    com_offset=0.0,
    body_inertia_pitch=2.3e-4,
    body_inertia_roll=2.6e-4,
    body_inertia_yaw=2.7e-4,
    wheel_mass=0.02,
    wheel_radius=0.04,
    wheel_inertia=2.17e-4,
    wheel_width=0.01,
    track=0.107,
    torque_limit=2.0,
    control_period=0.01,
)
"""Most of its inertia is that of its rotors, as on a Balboa; its tyres lose their grip in hard impacts."""
SEEN = [Observation._fields.index(name) for name in ("tilt", "tilt_rate", "wheel_angle", "wheel_rate")]


def course(plant, commands):
    with plant:
        return np.array([plant.reset(0), *(plant.step(float(u)) for u in commands)])[:, SEEN]


@pytest.mark.parametrize("kind", [Backlash, BacklashBehindEncoder])
@pytest.mark.parametrize("share", [0.3, 0.5, 0.7, 0.9])
@pytest.mark.parametrize("step", [0.001, 0.0005])
def test_geared_rotors_behind_play_do_as_in_the_planar_model(kind, share, step):
    """The planar model's own tests hold it against an integrator (planar/test_backlash.py)."""
    commands = 0.06 * np.sin(0.5 * np.arange(20))
    settings = {"robot": SMALL, "start": StartPose(0.02, 0.0, 0.0, 0.0), "physics_step": step, "seed": 0}
    effects = [kind(0.02, share), RotorInertia(0.89)]
    engine, planar = (course(plant(effects=effects, **settings), commands) for plant in (SimPlant, PlanarPlant))
    error = np.sqrt(np.mean((engine - planar) ** 2, axis=0))
    assert (error < 0.05 * np.ptp(planar, axis=0)).all()


def sliding(robot, share, geared, grip, torque):
    """Motion of wheels, body, rotors and axle, φ, θ, ρ and x, and their rates, on gears that bend."""
    m, l, r, spin = robot.body_mass, robot.com_height, robot.wheel_radius, 2.0 * robot.wheel_inertia
    total, rotors, behind = m + 2.0 * robot.wheel_mass, share * spin, min(share, geared) * spin
    beside, body = geared * spin - behind, robot.body_inertia_pitch + m * l**2
    stiffness, damping = rotors * (pi / 0.004) ** 2, 2.0 * 0.4 * rotors * pi / 0.004

    def motion(t, z):
        tilt, rate = z[1], z[5]
        beyond = z[2] - z[0] - np.clip(z[2] - z[0], -0.015, 0.015)
        pull = stiffness * beyond + damping * (z[6] - z[4])
        pull = pull if pull * beyond > 0.0 else 0.0
        tied = m * l * np.cos(tilt)
        inertia = np.array(
            [
                [spin - rotors, -beside, 0.0, 0.0],
                [-beside, body + geared * spin, -behind, tied],
                [0.0, -behind, rotors, 0.0],
                [0.0, tied, 0.0, total],
            ]
        )
        weight, outwards = m * GRAVITY * l * np.sin(tilt), m * l * np.sin(tilt) * rate**2
        forces = np.array([pull, weight - torque(t), torque(t) - pull, outwards])
        leans = np.linalg.solve(inertia, forces)[1]
        load = total * GRAVITY - m * l * (np.cos(tilt) * rate**2 + np.sin(tilt) * leans)
        traction = grip * load * np.tanh((r * z[4] - z[7]) / 2e-3)
        return np.concatenate([z[4:], np.linalg.solve(inertia, forces + traction * np.array([-r, 0.0, 0.0, 1.0]))])

    return motion


@pytest.mark.parametrize("share", [0.3, 0.5, 0.9])
def test_wheels_that_impacts_tear_off_the_ground_do_as_an_integrator_says(share):
    period, periods, grip, geared = SMALL.control_period, 12, 0.3, 0.89
    commands = 0.2 * np.sin(1.7 * np.arange(periods) + 1.0)
    times = period * np.arange(periods + 1)
    motion = sliding(SMALL, share, geared, grip, lambda t: commands[min(int(t / period + 1e-9), periods - 1)])
    start = [0.02, 0.02, 0.02, 0.0, 0.0, 0.0, 0.0, 0.0]
    z = solve_ivp(motion, (0.0, times[-1]), start, method="LSODA", t_eval=times, max_step=2e-4, rtol=1e-7).y
    assert np.abs(z[7] - SMALL.wheel_radius * z[4]).max() > 0.03  # they slide
    true = np.array([z[1], z[5], z[0] - z[1], z[4] - z[5]]).T
    effects = [Backlash(0.03, share, 0.004, 0.4), RotorInertia(geared), WheelSlip(grip, 0.0)]
    settings = {"robot": SMALL, "start": StartPose(0.02, 0.0, 0.0, 0.0), "physics_step": 0.00025, "seed": 0}
    found = course(SimPlant(effects=effects, **settings), commands)
    error = np.sqrt(np.mean((found - true) ** 2, axis=0))  # an impact an instant earlier is a jump of a rate
    assert (error < 0.05 * np.ptp(true, axis=0)).all()


def over_ground(robot, effects, steps=60, settled=20):
    """Slip of the axle and rate of the wheels over ground in each physics step, without torque."""
    model = assemble(robot, effects)
    world, nothing = World(model, 0.0005), model.start(0.0005, np.random.default_rng(0))
    world.reset(InitialState(0.02, 0.0, 0.0))
    motions = []
    for _ in range(steps):
        world.advance(0.0, nothing, 1)
        motions.append(world.motion())
    world.close()
    rates = np.array([m.wheel_rate + m.tilt_rate for m in motions[settled:]])
    return np.array([m.speed for m in motions[settled:]]) - robot.wheel_radius * rates, rates


@pytest.mark.parametrize("share", [0.5, 0.9])
def test_dry_rolling_resistance_holds_wheels_whose_rotors_are_behind_play(paper, regbot, share):
    """In the gap, the wheels are without them, and easier to stop."""
    for robot in (paper, regbot, SMALL):
        _, rates = over_ground(robot, [Backlash(0.05, share), RollingResistance(0.05 * robot.torque_limit)])
        assert np.abs(rates).max() < 2e-5


@pytest.mark.parametrize("share", [0.5, 0.9])
def test_tyres_creep_quietly_beside_rotors_behind_play(paper, regbot, share):
    """Slip by which traction moves the axle at its acceleration a: 3 μ g of it for each `creep` of slip at first."""
    for robot in (paper, regbot, SMALL):
        slip, rates = over_ground(robot, [Backlash(0.05, share), WheelSlip(0.9, 0.005)])
        acceleration = np.abs(np.diff(slip + robot.wheel_radius * rates)).max() / 0.0005
        assert acceleration < 5.0
        assert np.abs(slip).max() < 0.005 * acceleration / (3.0 * 0.9 * GRAVITY) + 1e-7


def test_bristles_on_the_ground_know_that_rotors_are_behind_play(paper):
    """An impulse changes the rate of the wheels alone the more, which counts where the bristles are stiff."""
    beside = [RollingResistance(0.05 * paper.torque_limit), Presliding(0.001)]
    alone, loose = (World(assemble(paper, effects), 0.0005) for effects in (beside, [Backlash(0.05, 0.9), *beside]))
    mobilities = [world._surroundings._bristles._mobility for world in (alone, loose)]
    assert mobilities[1] > mobilities[0]
    for world in (alone, loose):
        world.close()
