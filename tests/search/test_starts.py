from dataclasses import replace

import numpy as np
import pytest

from twbal.core.errors import ConfigError
from twbal.policies.linear import LinearPolicy
from twbal.search.starts import PolicyParametrisation, linear_policy, starting_policies, starts_on

SCALE = {"tilt": 0.15, "tilt_rate": 0.8, "speed": 0.5}
NAMES = ("tilt", "tilt_rate", "speed", "command_1")
GAIN = np.array([-60.0, -12.0, -6.0, 0.1])


@pytest.fixture
def starts_of(make_task):
    def make(model, policy_shape, earlier=(), seed=0, **told):
        return starting_policies(make_task(model, **told), policy_shape, 20.0, earlier, np.random.default_rng(seed))

    return make


def shape(linear, basis=40, weight_sd=0.01):
    return PolicyParametrisation(basis, linear, SCALE, command_scale=0.4, weight_sd=weight_sd)


def test_scales_go_by_name_and_past_commands_by_the_torque_limit():
    assert shape(True).scales(NAMES, 20.0).tolist() == [0.15, 0.8, 0.5, 8.0]
    with pytest.raises(ConfigError, match="no entry for acceleration; it has: tilt, tilt_rate, speed"):
        shape(True).scales(("tilt", "acceleration"), 20.0)


def test_with_a_linear_part_the_law_is_minus_gain_times_state_where_the_squash_is_straight():
    policy = linear_policy(shape(True, weight_sd=0.0), NAMES, 20.0, GAIN, np.random.default_rng(0))
    states = 0.02 * np.random.default_rng(1).standard_normal((100, 4)) * [0.15, 0.8, 0.5, 8.0]
    np.testing.assert_allclose(policy.command(states), -states @ GAIN, atol=1e-3)
    assert np.array_equal(policy.weights, np.zeros(40))


def test_without_one_the_basis_functions_imitate_it_over_their_support():
    rng = np.random.default_rng(0)
    plain = linear_policy(shape(False), NAMES, 20.0, GAIN, rng)
    linear = linear_policy(shape(True, weight_sd=0.0), NAMES, 20.0, GAIN, rng)
    assert not plain.gain.any()
    states = 0.7 * np.random.default_rng(1).standard_normal((500, 4)) * [0.15, 0.8, 0.5, 8.0]
    wanted = linear.activation(states)
    assert np.abs(plain.activation(states) - wanted).mean() < 0.15 * np.abs(wanted).mean()


@pytest.mark.parametrize("linear", [True, False])
def test_all_starts_are_there_finite_and_named(make_system, starts_of, linear):
    model, _, _ = make_system(1)
    rng = np.random.default_rng(0)
    earlier = [linear_policy(shape(linear), NAMES, 20.0, GAIN, rng) for _ in range(2)]
    starts = starts_of(
        model,
        shape(linear),
        earlier,
        seed=3,
        linearisation_amplitudes=(0.3, 0.6),
        lqr_command_widths=(1.0, 0.1),
        gain_scales=(1.0, 0.5),
    )
    regulators = [f"regulator (swing {s:g}, width {w:g})" for s in (0.3, 0.6) for w in (1, 0.1)]
    old = [f"policy {i} x {share:g}" for i in range(2) for share in (1, 0.5)]
    assert [s.origin for s in starts] == [*regulators, *old, "random"]
    for start in starts:
        policy = start.policy
        assert (policy.channels, policy.max_command) == (NAMES, 20.0)
        assert all(np.isfinite(v).all() for v in (policy.centres, policy.weights, policy.lengths, policy.gain))
        assert (policy.lengths > 0).all()
        assert linear or not policy.gain.any()


@pytest.mark.parametrize("bias", [0.0, 0.3])  # of a robot that balances at another tilt than 0
def test_a_share_weakens_an_earlier_policy_before_the_squash(make_system, starts_of, bias):
    model, _, _ = make_system(1)
    earlier = linear_policy(shape(True, weight_sd=1.0), NAMES, 20.0, GAIN, np.random.default_rng(0))
    earlier = replace(earlier, bias=bias)
    starts = starts_of(model, shape(True), [earlier], linearisation_amplitudes=(), gain_scales=(0.5,))
    states = np.random.default_rng(1).standard_normal((20, 4))
    np.testing.assert_allclose(starts[0].policy.activation(states), 0.5 * earlier.activation(states), rtol=1e-12)


def test_a_regulator_start_holds_the_model(make_system, starts_of):
    model, A, B = make_system(1)
    starts = starts_of(model, shape(True), lqr_command_widths=(0.3,))
    x = np.array([-0.1, 0.0, 0.0, 0.0])
    for _ in range(150):
        x = A @ x + B * float(starts[0].policy.command(x))
    assert np.abs(x[0]) < 0.02


def test_a_model_that_no_regulator_holds_still_has_starts(make_system, starts_of):
    model, _, _ = make_system()
    model.f.weights[:] = np.nan
    starts = starts_of(model, shape(True))
    assert [s.origin for s in starts] == ["random"]


def test_a_network_on_top_of_a_regulator_keeps_its_constant():
    """That of an identified regulator holds a robot whose centre of mass is off; without it the robot would fall."""
    base = LinearPolicy(NAMES, -GAIN, 1.5, 20.0)
    starts = starts_on(base, NAMES, shape(True, weight_sd=0.0), 20.0, (), np.random.default_rng(0))
    states = 0.02 * np.random.default_rng(1).standard_normal((100, 4)) * [0.15, 0.8, 0.5, 8.0]
    for start in starts:
        np.testing.assert_allclose(start.policy.command(states), base.command(states), atol=0.03)
