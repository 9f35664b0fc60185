import numpy as np
import pytest

from twbal.checkpoint import save_checkpoint
from twbal.errors import CheckpointError, ConfigError
from twbal.policies.linear import LinearPolicy
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
