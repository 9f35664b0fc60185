"""Scores against their definitions, by quadrature and Monte Carlo, and what they are best for."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from twbal.core.episode import Episode, Outcome, Provenance
from twbal.core.errors import DataError
from twbal.core.gaussian import Gaussian
from twbal.core.scores import gaussian_crps, gaussian_log_density, scores

ONES = np.ones(2)


def episode(states: np.ndarray) -> Episode:
    """Samples with a course of the state; nothing else of them is scored."""
    observations = np.zeros((len(states), 7))
    observations[:, 0] = 0.02 * np.arange(len(states))
    commands, driven = np.zeros(len(states) - 1), Provenance("paper", "simulation")
    return Episode(("tilt", "speed"), 0.02, observations, states, commands, Outcome.COMPLETED, driven)


def prediction(means: np.ndarray, sd: float) -> list[Gaussian]:
    """The start and H steps, (H + 1, D)."""
    return [Gaussian(mean, sd**2 * np.eye(len(mean))) for mean in means]


@pytest.mark.parametrize(("error", "sd"), [(0.0, 1.0), (0.7, 0.3), (-2.0, 1.5), (0.01, 4.0), (5.0, 0.2)])
def test_the_crps_is_the_integral_of_its_definition(error: float, sd: float) -> None:
    below = quad(lambda y: norm.cdf(y, scale=sd) ** 2, -np.inf, error)[0]
    above = quad(lambda y: norm.sf(y, scale=sd) ** 2, error, np.inf)[0]
    assert gaussian_crps(np.array(error), np.array(sd)) == pytest.approx(below + above, rel=1e-6)


def test_the_crps_is_the_mean_distance_less_half_the_mean_distance_of_two_draws() -> None:
    rng = np.random.default_rng(1)
    first, second = 0.8 * rng.standard_normal((2, 400_000))
    drawn = np.abs(first - 0.5).mean() - 0.5 * np.abs(first - second).mean()
    assert gaussian_crps(np.array(0.5), np.array(0.8)) == pytest.approx(drawn, rel=0.01)


def test_the_crps_of_a_band_without_width_is_the_distance() -> None:
    assert gaussian_crps(np.array([-2.0, 3.0]), np.zeros(2)).tolist() == [2.0, 3.0]


def test_the_log_density_is_the_normal_ones() -> None:
    error, sd = np.array([0.3, -2.0]), np.array([0.1, 1.7])
    assert gaussian_log_density(error, sd) == pytest.approx(norm.logpdf(error, scale=sd))


def drawn(count: int, sd: float, seed: int = 2) -> tuple[np.ndarray, list[Episode]]:
    """Means of a course (41, 2), and trials that lie about it."""
    rng = np.random.default_rng(seed)
    means = np.column_stack([np.linspace(0.3, 0.0, 41), np.linspace(-1.0, 1.0, 41)])
    return means, [episode(means + sd * rng.standard_normal(means.shape)) for _ in range(count)]


def test_the_true_band_scores_better_than_a_narrower_a_wider_or_a_shifted_one() -> None:
    means, trials = drawn(30, 0.2)
    true, *others = (
        scores(prediction(means + shift, 0.2 * factor), trials, [0, 1], ONES)
        for factor, shift in ((1.0, 0.0), (0.4, 0.0), (2.5, 0.0), (1.0, 0.2))
    )
    assert all(other.crps > true.crps and other.log_density < true.log_density for other in others)


def test_the_expected_crps_of_the_true_band_is_its_sd_over_the_root_of_pi() -> None:
    means, trials = drawn(200, 0.2)
    found = scores(prediction(means, 0.2), trials, [0, 1], ONES)
    assert found.crps == pytest.approx(0.2 / np.sqrt(np.pi), rel=0.02)


def test_the_true_band_does_about_as_well_as_the_trials_own_spread_and_a_far_wider_one_much_worse() -> None:
    means, trials = drawn(10, 0.2)
    true, wide = (scores(prediction(means, sd), trials, [0, 1], ONES) for sd in (0.2, 2.0))
    assert true.crps_ratio == pytest.approx(1.0, abs=0.1)
    expected = np.sqrt(2.0 / np.pi) * np.hypot(2.0, 0.2) - 2.0 / np.sqrt(np.pi)  # E|X - y| - ½ E|X - X'|
    assert wide.crps_ratio == pytest.approx(expected / true.crps_of_trials, rel=0.01)
    assert wide.crps_ratio > 3.0
    assert wide.crps_of_trials == true.crps_of_trials


def test_the_trials_own_spread_is_that_of_all_others_at_each_step() -> None:
    _, trials = drawn(4, 0.2)
    courses = np.array([trial.states[1:] for trial in trials])
    by_hand = []
    for i in range(4):
        others = [courses[k] for k in range(4) if k != i]
        mean, sd = np.mean(others, axis=0), np.std(others, axis=0, ddof=1)
        by_hand.append(gaussian_crps(courses[i] - mean, sd))
    found = scores(prediction(np.zeros((41, 2)), 1.0), trials, [0, 1], ONES)
    assert found.crps_of_trials == pytest.approx(np.mean(by_hand))
    assert found.crps_ratio == pytest.approx(found.crps / found.crps_of_trials)


def test_scales_make_the_unit_of_a_channel_irrelevant() -> None:
    means, trials = drawn(5, 0.2)
    units = np.array([180.0 / np.pi, 1000.0])
    in_units = [Gaussian(units * m, np.diag((0.3 * units) ** 2)) for m in means]
    theirs = [episode(units * trial.states) for trial in trials]
    scales = np.array([0.25, 2.5])
    ours = scores(prediction(means, 0.3), trials, [0, 1], scales)
    assert scores(in_units, theirs, [0, 1], units * scales) == pytest.approx(ours)


def test_a_channel_that_costs_nothing_is_not_scored_nor_one_that_is_not_measured() -> None:
    means, trials = drawn(5, 0.2)
    band = prediction(means, 0.2)
    first = scores(band, trials, [0], ONES)
    assert scores(band, trials, [0, 1], np.array([1.0, np.inf])) == first
    assert first != scores(band, trials, [0, 1], ONES)
    assert scores(band, trials, [1], np.array([1.0, np.inf])) is None


def test_a_trial_that_fell_is_scored_as_far_as_it_went() -> None:
    means, trials = drawn(5, 0.2)
    fallen = [trials[0], *(episode(trial.states[:11]) for trial in trials[1:])]
    band = prediction(means, 0.2)
    found = scores(band, fallen, [0, 1], ONES)
    every = [gaussian_crps(trial.states[1:] - means[1 : len(trial.states)], np.array(0.2)) for trial in fallen]
    assert found.crps == pytest.approx(np.concatenate(every).mean())
    short = scores(band[:11], trials, [0, 1], ONES)  # steps that but one trial reached have no spread of their own
    assert found.crps_of_trials == pytest.approx(short.crps_of_trials)
    assert found.crps_ratio == pytest.approx(short.crps_ratio)


def test_what_has_no_spread_or_no_width_is_unknown() -> None:
    means, trials = drawn(2, 0.2)
    two = scores(prediction(means, 0.2), trials, [0, 1], ONES)
    assert (two.crps_of_trials, two.crps_ratio) == (None, None)
    same = scores(prediction(means, 0.2), [trials[0]] * 3, [0, 1], ONES)
    assert (same.crps_of_trials, same.crps_ratio) == (0.0, None)
    assert scores(prediction(means, 0.0), trials, [0, 1], ONES).log_density is None


def test_nothing_to_score_is_an_error() -> None:
    with pytest.raises(DataError, match="None of the 1 episodes"):
        scores(prediction(np.zeros((4, 2)), 1.0), [episode(np.zeros((1, 2)))], [0], ONES)
