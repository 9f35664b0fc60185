from dataclasses import replace

import numpy as np
import pytest

from twbal.core.errors import CheckpointError, ConfigError
from twbal.io.checkpoint import save_checkpoint
from twbal.policies.linear import LinearPolicy
from twbal.policies.mlp import MlpPolicy
from twbal.policies.rbf import RbfPolicy
from twbal.policies.saved import load_policy, load_regulator, load_searched_policy

NAMES = ("tilt", "tilt_rate")
LINEAR = LinearPolicy(NAMES, np.array([3.0, 0.5]), 0.2, 4.0)
NETWORK = RbfPolicy(NAMES, np.zeros((2, 2)), np.ones(2), np.ones(2), np.array([1.0, 0.1]), 4.0)


@pytest.fixture
def saved(tmp_path):
    def save(policy):
        path = tmp_path / "policy.pt"
        save_checkpoint(path, "policy", policy.to_payload() if hasattr(policy, "to_payload") else policy)
        return path

    return save


@pytest.mark.parametrize("policy", [LINEAR, NETWORK], ids=["linear", "network"])
def test_a_policy_of_any_kind_comes_back_as_it_was(saved, policy):
    states = np.random.default_rng(0).standard_normal((20, 2))
    found = load_policy(saved(policy), NAMES)
    assert type(found) is type(policy)
    np.testing.assert_array_equal(found.command(states), policy.command(states))


def test_a_linear_law_is_cut_at_its_limit_and_has_a_bias():
    assert LINEAR.command(np.array([0.0, 0.0])) == 0.2
    assert LINEAR.command(np.array([1.0, 1.0])) == pytest.approx(0.2 - 3.5)
    assert LINEAR.command(np.array([50.0, 0.0])) == -4.0
    assert LINEAR.controller(np.random.default_rng(0))(np.array([-50.0, 0.0])) == 4.0


def test_an_unknown_kind_is_refused(saved):
    with pytest.raises(CheckpointError, match="of the kind 'oracle'; this twbal knows rbf, linear"):
        load_policy(saved({"law": "oracle"}), NAMES)


@pytest.mark.parametrize(("load", "other"), [(load_searched_policy, LINEAR), (load_regulator, NETWORK)])
def test_a_search_takes_no_policy_of_another_kind(saved, load, other):
    with pytest.raises(ConfigError, match=f"is a {type(other).__name__}"):
        load(saved(other), NAMES)


def test_another_state_is_refused(saved):
    with pytest.raises(ConfigError, match="reads the state tilt, tilt_rate; here it is tilt"):
        load_policy(saved(LINEAR), ["tilt"])


MLP = MlpPolicy(NAMES, (np.ones((3, 2)), np.ones((1, 3))), (np.zeros(3), np.zeros(1)), "tanh", "tanh", 4.0)


@pytest.mark.parametrize(
    ("policy", "change", "message"),
    [
        (LINEAR, {"gain": np.ones(3)}, r"gain must be numbers of shape \(2\); found \(3,\)"),
        (LINEAR, {"gain": np.array([1.0, np.nan])}, r"gain must be within \[-1e\+09, 1e\+09\]; found nan"),
        (LINEAR, {"bias": float("inf")}, "bias must be within"),
        (LINEAR, {"bias": -(10**400)}, "bias must be within .* found -inf"),
        (LINEAR, {"bias": "0.2"}, "bias must be a number; found a str"),
        (LINEAR, {"max_command": -4.0}, r"max_command must be within \[1e-09, 1e\+06\]; found -4"),
        (LINEAR, {"max_command": float("nan")}, "max_command must be within"),
        (LINEAR, {"max_command": True}, "max_command must be a number; found a bool"),
        (LINEAR, {"channels": "tilt"}, "channels must be a list; found a str"),
        (LINEAR, {"channels": ["tilt", 3]}, "channels must be texts"),
        (LINEAR, {"channels": ["tilt", "tilt"]}, "distinct channels"),
        (LINEAR, {"channels": [], "gain": np.ones(0)}, "1 to 64 distinct channels; found 0"),
        (NETWORK, {"centres": np.zeros(2)}, r"centres must be numbers of shape \(any, 2\); found \(2,\)"),
        (NETWORK, {"centres": np.zeros((0, 2)), "weights": np.ones(0)}, r"found \(0, 2\)"),
        (NETWORK, {"centres": np.zeros((20_000, 2))}, "at most 10000 basis functions; found 20000"),
        (NETWORK, {"weights": np.array([1.0, np.inf])}, "weights must be within"),
        (NETWORK, {"weights": np.array([1.0, 1e300])}, r"found 1e\+300"),
        (NETWORK, {"weights": np.ones((2, 1))}, r"weights must be numbers of shape \(2\); found \(2, 1\)"),
        (NETWORK, {"weights": [1.0, 2.0]}, "weights must be numbers of shape .*found list"),
        (NETWORK, {"lengths": np.array([1.0, 0.0])}, r"lengths must be within \[1e-09, 1e\+100\]; found 0"),
        (NETWORK, {"lengths": np.array([1.0, -1.0])}, "lengths must be within"),
        (NETWORK, {"law": ["rbf"]}, "this twbal knows rbf"),
        (MLP, {"weights": [np.full((3, 2), np.nan), np.ones((1, 3))]}, r"weights\[0\] must be within"),
        (MLP, {"biases": [np.zeros((3, 1)), np.zeros(1)]}, r"biases\[0\] must be numbers of shape \(any\)"),
        (MLP, {"weights": [np.ones((1, 1))] * 17}, "at most 16 layers; found 17"),
        (MLP, {"weights": [np.ones((5000, 2)), np.ones((1, 5000))]}, "at most 4096 wide"),
        (MLP, {"activation": 3}, "activation must be a str; found a int"),
        (MLP, {"max_command": 0.0}, "max_command must be within"),
    ],
)
def test_a_policy_that_cannot_be_one_is_refused_as_it_is_loaded(policy, change, message, saved):
    with pytest.raises(CheckpointError, match=message) as caught:
        load_policy(saved({**policy.to_payload(), **change}), NAMES)
    assert "policy.pt" in str(caught.value)


@pytest.mark.parametrize("policy", [LINEAR, NETWORK, MLP], ids=["linear", "network", "mlp"])
def test_the_extremes_that_are_taken_command_a_number(policy, saved):
    extreme = {name: np.full_like(part, 1e9) for name, part in policy.to_payload().items() if hasattr(part, "shape")}
    extreme |= {"lengths": np.full(2, 1e-9)} if policy is NETWORK else {}
    extreme |= {"weights": [np.full((3, 2), 1e9), np.full((1, 3), -1e9)]} if policy is MLP else {}
    found = load_policy(saved({**policy.to_payload(), **extreme}), NAMES)
    with np.errstate(over="ignore"):
        assert np.abs(found.command(np.array([[1e38, -1e38], [0.0, 0.0], [1e9, 1e9]]))).max() <= 4.0


@pytest.mark.parametrize("policy", [LINEAR, NETWORK, MLP], ids=["linear", "network", "mlp"])
def test_a_file_tells_the_control_period_that_is_known_and_those_without_are_read_as_before(policy, saved):
    assert "control_period" not in policy.to_payload()
    assert load_policy(saved(policy), NAMES).control_period is None
    known = replace(policy, control_period=0.02)
    assert load_policy(saved(known), NAMES).control_period == 0.02
    with pytest.raises(CheckpointError, match="control_period must be within"):
        load_policy(saved({**known.to_payload(), "control_period": -0.02}), NAMES)
