from dataclasses import asdict

import numpy as np
import pytest

from twbal.core.errors import ConfigError
from twbal.core.start_pose import StartPose
from twbal.effects.torque_gain import TorqueGain
from twbal.sim.bullet_plant import SimPlant
from twbal.sim.randomised import RandomisedPlant

DRAWS = {"torque_gain": {"gain": [0.5, 1.5]}, "dead_zone": {"width": [0.0, 3.0]}}
COMMANDS = 5.0 * np.sin(np.arange(12))


def randomised(robot, draws=DRAWS, seed=4):
    start = StartPose(-0.1, 0.0, 0.0, 0.0)
    return RandomisedPlant(robot=robot, effects=[], draws=draws, start=start, physics_step=0.001, seed=seed)


def course(plant, trial):
    return np.array([plant.reset(trial), *(plant.step(u) for u in COMMANDS)])


def test_each_trial_has_a_robot_of_its_own_and_the_same_one_each_time(paper):
    with randomised(paper) as plant:
        first, second, again = (course(plant, trial) for trial in (0, 1, 0))
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - second).max() > 0.01


def test_a_trial_is_that_of_a_simulation_with_the_drawn_effects(paper):
    with randomised(paper) as plant:
        found, effects = course(plant, 3), plant.drawn(3)
    start = StartPose(-0.1, 0.0, 0.0, 0.0)
    with SimPlant(robot=paper, effects=effects, start=start, physics_step=0.001, seed=4) as plant:
        np.testing.assert_array_equal(found, course(plant, 3))


def test_a_drawn_effect_takes_the_place_of_one_of_its_kind(paper):
    start = StartPose(-0.1, 0.0, 0.0, 0.0)
    alone = RandomisedPlant(
        robot=paper, effects=[TorqueGain(0.3)], draws=DRAWS, start=start, physics_step=0.001, seed=4
    )
    with alone, randomised(paper) as plant:
        np.testing.assert_array_equal(course(alone, 3), course(plant, 3))


def test_effects_that_the_planar_model_does_not_have_are_drawn_too(paper):
    draws = {"lost_commands": {"share": [0.3, 0.5]}}
    with randomised(paper, draws) as plant:
        found, (effect,) = course(plant, 3), plant.drawn(3)
    assert 0.3 <= effect.share <= 0.5
    with randomised(paper, {}) as plant:
        assert np.abs(found - course(plant, 3)).max() > 1e-3


def test_draws_fill_their_ranges(paper):
    with randomised(paper) as plant:
        gains = [next(iter(asdict(effect).values())) for trial in range(300) for effect in plant.drawn(trial)[:1]]
    assert 0.5 <= min(gains) < 0.52
    assert 1.48 < max(gains) <= 1.5
    assert np.mean(gains) == pytest.approx(1.0, abs=0.06)


@pytest.mark.parametrize(
    ("draws", "complaint"),
    [
        ({"luck": {"size": [0, 1]}}, "no effect 'luck'"),
        ({"torque_gain": {"size": [0, 1]}}, "torque_gain has no parameter 'size'"),
        ({"torque_gain": {"gain": [2.0, 1.0]}}, r"torque_gain.gain must be \[lowest, highest\]"),
    ],
)
def test_bad_ranges_are_refused(paper, draws, complaint):
    with pytest.raises(ConfigError, match=complaint):
        randomised(paper, draws)
