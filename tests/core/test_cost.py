from dataclasses import dataclass, field
from itertools import product

import numpy as np
import pytest
from numpy.polynomial.hermite_e import hermegauss

from twbal.core.cost import SaturatingCost, cost_over
from twbal.core.errors import ConfigError
from twbal.core.gaussian import Gaussian

COST = SaturatingCost(np.array([0.1, -0.5, 2.0]), np.array([0.25, 2.5, np.inf]))
CHANGING = SaturatingCost(COST.target, COST.widths, np.array([0.8, 0.0, -0.6]))
COSTS = pytest.mark.parametrize("cost", [COST, CHANGING], ids=["widths", "widths and changes"])
UNITS = np.array([0.25, 2.5, 4.0])


def random_state(seed, width):
    rng = np.random.default_rng(seed)
    root = width * UNITS[:, None] * (rng.standard_normal((3, 3)) / 2 + np.eye(3) / 2)
    return Gaussian(rng.standard_normal(3) * UNITS, root @ root.T)


def test_the_cost_is_zero_on_target_saturates_and_ignores_unpriced_channels():
    assert COST(COST.target) == 0.0
    assert COST(np.array([0.35, -0.5, 1e9])) == pytest.approx(1 - np.exp(-0.5))
    assert COST(np.array([[1e3, 0, 0], [0.1, -3.0, 0.0]])) == pytest.approx([1.0, 1 - np.exp(-0.5)])


@COSTS
@pytest.mark.parametrize("width", [0.01, 0.5, 2.0])
def test_the_expectation_equals_quadrature(width, cost):
    z, w = hermegauss(48)
    z, w = np.array(list(product(z, repeat=3))), np.prod(list(product(w / w.sum(), repeat=3)), axis=1)
    for seed in range(3):
        state = random_state(seed, width)
        x = state.mean + z @ np.linalg.cholesky(state.covariance).T
        assert cost.expected(state).value == pytest.approx(w @ cost(x), rel=1e-5)


@COSTS
def test_the_expectation_lies_within_4_standard_errors_of_samples(cost):
    state = random_state(3, 1.0)
    costs = cost(state.sample(400_000, np.random.default_rng(0)))
    assert abs(costs.mean() - cost.expected(state).value) < 4 * costs.std() / np.sqrt(len(costs))


@COSTS
def test_a_known_state_is_expected_to_cost_what_it_costs(cost):
    mean = random_state(0, 1.0).mean
    assert cost.expected(Gaussian(mean, np.zeros((3, 3)))).value == pytest.approx(float(cost(mean)), rel=1e-12)
    assert cost.at(mean) == pytest.approx(float(cost(mean)), rel=1e-12)


@COSTS
@pytest.mark.parametrize("width", [0.05, 0.5, 3.0])
def test_derivatives_equal_finite_differences(width, cost):
    state = random_state(4, width)
    found = cost.expected(state)
    for e in np.diag(1e-5 * UNITS):
        ends = [cost.expected(Gaussian(state.mean + s * e, state.covariance)).value for s in (1, -1)]
        assert found.by_mean @ e == pytest.approx((ends[0] - ends[1]) / 2, rel=1e-6, abs=1e-12)
    for k, l in product(range(3), repeat=2):
        step = np.zeros((3, 3))
        step[k, l] += 3e-5 * width**2 * UNITS[k] * UNITS[l]
        step = step + step.T
        ends = [cost.expected(Gaussian(state.mean, state.covariance + s * step)).value for s in (1, -1)]
        assert np.sum(found.by_covariance * step) == pytest.approx((ends[0] - ends[1]) / 2, rel=1e-6, abs=1e-12)


def test_the_expectation_stays_a_cost_however_wide_the_state():
    for exponent in range(-6, 13, 2):
        found = COST.expected(random_state(exponent + 6, 10.0**exponent))
        assert 0.0 <= found.value <= 1.0
        assert np.isfinite(found.by_covariance).all()


def test_a_change_of_the_command_costs_as_a_deviation_of_its_width_does():
    names = ("tilt", "command_1", "command_2")
    cost = cost_over(names, {"tilt": 0.25}, None, 20.0, 0.3)
    assert cost(np.array([0.0, 3.0, 9.0])) == pytest.approx(1 - np.exp(-0.5))  # 6 N·m is 0.3 of 20
    assert cost(np.array([0.0, 9.0, 9.0])) == pytest.approx(0.0)
    with pytest.raises(ConfigError, match=r"command_change_width must be positive; found -0\.3"):
        cost_over(names, {"tilt": 0.25}, None, 20.0, -0.3)
    for silent in (cost_over(names, {"tilt": 0.25}, None, 20.0), cost_over(names[:2], {"tilt": 0.25}, None, 20.0, 0.3)):
        assert not silent.change.any()


