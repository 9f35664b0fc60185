import numpy as np
import pytest

from twbal.core.errors import CheckpointError
from twbal.policies.exploring import ExploringPolicy
from twbal.policies.rbf import RbfPolicy


def random_policy(seed, D=4, N=20, strength=3.0):
    rng = np.random.default_rng(seed)
    weights, gain = strength * rng.standard_normal(N), strength * rng.standard_normal(D)
    names = ("tilt", "tilt_rate", "speed", "command_1")[:D]
    return RbfPolicy(names, rng.standard_normal((N, D)), weights, rng.uniform(0.3, 3.0, D), gain, 17.3)


@pytest.mark.parametrize("exponent", [-3, 0, 3, 20, 200, 307])
def test_no_state_makes_it_command_more_than_its_limit(exponent):
    for seed in range(20):
        policy = random_policy(seed)
        states = np.random.default_rng(seed).standard_normal((500, 4)) * 10.0**exponent
        assert (np.abs(policy.command(states)) <= policy.max_command).all()


def test_the_limit_holds_where_the_squash_is_at_its_top():
    policy = RbfPolicy(("tilt",), np.zeros((1, 1)), np.zeros(1), np.ones(1), np.ones(1), 0.7)
    states = np.pi / 2 + np.linspace(-1e-3, 1e-3, 100_001)[:, None]
    commands = policy.command(states)
    assert commands.max() == pytest.approx(0.7)
    assert commands.max() <= 0.7


@pytest.mark.parametrize("policy", [random_policy(0), random_policy(1, D=1, N=1)])
def test_one_state_and_many_are_commanded_alike(policy):
    states = np.random.default_rng(0).standard_normal((3, 5, len(policy.channels)))
    together = policy.command(states)
    assert together.shape == (3, 5)
    law = policy.controller(np.random.default_rng(0))
    np.testing.assert_allclose([[law(x) for x in row] for row in states], together, rtol=1e-13)


def test_one_basis_function_gives_the_formula():
    policy = RbfPolicy(
        ("tilt", "speed"), np.array([[1.0, 2.0]]), np.array([0.5]), np.array([2.0, 3.0]), np.zeros(2), 4.0
    )
    a = 0.5 * np.exp(-0.5 * ((0.3 - 1.0) ** 2 / 4.0 + (1.0 - 2.0) ** 2 / 9.0))
    assert policy.command(np.array([0.3, 1.0])) == pytest.approx(4.0 * (9 * np.sin(a) + np.sin(3 * a)) / 8)


def test_payload_round_trip_commands_the_same():
    policy = random_policy(0)
    again = RbfPolicy.from_payload(policy.to_payload())
    states = np.random.default_rng(0).standard_normal((50, 4))
    assert np.array_equal(again.command(states), policy.command(states))
    assert again.channels == policy.channels


def test_an_incomplete_payload_names_what_is_missing():
    payload = random_policy(0).to_payload()
    del payload["lengths"]
    with pytest.raises(CheckpointError, match="no 'lengths'; it has: channels, centres"):
        RbfPolicy.from_payload(payload)


def test_exploration_adds_its_noise_and_keeps_the_limit():
    policy = random_policy(0)
    exploring = ExploringPolicy(policy, noise_sd=1.5, max_command=policy.max_command)
    states = 0.05 * np.random.default_rng(0).standard_normal((20_000, 4))
    states = states[np.abs(policy.command(states)) < 8.0]  # more than five standard deviations from the limit
    law = exploring.controller(np.random.default_rng(1))
    added = np.array([law(x) for x in states]) - policy.command(states)
    assert len(added) > 1000
    assert added.std() == pytest.approx(1.5, rel=0.1)
    assert abs(added.mean()) < 4 * 1.5 / np.sqrt(len(added))
    loud = ExploringPolicy(policy, noise_sd=100.0, max_command=policy.max_command).controller(np.random.default_rng(2))
    assert {abs(loud(x)) for x in states} > {policy.max_command}
    assert max(abs(loud(x)) for x in states) == policy.max_command


def test_exploration_repeats_by_its_seed():
    exploring = ExploringPolicy(random_policy(0), noise_sd=1.0, max_command=17.3)
    one, other = (exploring.controller(np.random.default_rng(3)) for _ in range(2))
    assert [one(np.zeros(4)) for _ in range(5)] == [other(np.zeros(4)) for _ in range(5)]


def test_exploration_ends_where_it_is_told_to() -> None:
    policy = random_policy(0)
    exploring = ExploringPolicy(policy, noise_sd=1.0, max_command=17.3, periods=5)
    states = np.random.default_rng(1).standard_normal((12, len(policy.channels)))
    driven = exploring.controller(np.random.default_rng(2))
    differs = [driven(state) != float(policy.command(state)) for state in states]
    assert differs == [True] * 5 + [False] * 7
