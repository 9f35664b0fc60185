"""Which base g is learned on, beside data whose robot is known and a density from scipy."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.stats
from toy_robot import CHANNELS, RAW, SMOOTHED, episode

from twbal.models.bases import learn_on_likeliest
from twbal.models.dataset import transitions
from twbal.models.dynamics import without_simulation

FAR_OFF, TRUE = 1.0, 0.4  # gains of the commands in two simulations


def simulation(gain):
    """f of a simulated robot."""
    return RAW.learn_simulation([episode(20, k, gain, "simulation") for k in range(6)], CHANNELS, seed=0).model


@pytest.fixture(scope="module")
def bases():
    return [simulation(FAR_OFF), simulation(TRUE), without_simulation(CHANNELS)]


def real(gain, first=50, steps=18):
    return [episode(steps, first + k, gain, "robot") for k in range(2)]


def test_log_evidence_is_the_normal_density_of_the_changes_about_f(bases):
    found = learn_on_likeliest(RAW, bases, real(0.6), seed=0)
    data = transitions(real(0.6), CHANNELS)
    for base, told in zip(bases, found.log_evidences, strict=True):
        g = RAW.learn_measured(base, real(0.6), seed=0).model.g
        for a, said in enumerate(told):
            apart = (data.inputs[:, None] - data.inputs[None]) / g.length_scales[a]
            covariance = g.signal_variance[a] * np.exp(-0.5 * np.sum(apart**2, axis=2))
            covariance += g.noise_variance[a] * np.eye(len(data.inputs))
            density = scipy.stats.multivariate_normal(base.f.mean(data.inputs)[:, a], covariance)
            assert said == pytest.approx(density.logpdf(data.targets[:, a]), abs=1e-5)


@pytest.mark.parametrize(("gain", "chosen"), [(FAR_OFF, 0), (TRUE, 1)])
@pytest.mark.parametrize("recipe", [RAW, SMOOTHED], ids=["raw", "smoothed"])
def test_the_simulation_of_the_true_robot_is_the_likeliest(bases, recipe, gain, chosen):
    found = learn_on_likeliest(recipe, bases, real(gain), seed=0)
    assert found.chosen == chosen
    f = found.learned.model.f  # maybe fitted in a copy of this process
    assert np.array_equal(f.weights, bases[chosen].f.weights)
    others = [total for k, total in enumerate(found.totals) if k != chosen]
    assert found.totals[chosen] > max(others) + 5.0


def test_what_simulations_say_wrongly_of_a_channel_is_likelier_without_them(bases):
    """Commands act the other way round and more strongly; the tilt still follows from its rate as in each f."""
    tilt, rate = learn_on_likeliest(RAW, bases, real(-2.0, steps=60), seed=0).log_evidences.T
    assert rate.argmax() == 2
    assert tilt.argmin() == 2


def test_no_simulation_is_kept_where_it_is_likelier_over_all_channels(bases):
    found = learn_on_likeliest(RAW, bases, turned(real(-2.0, steps=60)), seed=0)
    assert found.chosen == 2
    assert not found.learned.model.has_simulation


def turned(episodes):
    """The tilt, which each f knows well, moves against its rate."""
    return [replace(each, states=each.states * np.array([-1.0, 1.0, 1.0])) for each in episodes]


def held_out_density(base, data, new):
    """Mean log density of the changes in new episodes under f + g of a base, over all channels."""
    model, of_new = RAW.learn_measured(base, data, seed=0).model, transitions(new, CHANNELS)
    g = model.g.predict(of_new.inputs)
    sd = np.sqrt(g.variance + model.g.noise_variance)
    return scipy.stats.norm(model.f.mean(of_new.inputs) + g.mean, sd).logpdf(of_new.targets).sum(axis=1).mean()


def robots(gain, first, count):
    return [episode(10, first + k, gain, "robot") for k in range(count)]


@pytest.mark.parametrize("count", [1, 3, 6])
def test_with_few_samples_a_simulation_that_is_nearly_right_is_kept_and_predicts_better_than_none(bases, count):
    """The robot's gain is 0.45, that of the simulation 0.4."""
    drawn = [robots(0.45, 100 + 10 * draw, count) for draw in range(6)]
    assert [learn_on_likeliest(RAW, bases, data, seed=0).chosen for data in drawn] == [1] * 6
    new = robots(0.45, 900, 30)
    ahead = [held_out_density(bases[1], data, new) - held_out_density(bases[2], data, new) for data in drawn]
    assert np.mean(ahead) > 0.1


def test_no_simulation_is_kept_where_each_is_wrong_and_predicts_best_then(bases):
    new = turned(robots(-2.0, 900, 30))
    for draw in range(4):
        data = turned(robots(-2.0, 100 + 10 * draw, 8))
        assert learn_on_likeliest(RAW, bases, data, seed=0).chosen == 2
        densities = [held_out_density(base, data, new) for base in bases]
        assert densities[2] == max(densities)


def test_of_equal_bases_the_first_is_kept(bases):
    found = learn_on_likeliest(RAW, [bases[1], bases[1]], real(TRUE), seed=0)
    assert found.chosen == 0
    assert found.totals[0] == found.totals[1]


def test_g_on_the_base_that_is_kept_is_that_which_is_learned_on_it_alone(bases):
    chosen = learn_on_likeliest(SMOOTHED, bases, real(TRUE), seed=3)
    alone = SMOOTHED.learn_difference(bases[1], real(TRUE), seed=3)
    for name in ("centres", "length_scales", "signal_variance", "noise_variance", "weights"):
        np.testing.assert_array_equal(getattr(chosen.learned.model.g, name), getattr(alone.model.g, name))
    np.testing.assert_array_equal(chosen.learned.model.process_noise, alone.model.process_noise)