@COSTS
def test_the_curvature_is_that_of_the_cost_at_its_target(cost):
    h = 1e-3 * UNITS
    numeric = np.empty((3, 3))
    for k, l in product(range(3), repeat=2):
        moves = [(s * np.eye(3)[k] * h, t * np.eye(3)[l] * h, s * t) for s in (1, -1) for t in (1, -1)]
        numeric[k, l] = sum(sign * cost(cost.target + a + b) for a, b, sign in moves) / (4 * h[k] * h[l])
    np.testing.assert_allclose(cost.curvature, numeric, rtol=1e-4, atol=1e-5)


def test_other_widths_leave_the_price_on_changes_but_for_its_factor():
    wider = CHANGING.with_widths(2.0 * CHANGING.widths, 2.0)
    gap = np.array([0.1, 0.4, 0.7])
    assert wider(CHANGING.target + 2.0 * gap) == pytest.approx(float(CHANGING(CHANGING.target + gap)), rel=1e-12)
    assert COST.with_widths(2.0 * COST.widths, 2.0)(COST.target + 2.0 * gap) == pytest.approx(
        float(COST(COST.target + gap)), rel=1e-12
    )


def test_widths_go_by_name_and_past_commands_by_the_torque_limit():
    names = ("speed", "tilt", "command_1", "command_2")
    widths = cost_over(names, {"tilt": 0.25, "acceleration": 15.0}, 0.5, 20.0).widths
    assert widths.tolist() == [np.inf, 0.25, 10.0, np.inf]
    assert cost_over(names, {"tilt": 0.25}, None, 20.0).widths.tolist() == [np.inf, 0.25, np.inf, np.inf]


@pytest.mark.parametrize("widths", [{"speed": 1.0}, {"tilt": 0.0}, {"tilt": -1.0}, {"tilt": float("nan")}])
def test_a_cost_without_a_positive_width_is_refused(widths):
    with pytest.raises(ConfigError, match="positive widths, at least one of them for the state tilt, tilt_rate; found"):
        cost_over(("tilt", "tilt_rate"), widths, None, 20.0)


def test_lists_and_whole_numbers_become_double_precision_and_arrays_stay_what_they_are():
    cost = SaturatingCost([0, 1], np.array([1, 2]), [0.0, 1.0])
    assert all(each.dtype == np.float64 for each in (cost.target, cost.widths, cost.change))
    assert SaturatingCost(COST.target, COST.widths).widths is COST.widths


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        (([0.0], [1.0, 2.0]), r"SaturatingCost has a target of shape \(1,\) and widths of shape \(2,\); expected"),
        ((0.0, 1.0), r"has a target of shape \(\) and widths of shape \(\)"),
        (([0.0, 0.0], [1.0, 0.0]), r"has the widths \[1\.0, 0\.0\]; expected are positive numbers"),
        (([0.0], [-1.0]), r"has the widths \[-1\.0\]"),
        (([0.0], [float("nan")]), r"has the widths \[nan\]"),
        (([0.0], ["wide"]), r"widths of SaturatingCost must be a number or an array of numbers; found \['wide'\]"),
        (([0.0], [1.0], [1.0, 2.0]), r"has a change of shape \(2,\); expected is that of its widths, \(1,\)"),
    ],
)
def test_fields_that_no_cost_can_have_are_refused(fields, said):
    with pytest.raises(ConfigError, match=said):
        SaturatingCost(*fields)


def test_further_numbers_reach_the_class_as_arrays():
    @dataclass(frozen=True, eq=False)
    class Shared(SaturatingCost):
        share: np.ndarray = field(default_factory=lambda: np.array(1.0))

    cost = Shared.over(("tilt",), {"tilt": 0.25}, None, 20.0, share=0.5)
    assert cost.share.shape == () and cost.share.dtype == np.float64 and cost.numbers.share.item() == 0.5
    with pytest.raises(ConfigError, match=r"Shared has no field 'part' beside target and widths; it has change, share"):
        Shared.over(("tilt",), {"tilt": 0.25}, None, 20.0, part=0.5)
