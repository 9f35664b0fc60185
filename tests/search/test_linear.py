import numpy as np
import pytest

from twbal.core.cost import SaturatingCost
from twbal.search.linear_starts import regulator, slopes

COST = SaturatingCost(np.zeros(3), np.array([0.25, 2.5, 1.0]))


def riccati_gain(A, B, cost, command_width):
    """Gain of the regulator by iterating the Riccati recursion to its fixed point."""
    Q, P = np.diag(cost.widths**-2.0), np.diag(cost.widths**-2.0)
    for _ in range(20_000):
        gain = B @ P @ A / (command_width**-2.0 + B @ P @ B)
        P = Q + A.T @ P @ (A - np.outer(B, gain))
    return gain


@pytest.mark.parametrize("lags", [0, 1, 2])
def test_secants_of_a_linear_model_are_its_matrices(make_system, lags):
    model, A, B = make_system(lags)
    steps = np.array([0.15, 0.8, 0.5, 8.0, 8.0])[: 3 + lags]
    found_A, found_B = slopes(model, 6.0, steps)
    np.testing.assert_allclose(found_A, A, atol=1e-2 * np.abs(A).max())
    np.testing.assert_allclose(found_B[:3], B[:3], rtol=0.02, atol=1e-5)
    assert np.array_equal(found_A[3:], A[3:])
    np.testing.assert_allclose(found_B[3:], B[3:])


def test_a_secant_looks_past_a_dead_zone(make_system):
    class DeadZone:
        channels = make_system()[0].channels

        def step_mean(self, states, commands):
            acting = np.sign(commands) * np.maximum(np.abs(commands) - 2.0, 0.0)
            return states + np.outer(acting, [0.0, 1.0, 0.0])

    steps = np.array([0.1, 0.1, 0.1])
    assert slopes(DeadZone(), 1.0, steps)[1][1] == 0.0
    assert slopes(DeadZone(), 8.0, steps)[1][1] == pytest.approx(6.0 / 8.0)


@pytest.mark.parametrize("command_width", [2.0, 20.0])
def test_the_regulator_is_the_fixed_point_of_the_riccati_recursion(make_system, command_width):
    _, A, B = make_system()
    gain = regulator(A, B, COST, command_width)
    np.testing.assert_allclose(gain, riccati_gain(A, B, COST, command_width), rtol=1e-4)


@pytest.mark.parametrize("lags", [0, 1, 2])
def test_the_closed_loop_is_stable_also_where_commands_act_late_and_channels_cost_nothing(make_system, lags):
    _, A, B = make_system(lags)
    widths = np.array([0.25, np.inf, np.inf, np.inf, np.inf])[: 3 + lags]
    assert np.abs(np.linalg.eigvals(A)).max() > 1.1
    for cost in (
        SaturatingCost(np.zeros(3 + lags), widths),
        SaturatingCost(np.zeros(3 + lags), np.full(3 + lags, 0.5)),
    ):
        gain = regulator(A, B, cost, 10.0)
        assert np.abs(np.linalg.eigvals(A - np.outer(B, gain))).max() < 1.0


@pytest.mark.parametrize("B", [np.zeros(3), np.array([np.nan, 1.0, 1.0])])
def test_a_system_that_no_command_can_hold_has_no_regulator(make_system, B):
    assert regulator(make_system()[1], B, COST, 10.0) is None
