"""Regulators: of the data sheet, and of a linear model that was fitted to a robot that is known."""

from dataclasses import replace

import numpy as np
import pytest

from twbal.core.channels import Channels
from twbal.core.cost import SaturatingCost
from twbal.core.episode import Episode, Outcome, Provenance
from twbal.core.errors import ConfigError
from twbal.core.plant import Observation
from twbal.planar.linearised import linearise
from twbal.search.regulator import data_sheet_regulator, identified_regulator

NAMES = ("tilt", "tilt_rate", "speed", "command_1")
COST = SaturatingCost(np.zeros(4), np.array([0.25, 2.5, 1.0, np.inf]))
A = np.array([[1.0, 0.02, 0.0], [0.4, 1.0, 0.0], [-0.1, 0.0, 1.0]])  # of tilt, tilt rate and speed
B, LATE = np.array([-0.0001, -0.01, 0.02]), np.array([-0.0003, -0.03, 0.05])  # of this command and of the one before
CONSTANT = np.array([0.0, 0.02, 0.0])
RADIUS = 0.15


def linear_robot(gain, bias, steps, noise, seed):
    """An episode of x' = A x + B u + LATE u_1 + c under u = bias - gain x, shaken; and its largest tilt at the end."""
    rng = np.random.default_rng(seed)
    x, last, states, commands = np.array([0.05, 0.0, 0.0]), 0.0, [], []
    for _ in range(steps):
        states.append(x)
        u = bias - gain @ [*x, last] + noise * rng.standard_normal()
        commands.append(u)
        x, last = A @ x + B * u + LATE * last + CONSTANT, u
    states.append(x)
    seen = np.array([Observation(0.02 * k, s[0], s[1], 0, 0, s[2] / RADIUS - s[1], 0) for k, s in enumerate(states)])
    channels = Channels(NAMES, RADIUS)
    commands = np.array(commands)
    told = channels.states(seen, commands)
    return Episode(NAMES, 0.02, seen, told, commands, Outcome.COMPLETED, Provenance("paper", "robot"))


@pytest.fixture(scope="module")
def found():
    rough = np.array([-30.0, -4.0, -2.0, 0.0])
    episodes = [linear_robot(rough, 0.0, 40, 1.0, seed) for seed in (1, 2)]
    return identified_regulator(episodes, Channels(NAMES, RADIUS), COST, 1.0, 20.0)


def test_the_identified_regulator_is_that_of_the_true_system(found):
    whole = np.zeros((4, 4))
    whole[:3, :3], whole[:3, 3] = A, LATE
    drive = np.array([*B, 1.0])
    price, effort = np.diag([16.0, 0.16, 1.0, 0.0]), 1.0 / 400.0
    P = price
    for _ in range(20_000):  # value iteration
        pull = P @ drive
        gain = (pull @ whole) / (effort + drive @ pull)
        closed = whole - np.outer(drive, gain)
        P = price + effort * np.outer(gain, gain) + closed.T @ P @ closed
    np.testing.assert_allclose(found.gain, gain, rtol=2e-3, atol=1e-3)


def test_it_holds_the_robot_where_it_stands_still(found):
    end = linear_robot(found.gain, found.bias, 3000, 0.0, 3).states[-1]
    assert np.abs(end[1:3]).max() < 0.02  # it neither turns over nor rolls away
    free = linear_robot(found.gain, 0.0, 3000, 0.0, 3).states[-1]
    assert abs(free[2]) > 3 * abs(end[2])  # the constant alone would drive it off


def test_what_cannot_be_stabilised_is_no_regulator():
    still = linear_robot(np.zeros(4), 0.0, 12, 0.0, 1)
    assert identified_regulator([still], Channels(NAMES, RADIUS), COST, 1.0, 20.0) is None


def test_the_data_sheets_regulator_holds_the_linearised_robot(paper):
    channels = Channels(NAMES, paper.wheel_radius)
    policy = data_sheet_regulator(paper, channels, COST, 1.0)
    model = linearise(paper)
    closed = model.A - np.outer(model.B, policy.gain[:3])
    assert np.linalg.eigvals(closed).real.max() < 0
    assert policy.gain[3] == 0.0
    assert abs(policy.command(np.array([10.0, 0, 0, 0]))) == paper.torque_limit


def test_a_state_without_speed_is_refused(paper):
    with pytest.raises(ConfigError, match="lacks speed"):
        data_sheet_regulator(paper, Channels(("tilt", "tilt_rate"), 0.15), COST, 1.0)


def test_a_linear_model_of_a_state_without_tilt_is_refused_by_name():
    blind, seen = Channels(("tilt_rate", "speed"), RADIUS), linear_robot(np.zeros(4), 0.0, 40, 1.0, 1)
    episode = replace(seen, channels=blind.names, states=blind.states(seen.observations, seen.commands))
    with pytest.raises(ConfigError, match="has no tilt"):
        identified_regulator([episode], blind, COST, 1.0, 20.0)
