"""Compiled rollouts, beside the same rollouts by the classes that they are compiled from."""

import numpy as np
import pytest
import torch

from twbal.core.cost import SaturatingCost
from twbal.core.evaluation import SuccessCriterion
from twbal.models.function_samples import FunctionSamples
from twbal.policies.rbf import RbfPolicy
from twbal.search.sampled_rollouts import Draws, Limits, limits_of, sampled_rollouts
from twbal.search.torch_robots import Robots

COST = SaturatingCost(np.zeros(4), np.array([0.25, 2.5, 1.0, 20.0]))
PLACED = SaturatingCost(np.zeros(6), np.array([0.25, 2.5, 1.0, 20.0, 0.5, 0.5]))
ROBOTS, STEPS = 12, 120


def draws_of(model, spread, seed):
    rng = np.random.default_rng(seed)
    D, E = len(model.channels.names), len(model.channels.measured)
    return Draws(
        start=np.pad(spread * rng.standard_normal((ROBOTS, len(spread))), ((0, 0), (0, D - len(spread)))),
        sensors=0.001 * rng.standard_normal((STEPS, ROBOTS, D)),
        process=0.001 * rng.standard_normal((STEPS, ROBOTS, E)),
    )


def policy_of(names, gain, seed=0, compensation=0.0):
    """A linear law with a small network on top."""
    rng = np.random.default_rng(seed)
    D = len(names)
    centres, weights = 0.2 * rng.standard_normal((5, D)), 0.02 * rng.standard_normal(5)
    return RbfPolicy(names, centres, weights, np.full(D, 0.5), gain[:D], 20.0, compensation)


def step_by_step(model, samples, policy, cost, limits, draws):
    """The same rollouts by the GP, its samples, the policy and the cost themselves."""
    states, A, P, kept = draws.start, model.transition_matrix, model.selection, list(model.channels.inputs)
    stayed, fallen, costs = np.ones(ROBOTS, bool), np.zeros(ROBOTS, bool), np.zeros(ROBOTS)
    commands = np.zeros((STEPS, ROBOTS))
    for step in range(STEPS):
        commands[step] = policy.command(states + draws.sensors[step])
        inputs = np.column_stack([states, commands[step]])
        change = model.f.mean(inputs[:, kept]) + draws.process[step]
        if samples is not None:
            change = change + samples(inputs[:, kept])
        states = np.clip(inputs @ A.T + change @ P.T, -1e3, 1e3)
        angle = np.abs(states[:, limits.tilt])
        fallen |= angle > limits.limit
        stayed &= ~fallen & ((step + 1 < limits.settle_step) | (angle <= limits.settled_tilt_limit))
        if limits.position >= 0 and step + 1 >= limits.place_step:
            stayed &= np.abs(states[:, limits.position]) <= limits.place_radius
        costs += np.where(fallen, 1.0, cost(states))
    late = commands[limits.settle_step :]
    stayed &= np.sqrt(np.mean(np.diff(late, axis=0) ** 2, axis=0)) <= limits.command_change
    return stayed, costs / STEPS


ROUNDED = 1e-7  # of a cost between 0 and 1: sums of another order, which differ by processor, grow over a rollout
PLACE = {None: 0.15, 0.3: 1.0}  # m; some robots pass it, and some fail by it alone
GAIN = np.array([2.0, 0.4, 0.27, 0.0, 0.02, 0.002])


@pytest.mark.parametrize("g", [None, 0.3])
@pytest.mark.parametrize("place", [False, True])
@pytest.mark.parametrize("strength", [1.0, 0.0])
def test_compiled_rollouts_are_those_of_the_classes(make_system, g, place, strength):
    model, _, _ = make_system(1, g=g, place=place)
    policy, cost = policy_of(model.channels.names, strength * GAIN), PLACED if place else COST
    samples = FunctionSamples.draw(model.g, ROBOTS, 40, np.random.default_rng(3)) if model.g else None
    limits, draws = Limits(0, 0.5, 0.1, 60), draws_of(model, [0.08, 0.1, 0.05], 1)
    if place:
        limits = limits._replace(position=4, place_radius=PLACE[g], place_step=80, command_change=0.6)
    found = sampled_rollouts(model, samples, policy, cost, limits, draws)
    stayed, costs = step_by_step(model, samples, policy, cost, limits, draws)
    np.testing.assert_array_equal(found.stayed, stayed)
    np.testing.assert_allclose(found.costs, costs, rtol=1e-6, atol=ROUNDED)
    if strength:
        assert stayed.sum() > 0
    else:
        assert not stayed.any()


