import numpy as np
import pytest

from twbal.core.channels import Channels
from twbal.core.errors import ConfigError
from twbal.environment.agent import AgentRecipe


def recipe(**changes):
    return AgentRecipe(
        **{"algorithm": "PPO", "hidden": [8], "activation": "tanh", "scales": {"tilt": 0.2}, "options": {}, **changes}
    )


def test_past_commands_are_seen_as_shares_of_the_torque_limit():
    scales = recipe().state_scales(Channels(("command_1", "tilt"), 0.15), torque_limit=20.0)
    assert np.array_equal(scales, [20.0, 0.2])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"algorithm": "DQN"}, "algorithm is PPO or SAC; found 'DQN'"),
        ({"activation": "step"}, "activation is tanh or relu; found 'step'"),
        ({"hidden": [8, 0]}, "widths of 1 or more; found \\[8, 0\\]"),
    ],
)
def test_what_is_not_known_is_refused(changes, message):
    with pytest.raises(ConfigError, match=message):
        recipe(**changes)


@pytest.mark.parametrize("scales", [{}, {"tilt": 0.0}])
def test_a_channel_without_a_scale_is_named(scales):
    with pytest.raises(ConfigError, match="a positive scale for tilt; found"):
        recipe(scales=scales).state_scales(Channels(("tilt", "command_1"), 0.15), torque_limit=20.0)
