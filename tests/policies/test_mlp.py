from itertools import pairwise

import numpy as np
import pytest

from twbal.core.errors import CheckpointError, ConfigError
from twbal.io.checkpoint import save_checkpoint
from twbal.policies.mlp import MlpPolicy
from twbal.policies.rbf import RbfPolicy
from twbal.policies.saved import load_policy, load_searched_policy

NAMES = ("tilt", "tilt_rate", "speed")
KINDS = [(activation, squash) for activation in ("tanh", "relu") for squash in ("tanh", "clip")]


def random_policy(seed, activation="tanh", squash="tanh", widths=(3, 16, 8, 1)):
    rng = np.random.default_rng(seed)
    weights = tuple(rng.standard_normal((n, m)) for m, n in pairwise(widths))
    biases = tuple(rng.standard_normal(n) for n in widths[1:])
    return MlpPolicy(NAMES[: widths[0]], weights, biases, activation, squash, 17.3)


def without(payload, name):
    return {key: value for key, value in payload.items() if key != name}


@pytest.mark.parametrize(("activation", "squash"), KINDS)
@pytest.mark.parametrize("exponent", [-3, 0, 3, 20, 200, 307])
def test_no_state_makes_it_command_more_than_its_limit(activation, squash, exponent):
    for seed in range(5):
        policy = random_policy(seed, activation, squash)
        states = np.random.default_rng(seed).standard_normal((200, 3)) * 10.0**exponent
        assert (np.abs(policy.command(states)) <= policy.max_command).all()


@pytest.mark.parametrize(("activation", "squash"), KINDS)
def test_one_state_and_many_are_commanded_alike(activation, squash):
    policy = random_policy(0, activation, squash)
    states = np.random.default_rng(0).standard_normal((2, 5, 3))
    together = policy.command(states)
    law = policy.controller(np.random.default_rng(0))
    assert together.shape == (2, 5)
    np.testing.assert_allclose([[law(x) for x in row] for row in states], together, rtol=1e-12)


def test_one_hidden_layer_gives_the_formula():
    weights, biases = (np.array([[1.0, -2.0], [0.5, 3.0]]), np.array([[0.7, -0.2]])), (np.array([0.1, -0.4]), [0.3])
    state = np.array([0.6, 0.25])
    first, second = 0.6 - 0.5 + 0.1, 0.3 + 0.75 - 0.4
    for activation, squash, expected in (
        ("tanh", "tanh", np.tanh(0.7 * np.tanh(first) - 0.2 * np.tanh(second) + 0.3)),
        ("relu", "clip", 0.7 * first - 0.2 * second + 0.3),
    ):
        policy = MlpPolicy(("tilt", "speed"), weights, tuple(map(np.array, biases)), activation, squash, 4.0)
        assert policy.command(state) == pytest.approx(4.0 * expected, rel=1e-14)


@pytest.mark.parametrize(
    "policy",
    [random_policy(0), RbfPolicy(NAMES, np.ones((2, 3)), np.ones(2), np.ones(3), np.array([1.0, -1.0, 0.0]), 17.3)],
    ids=["mlp", "rbf"],
)
def test_a_policy_of_either_kind_comes_back_from_its_file(policy, tmp_path):
    save_checkpoint(tmp_path / "policy.pt", "policy", policy.to_payload())
    again = load_policy(tmp_path / "policy.pt", NAMES)
    states = np.random.default_rng(0).standard_normal((50, 3))
    assert type(again) is type(policy)
    assert np.array_equal(again.command(states), policy.command(states))


def test_a_network_is_not_taken_for_a_policy_that_is_searched(tmp_path):
    save_checkpoint(tmp_path / "policy.pt", "policy", random_policy(0).to_payload())
    with pytest.raises(ConfigError, match=r"policy\.pt is a MlpPolicy; expected is one that is searched"):
        load_searched_policy(tmp_path / "policy.pt", NAMES)


def test_an_unknown_kind_is_refused_with_those_that_are_known(tmp_path):
    save_checkpoint(tmp_path / "policy.pt", "policy", {**random_policy(0).to_payload(), "law": "tree"})
    with pytest.raises(CheckpointError, match="of the kind 'tree'; this twbal knows rbf, linear, mlp"):
        load_policy(tmp_path / "policy.pt", NAMES)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda p: without(p, "biases"), "no 'biases'; it has: law, channels, weights"),
        (lambda p: {**p, "channels": ["tilt"]}, "from 1 channels to 1 command do not fit together"),
        (lambda p: {**p, "weights": p["weights"][:2]}, "do not fit together"),
        (lambda p: {**p, "weights": p["weights"][:2], "biases": p["biases"][:2]}, "do not fit together"),
        (lambda p: {**p, "weights": [], "biases": []}, "do not fit together"),
        (lambda p: {**p, "activation": "step"}, "activation is tanh or relu; found 'step'"),
        (lambda p: {**p, "squash": "none"}, "squash is tanh or clip; found 'none'"),
    ],
)
def test_a_payload_that_is_no_network_is_refused(change, message):
    with pytest.raises(CheckpointError, match=message):
        MlpPolicy.from_payload(change(random_policy(0).to_payload()))
