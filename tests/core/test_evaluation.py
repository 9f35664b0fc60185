"""Verdicts on trials, against cases that can be worked out by hand and against draws from a known distribution."""

from dataclasses import replace

import numpy as np
import pytest

from twbal.core.coverage import coverage95, widened
from twbal.core.episode import Episode, Outcome, Provenance
from twbal.core.errors import ConfigError, DataError
from twbal.core.evaluation import SuccessCriterion, drift, positions, real_cost, succeeded
from twbal.core.gaussian import Array, Gaussian

RULE = SuccessCriterion(tilt_limit=0.5, settled_tilt_limit=0.2, settle_step=10, steps=50)


def episode(tilt: Array, states: Array | None = None, wheel_angle: Array | None = None) -> Episode:
    count = len(tilt)
    observations = np.zeros((count, 7))
    observations[:, 0] = 0.02 * np.arange(count)
    observations[:, 1] = tilt
    observations[:, 4] = 0.0 if wheel_angle is None else wheel_angle
    kept = tilt[:, None] if states is None else states
    names = ("tilt", "tilt_rate", "command_1")[: kept.shape[1]]
    commands = np.zeros(count - 1)
    return Episode(names, 0.02, observations, kept, commands, Outcome.COMPLETED, Provenance("paper", "simulation"))


def damped_tilt(steps: int, rate: float) -> Array:
    t = 0.02 * np.arange(steps + 1)
    tilt: Array = -0.17 * np.exp(rate * t) * np.cos(5.0 * t)
    return tilt


def test_a_damped_tilt_succeeds_and_a_growing_one_does_not() -> None:
    assert succeeded(episode(damped_tilt(50, -2.0)), RULE)
    assert not succeeded(episode(damped_tilt(50, 1.5)), RULE)


def test_a_trial_that_ends_early_fails() -> None:
    assert not succeeded(episode(damped_tilt(49, -2.0)), RULE)


@pytest.mark.parametrize(
    ("step", "tilt", "expected"),
    [(9, 0.3, True), (10, 0.3, False), (50, -0.3, False), (51, 0.3, True), (9, -0.51, False), (9, 0.5, True)],
)
def test_each_limit_holds_where_it_should(step: int, tilt: float, expected: bool) -> None:
    course = np.zeros(61)
    course[step] = tilt
    assert succeeded(episode(course), RULE) is expected


def test_a_rule_that_cannot_be_met_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"at most tilt_limit; found 0\.6 and 0\.5"):
        replace(RULE, settled_tilt_limit=0.6)
    with pytest.raises(ConfigError, match="step 51 of a trial of 50"):
        replace(RULE, settle_step=51)


def linear_system(steps: int) -> list[Gaussian]:
    """Exact p(x_t) of x' = A x + noise, a damped oscillation."""
    A, Q = np.array([[0.99, 0.02], [-0.5, 0.9]]), np.diag([1e-4, 1e-2])
    steps_seen = [Gaussian(np.array([-0.17, 0.0]), np.diag([4e-4, 1e-2]))]
    for _ in range(steps):
        m, S = steps_seen[-1]
        steps_seen.append(Gaussian(A @ m, A @ S @ A.T + Q))
    return steps_seen


def test_states_drawn_from_the_prediction_are_covered_95_times_in_100() -> None:
    rng = np.random.default_rng(3)
    predicted = linear_system(40)
    draws = [np.array([p.sample(1, rng)[0] for p in predicted]) for _ in range(150)]
    share = coverage95(predicted, [episode(x[:, 0], x) for x in draws], [0, 1])
    assert share == pytest.approx(0.95, abs=4 * np.sqrt(0.95 * 0.05 / (150 * 40)))


def test_only_measured_channels_and_predicted_steps_after_the_start_count() -> None:
    predicted = linear_system(3)
    course = np.array([p.mean for p in predicted] + [[9.0, 9.0]])
    course[0] = 9.0
    course[1:, 1] += 5.0
    assert coverage95(predicted, [episode(course[:, 0], course)], [0]) == 1.0
    assert coverage95(predicted, [episode(course[:, 0], course)], [1]) == 0.0
    assert coverage95(predicted, [episode(course[:, 0], course)], [0, 1]) == 0.5


