"""A bias that walks: its spread over time by Monte Carlo, and what it leaves alone."""

import numpy as np
import pytest

from twbal.core.plant import Observation
from twbal.core.start_pose import StartPose
from twbal.effects.effect import assemble
from twbal.effects.gyro_bias_walk import GyroBiasWalk
from twbal.effects.gyro_scale import GyroScale
from twbal.effects.imu_delay import ImuDelay
from twbal.effects.library import library, values_of
from twbal.effects.tilt_filter import TiltFilter
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


@pytest.mark.parametrize("beside", [[], [ImuDelay(0.01), GyroScale(1.2)]], ids=["alone", "with other errors"])
def test_a_filter_of_the_tilt_makes_a_tilt_of_the_bias_that_the_gyro_shows(paper, beside):
    """By the integral of exp(-rate (t - s)) b(s), the bias b being what the gyro of a robot at rest shows."""
    rate, instants = 0.8, np.arange(400) * PERIOD
    sensors = assemble(paper, [GyroBiasWalk(0.05), TiltFilter(rate, 0.02), *beside])
    state = sensors.start(0.001, np.random.default_rng(8))
    seen = np.array([state.sense(REST._replace(time=t)) for t in instants])
    tilt, bias = seen[:, 1], seen[:, 2]
    fine = np.linspace(0.0, instants[-1], 40 * len(instants))
    for n in (40, 200, 399):
        until = fine[fine <= instants[n]]
        expected = np.trapezoid(np.exp(-rate * (instants[n] - until)) * np.interp(until, instants, bias), until)
        assert tilt[n] == pytest.approx(expected, abs=0.01 * np.abs(tilt).max())
    assert np.ptp(tilt) > 0.02


def test_a_filter_takes_nothing_from_the_walk_and_its_rollouts_repeat(paper):
    effects = [[GyroBiasWalk(0.05)], [GyroBiasWalk(0.05), TiltFilter(0.8, 0.02)]]
    models = [assemble(paper, having) for having in (*effects, effects[1])]
    states = [model.start(0.001, np.random.default_rng(8)) for model in models]
    alone, filtered, again = (np.array([state.sense(REST) for _ in range(50)]) for state in states)
    assert np.ptp(alone[:, 2]) > 0.0 and not alone[:, 1].any()
    assert np.array_equal(filtered, again)
    rates = [np.diff(each[:, 2]).std() for each in (alone, filtered)]
    assert rates == pytest.approx([0.05 * PERIOD**0.5] * 2, rel=0.4)


def test_the_planar_model_passes_it_over_and_no_diagnosis_weighs_it(paper):
    assert planar_parameters(paper, values_of([GyroBiasWalk(0.1)])) == planar_parameters(paper, {})
    assert "gyro_bias_walk" not in library()
