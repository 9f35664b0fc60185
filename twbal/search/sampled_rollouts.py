"""Rollouts of many sampled robots under one policy, compiled.

The robots take each step together, output by output, as a row of basis functions then serves all of them from the
fastest memory. Each robot is followed until its tilt passes the limit: what comes after is of no interest.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from twbal.core.channels import index_of
from twbal.core.compiled import kernel
from twbal.core.cost import Cost, CostNumbers, price
from twbal.core.evaluation import SuccessCriterion
from twbal.core.gaussian import Array
from twbal.models.dynamics import DynamicsModel
from twbal.models.function_samples import FunctionSamples
from twbal.models.gp import GaussianProcess
from twbal.models.moments.multi_index import Integers
from twbal.policies.rbf import RbfPolicy
from twbal.policies.rbf_moments import Network
from twbal.policies.squash import squashed
from twbal.search.basis_sums import BasisSum, add_sums, bells, nothing, waves

_FAR = 1e3
"""No channel is followed beyond this."""


class Limits(NamedTuple):
    """When a rollout counts as balanced.

    Attributes:
        tilt: index of the tilt in the state.
        limit: the tilt must never pass this [rad].
        settled_tilt_limit: from `settle_step` on the tilt must not pass this [rad].
        settle_step: control periods for recovering from the start.
        position: index of the position in the state; -1 where it is not asked for, or not there.
        place_radius: from `place_step` on the position must not pass this [m].
        place_step: control periods for coming back.
        command_change: the RMS change of the command from step to step, from `settle_step` on, must not pass this
            [N·m]; infinite where it is not asked for.
    """

    tilt: int
    limit: float
    settled_tilt_limit: float
    settle_step: int
    position: int = -1
    place_radius: float = np.inf
    place_step: int = 0
    command_change: float = np.inf


def limits_of(rule: SuccessCriterion, names: Sequence[str]) -> Limits:
    """What `rule` asks of a rollout, as far as a state of channels with these names shows it.

    Raises:
        ConfigError: the state has no tilt.
    """
    place, change = rule.place_limit, rule.command_change
    return Limits(
        index_of("tilt", names),
        rule.tilt_limit,
        rule.settled_tilt_limit,
        rule.settle_step,
        names.index("position") if "position" in names else -1,
        np.inf if place is None else place,
        rule.place_step,
        np.inf if change is None or rule.torque_limit is None else change * rule.torque_limit,
    )


class Draws(NamedTuple):
    """What is random in the rollouts of n robots over T steps.

    Attributes:
        start: (n, D) states at their beginning.
        sensors: (T, n, D) errors of what the policy sees.
        process: (T, n, E) disturbances of the measured channels.
    """

    start: Array
    sensors: Array
    process: Array


class Balanced(NamedTuple):
    """What became of n robots.

    Attributes:
        stayed: (n,) 1.0 where the robot kept within all limits, else 0.0.
        costs: (n,) mean cost of a step; a fallen robot costs 1 from its fall on.
    """

    stayed: Array
    costs: Array


def sampled_rollouts(
    model: DynamicsModel,
    samples: FunctionSamples | None,
    policy: RbfPolicy,
    cost: Cost,
    limits: Limits,
    draws: Draws,
) -> Balanced:
    """Drive n sampled robots by a policy.

    Args:
        model: of the dynamics, with squared exponential kernels; only the mean of its f is used.
        samples: the g of each robot, n functions; None where there is no g.
        policy: drives all of them.
        cost: of a state.
        limits: when a robot balances.
        draws: starts and noises.
    """
    if not isinstance(model.f, GaussianProcess):
        raise TypeError(f"These rollouts are compiled for the squared exponential kernel; found {model.f.kernel}.")
    functions = _functions(model.f, samples)
    carry, selection = np.ascontiguousarray(model.transition_matrix), np.ascontiguousarray(model.selection)
    kept = np.array(model.inputs)
    return _drive(functions, policy.network, cost.numbers, limits, draws, carry, selection, kept)


class _Functions(NamedTuple):
    """f, and the g of each robot.

    Attributes:
        f: the mean, of all robots.
        prior: part of g.
        data: part of g.
    """

    f: BasisSum
    prior: BasisSum
    data: BasisSum


def _functions(f: GaussianProcess, samples: FunctionSamples | None) -> _Functions:
    mean = bells(f, f.weights[:, :, None])
    if samples is not None:
        return _Functions(mean, waves(samples), bells(samples.gp, samples.corrections))
    zero = nothing(f.outputs, f.inputs)
    return _Functions(mean, zero, zero)


class _Fleet(NamedTuple):
    """How n robots do.

    Attributes:
        states: (n, D).
        inputs: (n, D + 1) states and commands.
        seen: (n, d) what of them f and g depend on.
        change: (n, E) of the measured channels in a step.
        standing: (n,) whether the robot is still followed.
        restless: (n,) sum of the squared changes of the command.
        stayed: as of `Balanced`.
        followed: (n,) steps that it took without falling.
        costs: (n,) sums over these.
    """

    states: Array
    inputs: Array
    seen: Array
    change: Array
    standing: NDArray[np.bool_]
    restless: Array
    stayed: Array
    followed: Array
    costs: Array


@kernel()
def command_of(network: Network, state: Array) -> float:
    """The policy's command [N·m]; see `RbfPolicy`."""
    activation = network.bias
    for k in range(len(state)):
        activation += network.gain[k] * state[k]
    for i in range(len(network.weights)):
        distance = 0.0
        for k in range(len(state)):
            distance += ((state[k] - network.centres[i, k]) / network.lengths[k]) ** 2
        activation += network.weights[i] * np.exp(-0.5 * distance)
    return float(network.max_command * squashed(activation, network.compensation))


