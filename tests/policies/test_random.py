import numpy as np
import pytest

from twbal.core.errors import ConfigError
from twbal.policies.random import RandomPolicy


def torques(policy, seed, steps):
    law = policy.controller(np.random.default_rng(seed))
    return np.array([law(np.zeros(3)) for _ in range(steps)])


def test_torques_are_uniform_within_the_share():
    drawn = torques(RandomPolicy(amplitude=0.25, torque_limit=20.0, hold=1), 0, 20_000)
    assert np.abs(drawn).max() <= 5.0
    standard_error = 5.0 / np.sqrt(3.0 * len(drawn))
    assert abs(drawn.mean()) < 4 * standard_error
    assert drawn.std() == pytest.approx(5.0 / np.sqrt(3.0), rel=0.02)  # of a uniform distribution


def test_each_torque_is_held():
    drawn = torques(RandomPolicy(amplitude=1.0, torque_limit=2.0, hold=3), 1, 30).reshape(10, 3)
    assert (drawn == drawn[:, :1]).all()
    assert len(set(drawn[:, 0])) == 10


def test_a_rollout_repeats_by_its_seed_alone():
    policy = RandomPolicy(amplitude=1.0, torque_limit=2.0, hold=2)
    first = torques(policy, 5, 20)
    torques(policy, 6, 7)
    assert np.array_equal(torques(policy, 5, 20), first)


@pytest.mark.parametrize(("share", "hold", "message"), [(0.0, 1, "share"), (1.5, 1, "share"), (0.5, 0, "at least 1")])
def test_values_out_of_range_are_refused(share, hold, message):
    with pytest.raises(ConfigError, match=message):
        RandomPolicy(amplitude=share, torque_limit=1.0, hold=hold)
