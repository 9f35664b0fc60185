"""One step of the closed loop in distribution, N(x_t) to N(x_{t+1}) under a policy, and the way back (eq. 13-17)."""

from typing import NamedTuple

import numpy as np

from twbal.gaussian import Array, Gaussian
from twbal.models.dynamics import DynamicsModel
from twbal.models.gp import GaussianProcess
from twbal.models.moments.kernel_sum import KernelSum, no_kernels
from twbal.models.moments.multi_index import Integers
from twbal.models.moments.prediction import Prediction, Truncation, predict, predict_adjoint
from twbal.policies.rbf import RbfPolicy
from twbal.policies.rbf_moments import Activation, activation_adjoint, activation_moments
from twbal.policies.squash import Squashed, squash_moments


class TransitionModel(NamedTuple):
    """x' = A (x, u) + P (f(x, u) + g(x, u)) + noise, and what the policy sees of x (eq. 8).

    Attributes:
        f: simulation model, E outputs of D + 1 inputs.
        g: difference model, the same; the zero function before there is one.
        carry: A (D, D + 1): identity for measured channels, copies for past commands.
        predicted: (E,) indices of the channels that f and g predict (P selects them).
        process_noise: (E,) variances added at each step.
        observation_noise: (D,) variances of what the sensors add; the policy acts on x + ε, the state does not grow by
            it.
    """

    f: KernelSum
    g: KernelSum
    carry: Array
    predicted: Integers
    process_noise: Array
    observation_noise: Array


def transition_model(model: DynamicsModel) -> TransitionModel:
    """What moment matching needs of a model: f's variance only where the model keeps it, g's always."""
    D, E = len(model.channels.names), len(model.channels.measured)
    observation_noise = np.zeros(D)
    observation_noise[list(model.channels.measured)] = model.observation_noise
    return TransitionModel(
        f=_kernels(model.f, model.keep_f_variance),
        g=_kernels(model.g, True) if model.g else no_kernels(E, D + 1),
        carry=model.transition_matrix,
        predicted=np.array(model.channels.measured),
        process_noise=model.process_noise,
        observation_noise=observation_noise,
    )


def _kernels(gp: GaussianProcess, uncertain: bool) -> KernelSum:
    variance = gp.variance_matrix if uncertain else np.zeros((gp.outputs, 0, 0))
    return KernelSum(gp.centres, gp.length_scales, gp.signal_variance, gp.weights, variance)


class Step(NamedTuple):
    """One step forward, with what the way back needs.

    Attributes:
        state: where it began.
        activation: of the policy.
        squashed: of the activation.
        joint: N of (x, u).
        prediction: of f + g there.
        jacobian: A + P G (D, D + 1).
        next_state: where it ended.
    """

    state: Gaussian
    activation: Activation
    squashed: Squashed
    joint: Gaussian
    prediction: Prediction
    jacobian: Array
    next_state: Gaussian


class PolicyGradient(NamedTuple):
    """Derivative of a scalar by the policy's parameters, in the shapes of `RbfPolicy`."""

    centres: Array
    weights: Array
    lengths: Array
    gain: Array


def step_forward(
    model: TransitionModel, policy: RbfPolicy, state: Gaussian, truncation: Truncation, start_degree: int
) -> Step:
    """One step. The policy sees x + ε; as x and x + ε are jointly normal, Cov(x, u) = S E[∇π] (Stein's lemma)."""
    mean, S = state
    D = len(mean)
    activation = activation_moments(
        policy.centres, policy.weights, policy.lengths, policy.gain, mean, S + np.diag(model.observation_noise)
    )
    squashed = squash_moments(activation.mean, activation.variance)
    u_max = policy.max_command
    joint_covariance = np.empty((D + 1, D + 1))
    joint_covariance[:D, :D] = S
    joint_covariance[:D, D] = joint_covariance[D, :D] = u_max * squashed.gain * (S @ activation.slope)
    joint_covariance[D, D] = u_max**2 * squashed.variance
    joint = Gaussian(np.append(mean, u_max * squashed.mean), joint_covariance)
    moved = S[model.predicted, model.predicted]  # the change is added to a state that varies already
    prediction = predict(model.f, model.g, joint.mean, joint.covariance, truncation, start_degree, moved)
    jacobian = model.carry.copy()
    jacobian[model.predicted] += prediction.slope
    next_mean = model.carry @ joint.mean
    next_mean[model.predicted] += prediction.mean
    next_covariance = jacobian @ joint.covariance @ jacobian.T
    next_covariance[np.ix_(model.predicted, model.predicted)] += prediction.rest + np.diag(model.process_noise)
    next_state = Gaussian(next_mean, 0.5 * (next_covariance + next_covariance.T))
    return Step(state, activation, squashed, joint, prediction, jacobian, next_state)


def step_backward(
    model: TransitionModel, policy: RbfPolicy, step: Step, by_mean: Array, by_covariance: Array
) -> tuple[Array, Array, PolicyGradient]:
    """From the derivatives by the next state to those by the state and by the policy.

    Args:
        by_mean: (D,).
        by_covariance: (D, D), symmetric.
    """
    D = len(by_mean)
    at = model.predicted
    by_jacobian = 2.0 * by_covariance @ step.jacobian @ step.joint.covariance  # (D, D + 1)
    joint_mean_by, joint_covariance_by = predict_adjoint(
        step.prediction, step.joint.covariance, by_mean[at], by_jacobian[at], by_covariance[np.ix_(at, at)]
    )
    joint_mean_by = joint_mean_by + model.carry.T @ by_mean
    joint_covariance_by = joint_covariance_by + step.jacobian.T @ by_covariance @ step.jacobian

    # Through the joint's cross term u_max · gain · S slope and its last entry u_max² · variance.
    S, u_max = step.state.covariance, policy.max_command
    cross_by = 2.0 * u_max * joint_covariance_by[:D, D]
    along = cross_by @ S @ step.activation.slope
    activation_by = (
        u_max * joint_mean_by[D] * step.squashed.mean_by
        + along * step.squashed.gain_by
        + u_max**2 * joint_covariance_by[D, D] * step.squashed.variance_by
    )  # by (mean, variance) of the activation
    slope_by = step.squashed.gain * (S @ cross_by)
    half = 0.5 * step.squashed.gain * np.outer(cross_by, step.activation.slope)
    back = activation_adjoint(
        policy.centres,
        policy.weights,
        policy.lengths,
        policy.gain,
        step.state.mean,
        S + np.diag(model.observation_noise),
        activation_by[0],
        slope_by,
        activation_by[1],
    )
    state_mean_by = joint_mean_by[:D] + back.mean
    state_covariance_by = joint_covariance_by[:D, :D] + half + half.T + back.covariance
    return state_mean_by, state_covariance_by, PolicyGradient(back.centres, back.weights, back.lengths, back.gain)
