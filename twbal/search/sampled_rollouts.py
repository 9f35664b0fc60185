"""Rollouts of many sampled robots under one policy, compiled.

Each robot is followed until its tilt passes the limit: what comes after is of no interest.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from twbal.core.channels import index_of
from twbal.core.compiled import kernel
from twbal.core.cost import Cost, CostNumbers, price
from twbal.core.evaluation import SuccessCriterion
from twbal.core.exponential import expm1_in_place
from twbal.core.gaussian import Array
from twbal.models.dynamics import DynamicsModel
from twbal.models.function_samples import FunctionSamples
from twbal.models.gp import GaussianProcess
from twbal.models.moments.multi_index import Integers
from twbal.policies.rbf import RbfPolicy
from twbal.policies.rbf_moments import Network
from twbal.policies.squash import squashed

_FAR = 1e3
"""No channel is followed beyond this."""

_NUMBERS = {"nnan", "ninf"}


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


class KernelMean(NamedTuple):
    """Σ_c w_c exp(-½ |(x - c) / ℓ|²) of E outputs, laid out for loops over the centres.

    Attributes:
        scaled: (E, d, n) centres over length-scales.
        inverse_lengths: (E, d).
        weights: (E, robots, n); of one robot where all robots share them.
    """

    scaled: Array
    inverse_lengths: Array
    weights: Array


class Waves(NamedTuple):
    """Σ_m a_m cos(ω_m · x + φ_m) of E outputs: the prior part of sampled functions.

    Attributes:
        frequencies: (E, d, M).
        phases: (E, M).
        amplitudes: (E, robots, M).
    """

    frequencies: Array
    phases: Array
    amplitudes: Array


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
    f = _kernel_mean(model.f, (model.f.weights * model.f.signal_variance[:, None])[:, None, :])
    d, E = model.f.inputs, model.f.outputs
    if samples is None:
        g = KernelMean(np.zeros((E, d, 0)), np.zeros((E, d)), np.zeros((E, 1, 0)))
        waves = Waves(np.zeros((E, d, 0)), np.zeros((E, 0)), np.zeros((E, 1, 0)))
    else:
        scale = samples.gp.signal_variance[:, None, None]
        g = _kernel_mean(samples.gp, scale * samples.corrections.transpose(0, 2, 1))
        waves = Waves(
            np.ascontiguousarray(samples.frequencies.transpose(0, 2, 1)),
            samples.phases,
            np.ascontiguousarray(samples.features.transpose(0, 2, 1)),
        )
    carry, selection = model.transition_matrix, np.ascontiguousarray(model.selection)
    kept = np.array(model.inputs)
    return _drive(f, g, waves, policy.network, cost.numbers, limits, draws, carry, selection, kept)


def _kernel_mean(gp: GaussianProcess, weights: Array) -> KernelMean:
    scaled = (gp.centres[None] / gp.length_scales[:, None, :]).transpose(0, 2, 1)
    return KernelMean(np.ascontiguousarray(scaled), 1.0 / gp.length_scales, np.ascontiguousarray(weights))


@kernel(fastmath=_NUMBERS)
def cosine_in_place(values: Array) -> None:
    """Replace each z of `values` (n,) by cos z; absolute error about 1e-15 (1 + |z|)."""
    for j in range(len(values)):
        turns = values[j] * 0.15915494309189535  # 1 / 2π
        x = 3.141592653589793 * (turns - np.floor(turns + 0.5))  # z / 2 modulo π, within ±π/2
        y = x * x
        # sin x by Taylor to x^21, and cos z = 1 - 2 sin² (z / 2)
        s = 1.0 + y * (-1.0 / 420.0)
        s = 1.0 - y / 342.0 * s
        s = 1.0 - y / 272.0 * s
        s = 1.0 - y / 210.0 * s
        s = 1.0 - y / 156.0 * s
        s = 1.0 - y / 110.0 * s
        s = 1.0 - y / 72.0 * s
        s = 1.0 - y / 42.0 * s
        s = 1.0 - y / 20.0 * s
        s = x * (1.0 - y / 6.0 * s)
        values[j] = 1.0 - 2.0 * s * s


@kernel()
def _kernel_sum(mean: KernelMean, output: int, robot: int, inputs: Array, row: Array) -> float:
    """One output for one robot's inputs (d,); `row` (n,) is scratch."""
    row[:] = 0.0
    for k in range(len(inputs)):
        place, centres = inputs[k] * mean.inverse_lengths[output, k], mean.scaled[output, k]
        for c in range(len(row)):
            gap = centres[c] - place
            row[c] -= 0.5 * gap * gap
    expm1_in_place(row)
    weights, total = mean.weights[output, robot], 0.0
    for c in range(len(row)):
        total += weights[c] * (row[c] + 1.0)
    return total


@kernel()
def _wave_sum(waves: Waves, output: int, robot: int, inputs: Array, row: Array) -> float:
    """One output for one robot's inputs (d,); `row` (M,) is scratch."""
    row[:] = waves.phases[output]
    for k in range(len(inputs)):
        frequencies = waves.frequencies[output, k]
        for m in range(len(row)):
            row[m] += inputs[k] * frequencies[m]
    cosine_in_place(row)
    amplitudes, total = waves.amplitudes[output, robot], 0.0
    for m in range(len(row)):
        total += amplitudes[m] * row[m]
    return total


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
    f: KernelMean,
    g: KernelMean,
    waves: Waves,
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
    stayed, costs = np.ones(robots), np.zeros(robots)
    f_row, g_row, wave_row = np.empty(f.scaled.shape[2]), np.empty(g.scaled.shape[2]), np.empty(waves.phases.shape[1])
    inputs, seen, change = np.empty(D + 1), np.empty(len(kept)), np.empty(E)
    for robot in range(robots):
        state = draws.start[robot].copy()
        before, restless = 0.0, 0.0
        for step in range(steps):
            inputs[:D] = state
            inputs[D] = command_of(network, state + draws.sensors[step, robot])
            if not np.isfinite(inputs).all():  # the kernels below take numbers only
                stayed[robot] = 0.0
                costs[robot] += steps - step
                break
            if step > limits.settle_step:
                restless += (float(inputs[D]) - before) ** 2
            before = float(inputs[D])
            for i, k in enumerate(kept):
                seen[i] = inputs[k]
            for a in range(E):
                change[a] = draws.process[step, robot, a] + _kernel_sum(f, a, 0, seen, f_row)
                if len(wave_row):
                    change[a] += _wave_sum(waves, a, robot, seen, wave_row)
                    change[a] += _kernel_sum(g, a, robot, seen, g_row)
            state = carry @ inputs + selection @ change
            angle = abs(state[limits.tilt])
            if not angle <= limits.limit:
                stayed[robot] = 0.0
                costs[robot] += steps - step
                break
            if step + 1 >= limits.settle_step and angle > limits.settled_tilt_limit:
                stayed[robot] = 0.0
            is_late = limits.position >= 0 and step + 1 >= limits.place_step
            if is_late and abs(state[limits.position]) > limits.place_radius:
                stayed[robot] = 0.0
            for k in range(D):
                state[k] = min(max(state[k], -_FAR), _FAR)
            costs[robot] += price(cost, state)
        if restless > max(steps - 1 - limits.settle_step, 1) * limits.command_change**2:
            stayed[robot] = 0.0
    return Balanced(stayed, costs / steps)


def machine_code_folder() -> str:
    """Where the machine code of all this is kept."""
    return str(_drive.stats.cache_path)  # type: ignore[attr-defined]
