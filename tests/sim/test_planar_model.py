"""Physics engine and planar model agree, effect by effect: two codes that share nothing but the definition."""

import numpy as np
import pytest
from hydra import compose
from hydra.utils import instantiate

from twbal.cli.composition import composing
from twbal.core.plant import Observation
from twbal.core.start_pose import StartPose
from twbal.effects.library import library, nodes
from twbal.effects.parameter import parameters_of
from twbal.planar.planar_plant import PlanarPlant
from twbal.sim.bullet_plant import SimPlant

STEP, PERIODS = 0.00025, 15
SEEN = [Observation._fields.index(name) for name in ("tilt", "tilt_rate", "wheel_angle", "wheel_rate")]
START = StartPose(-0.1, 0.0, 0.0, 0.0)
CLOSE = {
    "backlash": np.array([0.1, 0.3, 0.1, 0.3]),
    "backlash_behind_encoder": np.array([0.1, 0.3, 0.3, 0.3]),
    "wheel_slip": 0.1,
    "cable_spring": 0.02,
    "rolling_resistance": 0.02,
}
"""Largest difference as a share of what the effect does, of all channels or of each; 0.01 for all other effects.

On tyres that slip the engine's contact takes another share of the weight. At each impact of a backlash the rates jump,
and impacts fall on other steps in the two codes: an instant between them differs by a whole jump. A finer step moves
the impacts and brings rates no closer (0.11, 0.24, 0.01 and 0.16 at steps of 0.5, 0.25, 0.125 and 0.0625 ms); angles,
which do not jump, stay within 0.07. An encoder on the rotor's side of a gap sees the rotor's angle, which turns on at
another rate until the other code has its impact, too."""


@pytest.fixture(scope="module")
def robot():
    with composing():
        return instantiate(compose("sim_collect").robot)


@pytest.fixture(scope="module")
def commands(robot):
    """What a regulator that is pushed about commands."""
    pushes, found = np.random.default_rng(3).normal(0.0, 5.0, PERIODS), []
    with PlanarPlant(robot=robot, effects=[], start=START, physics_step=STEP, seed=0) as plant:
        seen = plant.reset(0)
        for t in range(PERIODS):
            push = pushes[t - t % 5]
            speed = robot.wheel_radius * (seen.wheel_rate + seen.tilt_rate)
            found.append(80 * seen.tilt + 14 * seen.tilt_rate + 6 * speed + push)
            seen = plant.step(found[-1])
    return found


def course(plant, commands):
    with plant:
        return np.array([plant.reset(0), *(plant.step(u) for u in commands)])[:, SEEN]


@pytest.mark.parametrize("name", library())
def test_engine_and_planar_model_agree_on_what_an_effect_does(name, robot, commands):
    effect = instantiate(nodes()[name])
    beside = [instantiate(nodes()[other]) for other in effect.acts_on[:1]]
    settings = {"robot": robot, "start": START, "physics_step": STEP, "seed": 0}
    engine = course(SimPlant(effects=[effect, *beside], **settings), commands)
    planar = course(PlanarPlant(effects=[effect, *beside], **settings), commands)
    without = course(PlanarPlant(effects=beside, **settings), commands)
    size = np.array([0.01, 0.1, 0.03, 0.3])  # below which an effect counts as no larger, by channel
    does = np.maximum(np.abs(planar - without).max(axis=0), size)
    assert (np.abs(planar - without).max(axis=0) > 0.1 * size).any(), f"{effect} shows nothing; choose another `value`"
    assert (np.abs(engine - planar).max(axis=0) < CLOSE.get(name, 0.01) * does).all()


@pytest.mark.parametrize("name", ["backlash", "backlash_behind_encoder"])
def test_engine_and_planar_model_agree_on_gears_that_bend(name, robot, commands):
    """In the first impacts; later ones tell small differences of the first. No rate jumps, so rates agree, too."""
    effect = library()[name](0.05, 0.5, 0.01, 0.3)
    settings = {"robot": robot, "start": START, "physics_step": STEP, "seed": 0}
    engine = course(SimPlant(effects=[effect], **settings), commands[:6])
    planar = course(PlanarPlant(effects=[effect], **settings), commands[:6])
    rigid = course(PlanarPlant(effects=[library()[name](0.05, 0.5)], **settings), commands[:6])
    does = np.abs(planar - rigid).max(axis=0)
    assert (np.abs(engine - planar).max(axis=0) < 0.1 * does).all()


@pytest.mark.parametrize("name", library())
def test_an_effect_with_its_neutral_values_does_nothing_in_the_engine(name, robot, commands):
    kind = library()[name]
    neutral = kind(**{key: known.neutral for key, known in parameters_of(kind).items()})
    settings = {"robot": robot, "start": START, "physics_step": 0.001, "seed": 0}
    there, without = (course(SimPlant(effects=effects, **settings), commands[:5]) for effects in ([neutral], []))
    np.testing.assert_allclose(there, without, rtol=0, atol=1e-9)
