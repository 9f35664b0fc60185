"""The probability that an effect would have been found, against how often it is found in simulated recordings."""

import numpy as np
import pytest
from synthetic_recordings import NOISE, synthetic_recording

from twbal.diagnosis.candidates import always_free
from twbal.diagnosis.effect_candidates import candidates_for
from twbal.diagnosis.hypothesis import fit_hypothesis
from twbal.diagnosis.power import detection_power, gains_at
from twbal.diagnosis.score_test import score_candidates
from twbal.diagnosis.settings import Tolerances
from twbal.planar.parameters import planar_parameters
from twbal.sysid.model import Data, Model
from twbal.sysid.noise import NoiseModel

PERIODS, ROBOTS, RECORDINGS = 400, 30, 8
SPREAD = 0.03 * 3.0**0.5  # of a uniform distribution with a standard deviation of 3 %, as the tolerance is
TOLERANCES = Tolerances(0.03, 0.15, 0.0003, 0.00025, 0.0, 0.0, 0.0, 0.15)
TEMPERATURE, LOG_ODDS = 3.0, float(np.log(1.0 / 9.0))


def fitted(robot, effects, seed, candidates=()):
    """Data of a robot whose sheet is right, and the set of effects fitted to them."""
    data = Data([synthetic_recording(robot, effects, seed, PERIODS, tolerance=SPREAD)], 10)
    noise = NoiseModel(np.array([*NOISE.values()]), np.array([0.002, 0.002]))
    planar = planar_parameters(robot, {})
    always = always_free(TOLERANCES, planar, 1)
    return data, fit_hypothesis(data, Model(planar, 0.0, noise), always, candidates, 2)


@pytest.mark.parametrize(("name", "size"), [("viscous_friction", 0.01), ("dead_zone", 0.02), ("gyro_scale", 0.19)])
def test_effects_are_found_as_often_as_was_said(paper, name, size):
    """Said of recordings without the effect; found by fits to others with it, of other noise and other commands."""
    (candidate,) = (each for each in candidates_for(paper) if each.name == name)
    said, found, first = 0.0, 0, candidate.parameters[0]
    effects = {name: {first.name: first.none + size * (first.start - first.none)}}
    for seed in range(RECORDINGS):
        data, base = fitted(paper, {}, 100 + seed)
        scored = score_candidates(data, base.fit, [candidate])
        (power,) = detection_power(scored, base, data, TEMPERATURE, LOG_ODDS, shares=(size,))
        said += power.sizes[0].probability / RECORDINGS
    for seed in range(ROBOTS):
        _, without = fitted(paper, effects, seed)
        _, present = fitted(paper, effects, seed, (candidate,))
        found += without.bic - present.bic > -2.0 * TEMPERATURE * LOG_ODDS
    assert 0.2 < said < 0.8
    assert abs(found / ROBOTS - said) < 3.0 * np.sqrt(said * (1.0 - said) / ROBOTS)


def test_what_would_gain_without_end_is_sure_to_be_found():
    gains = gains_at({0.5: 4.0, 1.0: np.inf}, np.array([0.25, 1.0, 2.0]))
    assert np.isfinite(gains).all()
    assert gains[0] == pytest.approx(1.0)
    assert gains[1] >= 1e12


def test_gains_grow_with_the_square_of_a_size():
    np.testing.assert_allclose(gains_at({0.1: 4.0, 1.0: 400.0}, np.array([0.05, 0.5, 3.0])), [1.0, 100.0, 3600.0])


def test_a_limit_that_nothing_meets_would_have_gained_nothing():
    np.testing.assert_array_equal(gains_at({1.0: 0.0, 2.0: 0.0, 4.0: 100.0}, np.array([0.5, 2.0, 3.0])), [0, 0, 25.0])


def test_what_every_model_has_within_a_tolerance_is_found_beyond_it(paper):
    """An IMU that is late by less than its timing may be off by is no finding; one that is far later is."""
    (candidate,) = (each for each in candidates_for(paper) if each.name == "imu_delay")
    _, base = fitted(paper, {}, 100)
    data, _ = fitted(paper, {}, 100)
    scored = score_candidates(data, base.fit, [candidate])
    (power,) = detection_power(scored, base, data, TEMPERATURE, LOG_ODDS)
    said = [size.probability for size in power.sizes]
    assert said == sorted(said)
    within, beyond = (TOLERANCES.imu_timing, 10.0 * TOLERANCES.imu_timing)
    values = [size.value for size in power.sizes]
    assert np.interp(within, values, said) < 0.05
    assert np.interp(beyond, values, said) > 0.95
    for delay, is_found in ((within, False), (beyond, True)):
        effects = {"imu_delay": {"delay": delay}}
        for seed in range(4):
            _, without = fitted(paper, effects, seed)
            _, present = fitted(paper, effects, seed, (candidate,))
            assert (without.bic - present.bic > -2.0 * TEMPERATURE * LOG_ODDS) == is_found


def test_lower_limits_are_larger_effects(paper):
    (candidate,) = (each for each in candidates_for(paper) if each.name == "torque_saturation")
    data, base = fitted(paper, {}, 100)
    (power,) = detection_power(score_candidates(data, base.fit, [candidate]), base, data, TEMPERATURE, LOG_ODDS)
    values, said = zip(*((size.value, size.probability) for size in power.sizes), strict=True)
    assert min(values) > 0.0
    assert list(values) == sorted(values, reverse=True)
    assert list(said) == sorted(said)
    assert said[-1] > 0.95
    largest = float(np.abs(data.recordings[0].commands).max())
    assert power.least < largest
    met = [limit < power.least for limit in values]
    assert [chance > 0.5 for chance in said] == met
