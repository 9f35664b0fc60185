"""A bias that walks: its spread over time by Monte Carlo, and what it leaves alone."""

import numpy as np

from twbal.core.plant import Observation
from twbal.core.start_pose import StartPose
from twbal.effects.gyro_bias_walk import GyroBiasWalk
from twbal.effects.library import library, values_of
from twbal.planar.parameters import planar_parameters
from twbal.sim.bullet_plant import SimPlant

PERIOD, DENSITY = 0.02, 0.004
REST = Observation(*(0.0,) * len(Observation._fields))


def biases(seed, periods):
    gyro = GyroBiasWalk(DENSITY).start(PERIOD, np.random.default_rng(seed))
    return np.array([gyro(REST).tilt_rate for _ in range(periods + 1)])


def test_its_spread_grows_with_the_root_of_time_and_its_steps_are_independent():
    walks = np.array([biases(seed, 200) for seed in range(2000)])
    assert (walks[:, 0] == 0.0).all()
    for k in (1, 50, 200):
        np.testing.assert_allclose(walks[:, k].std(), DENSITY * np.sqrt(k * PERIOD), rtol=0.06)
    steps = np.diff(walks, axis=1)
    assert abs(np.corrcoef(steps[:, :-1].ravel(), steps[:, 1:].ravel())[0, 1]) < 0.01


def test_the_same_seed_gives_the_same_walk_and_another_one_another():
    assert np.array_equal(biases(3, 100), biases(3, 100))
    assert not np.array_equal(biases(3, 100), biases(4, 100))


def test_in_the_engine_the_gyro_alone_shows_it(paper):
    settings = {"robot": paper, "start": StartPose(0.02, 0.0, 0.0, 0.0), "physics_step": 0.001, "seed": 6}
    seen = []
    for effects in ([], [GyroBiasWalk(DENSITY)]):
        with SimPlant(effects=effects, **settings) as plant:
            seen.append(np.array([plant.reset(0), *(plant.step(0.0) for _ in range(20))]))
    rate = Observation._fields.index("tilt_rate")
    walk = (seen[1] - seen[0])[:, rate]
    assert walk[0] == 0.0 and (np.diff(walk) != 0.0).all()
    np.testing.assert_array_equal(np.delete(seen[0], rate, axis=1), np.delete(seen[1], rate, axis=1))


def test_the_planar_model_passes_it_over_and_no_diagnosis_weighs_it(paper):
    assert planar_parameters(paper, values_of([GyroBiasWalk(0.1)])) == planar_parameters(paper, {})
    assert "gyro_bias_walk" not in library()
