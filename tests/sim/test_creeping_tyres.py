"""Tyres that creep in the physics engine do as in the planar model, whose own tests hold it against an integrator."""

import numpy as np
import pytest

from twbal.core.plant import Observation
from twbal.core.robot_model import Ground
from twbal.core.robot_parameters import RobotParameters
from twbal.core.start_pose import InitialState, StartPose
from twbal.effects.coulomb_friction import CoulombFriction
from twbal.effects.effect import assemble
from twbal.effects.ground_slope import GroundSlope
from twbal.effects.rotor_inertia import RotorInertia
from twbal.effects.wheel_slip import WheelSlip
from twbal.planar.planar_plant import PlanarPlant
from twbal.sim.bullet_plant import SimPlant
from twbal.sim.creeping_tyres import CreepingTyres
from twbal.sim.world import World

STEP = 0.0005
SMALL = RobotParameters(
    name="small",
    body_mass=0.66,
    com_height=0.18,
    com_offset=0.0,
    body_inertia_pitch=1.5e-3,
    body_inertia_roll=1.9e-3,
    body_inertia_yaw=1.1e-3,
    wheel_mass=0.02,
    wheel_radius=0.028,
    wheel_inertia=6.0e-5,
    wheel_width=0.028,
    track=0.14,
    torque_limit=0.77,
    control_period=0.03,
)
SEEN = [Observation._fields.index(name) for name in ("tilt", "tilt_rate", "wheel_angle", "wheel_rate")]


def course(plant, commands):
    with plant:
        return np.array([plant.reset(0), *(plant.step(float(u)) for u in commands)])[:, SEEN]


@pytest.mark.parametrize("creep", [0.01, 0.05, 0.15])
def test_engine_and_planar_model_agree(paper, creep):
    rng = np.random.default_rng(5)
    commands = np.repeat(rng.uniform(-3.0, 3.0, 10), 2)
    settings = {"robot": paper, "start": StartPose(0.03, 0.0, 0.0, 0.0), "physics_step": STEP, "seed": 0}
    sticking, creeping = WheelSlip(0.25, 0.0), WheelSlip(0.25, creep)
    engine, planar = (course(kind(effects=[creeping], **settings), commands) for kind in (SimPlant, PlanarPlant))
    without = course(SimPlant(effects=[sticking], **settings), commands)
    moved = np.ptp(planar, axis=0)
    assert (np.abs(engine - planar).max(axis=0) < 0.01 * moved).all()
    assert (np.abs(engine - planar).max(axis=0) < 0.2 * np.abs(without - planar).max(axis=0)).all()


@pytest.mark.parametrize("friction", [None, CoulombFriction(0.0138)], ids=["", "dry friction"])
@pytest.mark.parametrize("slip", [WheelSlip(0.04, 0.15), WheelSlip(0.3, 0.02)], ids=["ice", "creep"])
def test_rotors_are_as_heavy_on_wheels_that_slip(slip, friction):
    """On a small robot most of whose wheels' inertia is that of geared rotors."""
    commands = 0.05 * np.sin(2.0 * np.arange(10))
    settings = {"robot": SMALL, "start": StartPose(0.02, 0.0, 0.0, 0.0), "physics_step": 0.0005, "seed": 0}
    beside = [] if friction is None else [friction]
    engine, planar = (
        course(kind(effects=[slip, RotorInertia(0.8), *beside], **settings), commands)
        for kind in (SimPlant, PlanarPlant)
    )
    assert (np.abs(engine - planar).max(axis=0) < 0.05 * np.ptp(planar, axis=0)).all()


def test_tyres_that_creep_do_not_slide_sideways(paper):
    """Against sliding down a slope that rises to the left: the heading is across it."""
    model = assemble(paper, [WheelSlip(0.5, 0.05), GroundSlope(0.1)])
    world, effect_state = World(model, STEP), model.start(STEP, np.random.default_rng(0))
    world.reset(InitialState(0.0, 0.0, 0.0), heading=np.pi / 2)
    world.advance(0.0, effect_state, 400)
    assert abs(world.pose().y) < 1e-4
    world.close()


def test_tyres_in_the_air_do_not_pull(paper):
    tyres = CreepingTyres(paper, Ground(grip=0.5, tyre_creep=0.05), STEP)
    assert tyres.pull(1.0, 0.0) == pytest.approx(-0.5 * 12.0 * 9.81, rel=0.01)  # the first step, at rest on the ground
    assert tyres.pull(1.0, 0.0) == 0.0