def test_a_short_episode_weighs_by_the_steps_that_it_has() -> None:
    predicted = linear_system(10)
    inside = np.array([p.mean for p in predicted])
    outside = inside[:3] + 9.0
    assert coverage95(predicted, [episode(x[:, 0], x) for x in (inside, outside)], [0, 1]) == pytest.approx(10 / 12)


def test_nothing_to_compare_is_an_error() -> None:
    with pytest.raises(DataError, match="None of the 1 episodes"):
        coverage95(linear_system(3), [episode(np.zeros(1), np.zeros((1, 2)))], [0])
    with pytest.raises(DataError, match="2 channels, the episode 1"):
        coverage95(linear_system(3), [episode(np.zeros(4))], [0])


def test_bands_that_miss_a_steady_error_are_widened_until_other_rollouts_lie_in_them() -> None:
    rng = np.random.default_rng(4)
    predicted = linear_system(40)

    def off() -> Episode:
        course = np.array([p.sample(1, rng)[0] for p in predicted])
        course[1:] += [0.0, 2.0 * predicted[-1].sd[1]]
        return episode(course[:, 0], course)

    others = [off() for _ in range(100)]
    wide = widened(predicted, [off() for _ in range(20)], [0, 1])
    assert coverage95(predicted, others, [1]) < 0.7
    assert coverage95(wide, others, [1]) == pytest.approx(0.95, abs=0.03)
    assert coverage95(wide, others, [0]) == pytest.approx(0.95, abs=0.03)


def test_bands_are_never_narrowed_and_past_commands_and_the_start_stay() -> None:
    predicted = linear_system(6)
    before = np.array([p.covariance for p in predicted])
    course = np.array([p.mean for p in predicted])
    same = widened(predicted, [episode(course[:, 0], course)], [0, 1])
    np.testing.assert_array_equal([p.covariance for p in same], before)
    course[1:] += 1.0
    wide = widened(predicted, [episode(course[:, 0], course)], [0])
    growth = np.array([p.covariance for p in wide]) - before
    assert not growth[0].any()
    growth = growth[1:]
    needed = (1.0 / 1.96) ** 2 - max(0.0, min(p.sd[0] ** 2 for p in predicted[1:]))
    assert 0 < growth[0, 0, 0] <= needed + 1e-12
    growth[:, 0, 0] = 0.0
    assert not growth.any()


def test_bands_cannot_be_widened_by_episodes_of_another_state() -> None:
    with pytest.raises(DataError, match="2 channels, the episode 1"):
        widened(linear_system(3), [episode(np.zeros(4))], [0])


def squared(states: Array) -> Array:
    cost: Array = np.minimum(states[:, 0] ** 2, 1.0)
    return cost


def test_the_cost_sums_the_horizon_without_the_start() -> None:
    course = np.array([9.0, 0.5, 0.1, 0.2, 7.0])
    assert real_cost(episode(course), squared, horizon=3) == pytest.approx(0.25 + 0.01 + 0.04)


def test_each_step_after_a_fall_costs_one() -> None:
    assert real_cost(episode(np.array([0.0, 0.5])), squared, horizon=100) == pytest.approx(0.25 + 99)
    assert real_cost(episode(np.array([0.0])), squared, horizon=100) == 100.0


def test_a_wheel_rolling_under_a_tilting_body_is_followed_over_ground() -> None:
    rolled = np.linspace(0.0, -2.0, 51)
    tilt = damped_tilt(50, -1.0)
    course = episode(tilt, wheel_angle=rolled / 0.15 - tilt + 3.0)
    np.testing.assert_allclose(positions(course, wheel_radius=0.15), rolled, atol=1e-12)
    assert drift(course, wheel_radius=0.15) == pytest.approx(2.0)
