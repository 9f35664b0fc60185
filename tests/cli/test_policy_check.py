"""A policy is held against the robot that it is to drive, by what it tells."""

from dataclasses import replace

import numpy as np
import pytest

from twbal.cli.policy_check import check_made_for, other_past_commands
from twbal.core.errors import ConfigError
from twbal.policies.linear import LinearPolicy
from twbal.policies.random import RandomPolicy

NAMES = ("tilt", "tilt_rate", "speed", "command_1", "command_2")
POLICY = LinearPolicy(NAMES, np.zeros(5), 0.0, 20.0, control_period=0.02)


def test_the_robot_that_a_policy_was_made_for_is_nothing_to_warn_of(paper):
    assert check_made_for(POLICY, paper) == []
    assert check_made_for(replace(POLICY, control_period=None), paper) == []
    assert check_made_for(RandomPolicy(0.1, 20.0, hold=1), paper) == []


def test_another_control_period_is_refused(paper):
    with pytest.raises(ConfigError, match=r"a control period of 0\.005 s; the robot 'paper' has one of 0\.02 s"):
        check_made_for(replace(POLICY, control_period=0.005), paper)


@pytest.mark.parametrize(("limit", "warns"), [(20.0, 0), (19.5, 0), (3.4, 1), (39.0, 0), (800.0, 1)])
def test_a_policy_of_a_much_stronger_or_weaker_robot_is_a_warning(paper, limit, warns):
    said = check_made_for(POLICY, replace(paper, torque_limit=limit))
    assert len(said) == warns
    assert all(f"commands up to 20 N·m; the torque limit of the robot 'paper' is {limit:g} N·m" in one for one in said)


def test_past_commands_tell_of_a_policy_that_tells_no_control_period(paper):
    unknown, other = replace(POLICY, control_period=None), (*NAMES, "command_3")
    (said,) = other_past_commands(unknown, other, paper)
    assert "reads 2 past commands; the state of the robot 'paper' has 3" in said
    assert other_past_commands(unknown, NAMES, paper) == []
    assert other_past_commands(POLICY, other, paper) == []
    assert other_past_commands(replace(unknown, channels=NAMES[:3]), other, paper) == []