@pytest.fixture(scope="module")
def followed(make_system):
    """A placed model, a policy that jumps, draws, and the robots' positions (T, n) and commands (T, n)."""
    model, _, _ = make_system(1, place=True)
    policy, draws = policy_of(model.channels.names, GAIN, compensation=0.05), draws_of(model, [0.08, 0.1, 0.05], 1)
    robots = Robots.of(model, None, draws)
    commands, positions = [], []

    def command(states):
        commands.append(policy.command(states.numpy()))
        return torch.from_numpy(commands[-1])

    with torch.no_grad():
        positions = [states[:, 4].numpy() for states in robots.states(command)]
    return model, policy, draws, np.array(positions), np.array(commands)


def by_both(model, policy, limits, draws):
    """Which robots stayed by the compiled rollouts, and by those in PyTorch."""
    compiled = sampled_rollouts(model, None, policy, PLACED, limits, draws)
    other = Robots.of(model, None, draws).balanced(policy.command, PLACED, limits)
    np.testing.assert_allclose(compiled.costs, other.costs, rtol=1e-6, atol=ROUNDED)
    np.testing.assert_array_equal(compiled.stayed, other.stayed)
    return compiled.stayed.astype(bool)


def edges(values):
    """Just above and just below the value of one robot, as far as others leave room."""
    below, here, above = np.sort(values)[ROBOTS // 2 - 1 : ROBOTS // 2 + 2]
    return 0.99 * here + 0.01 * above, 0.99 * here + 0.01 * below


WIDE = Limits(0, 3.0, 3.0, 60, position=4)


@pytest.mark.parametrize("place_step", [1, 80, STEPS])
def test_a_robot_is_in_place_up_to_the_radius_and_from_the_place_step_on(followed, place_step):
    model, policy, draws, positions, _ = followed
    farthest = np.abs(positions[place_step - 1 :]).max(axis=0)  # positions[k] is that of step k + 1
    for radius in edges(farthest):
        limits = WIDE._replace(place_radius=radius, place_step=place_step)
        np.testing.assert_array_equal(by_both(model, policy, limits, draws), farthest <= radius)


@pytest.mark.parametrize("settle_step", [0, 60, STEPS - 2])
def test_a_robot_is_quiet_up_to_the_limit_and_from_the_settle_step_on(followed, settle_step):
    model, policy, draws, _, commands = followed
    changes = np.sqrt(np.mean(np.diff(commands[settle_step:], axis=0) ** 2, axis=0))
    for limit in edges(changes):
        limits = WIDE._replace(settle_step=settle_step, command_change=limit)
        np.testing.assert_array_equal(by_both(model, policy, limits, draws), changes <= limit)


def test_limits_are_those_of_the_rule_where_the_state_shows_them():
    rule = SuccessCriterion(
        tilt_limit=0.5,
        settled_tilt_limit=0.2,
        settle_step=60,
        steps=150,
        place_step=90,
        place_radii=2.0,
        command_change=0.1,
        wheel_radius=0.15,
        torque_limit=20.0,
    )
    placed = ("speed", "position", "tilt")
    assert limits_of(rule, placed) == Limits(2, 0.5, 0.2, 60, 1, 0.3, 90, 2.0)
    assert limits_of(rule, ("tilt",)).position == -1
    bare = SuccessCriterion(tilt_limit=0.5, settled_tilt_limit=0.2, settle_step=60, steps=150)
    assert limits_of(bare, placed)[5:] == (np.inf, 0, np.inf)