@kernel()
def _drive(
    functions: _Functions,
    network: Network,
    cost: CostNumbers,
    limits: Limits,
    draws: Draws,
    carry: Array,
    selection: Array,
    kept: Integers,
) -> Balanced:
    steps, robots, D = draws.sensors.shape
    E = draws.process.shape[2]
    fleet = _Fleet(
        draws.start.copy(),
        np.zeros((robots, D + 1)),
        np.empty((robots, len(kept))),
        np.empty((robots, E)),
        np.ones(robots, dtype=np.bool_),
        np.zeros(robots),
        np.ones(robots),
        np.zeros(robots),
        np.zeros(robots),
    )
    for step in range(steps):
        _command(fleet, network, draws.sensors[step], kept, step, limits.settle_step)
        followed = np.flatnonzero(fleet.standing)
        fleet.change[:] = draws.process[step]
        for part in (functions.f, functions.prior, functions.data):
            add_sums(part, fleet.seen, followed, fleet.change)
        _move(fleet, followed, carry, selection)
        _judge(fleet, followed, cost, limits, step)
        if not len(followed):
            break
    for robot in range(robots):
        if fleet.restless[robot] > max(steps - 1 - limits.settle_step, 1) * limits.command_change**2:
            fleet.stayed[robot] = 0.0
    return Balanced(fleet.stayed, (fleet.costs + (steps - fleet.followed)) / steps)


@kernel()
def _command(fleet: _Fleet, network: Network, errors: Array, kept: Integers, step: int, settle_step: int) -> None:
    """The policy's commands, by what it sees of the states; who commands no number is followed no more."""
    states, inputs, D = fleet.states, fleet.inputs, fleet.states.shape[1]
    noisy = np.empty(D)
    for i in range(len(states)):
        if not fleet.standing[i]:
            continue
        for k in range(D):
            inputs[i, k] = states[i, k]
            noisy[k] = states[i, k] + errors[i, k]
        before = inputs[i, D]
        inputs[i, D] = command_of(network, noisy)
        are_numbers = True
        for k in range(D + 1):
            are_numbers &= np.isfinite(inputs[i, k])
        if not are_numbers:  # the sums take numbers only
            fleet.standing[i], fleet.stayed[i] = False, 0.0
            continue
        if step > settle_step:
            fleet.restless[i] += (inputs[i, D] - before) ** 2
        for j, k in enumerate(kept):
            fleet.seen[i, j] = inputs[i, k]


@kernel()
def _move(fleet: _Fleet, robots: Integers, carry: Array, selection: Array) -> None:
    """The next states."""
    states, inputs, change = fleet.states, fleet.inputs, fleet.change
    for i in robots:
        for k in range(len(carry)):
            total = 0.0
            for j in range(inputs.shape[1]):
                total += carry[k, j] * inputs[i, j]
            for a in range(change.shape[1]):
                total += selection[k, a] * change[i, a]
            states[i, k] = total


@kernel()
def _judge(fleet: _Fleet, robots: Integers, cost: CostNumbers, limits: Limits, step: int) -> None:
    """Which states are within the limits, and what they cost; who has fallen is followed no more."""
    states = fleet.states
    for i in robots:
        angle = abs(states[i, limits.tilt])
        if not angle <= limits.limit:
            fleet.standing[i], fleet.stayed[i] = False, 0.0
            continue
        if step + 1 >= limits.settle_step and angle > limits.settled_tilt_limit:
            fleet.stayed[i] = 0.0
        is_late = limits.position >= 0 and step + 1 >= limits.place_step
        if is_late and abs(states[i, limits.position]) > limits.place_radius:
            fleet.stayed[i] = 0.0
        for k in range(states.shape[1]):
            states[i, k] = min(max(states[i, k], -_FAR), _FAR)
        fleet.costs[i] += price(cost, states[i])
        fleet.followed[i] += 1.0


def machine_code_folder() -> str:
    """Where the machine code of all this is kept."""
    return str(_drive.stats.cache_path)  # type: ignore[attr-defined]
