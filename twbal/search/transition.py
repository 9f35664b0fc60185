"""One step of the closed loop in distribution, N(x_t) to N(x_{t+1}) under a policy, and the way back (eq. 13-17)."""

from typing import NamedTuple

import numpy as np

from twbal.core.compiled import kernel
from twbal.core.errors import ConfigError
from twbal.core.gaussian import Array, Gaussian
from twbal.models.dynamics import DynamicsModel
from twbal.models.gp import SQUARED_EXPONENTIAL, GaussianProcess, Posterior
from twbal.models.moments.adjoint import predict_adjoint
from twbal.models.moments.kernel_sum import KernelSum, no_kernels
from twbal.models.moments.moment_prediction import MomentPrediction, predict_by_series
from twbal.models.moments.multi_index import Integers, MultiIndices
from twbal.models.moments.truncation import Series
from twbal.policies.rbf_moments import Activation, Network, activation_adjoint, activation_moments
from twbal.policies.squash import Squashed, squash_moments


class TransitionModel(NamedTuple):
    """x' = A (x, u) + P (f(x, u) + g(x, u)) + noise, and what the policy sees of x (eq. 8).

    Attributes:
        f: simulation model, E outputs of d inputs.
        g: difference model, the same; the zero function before there is one.
        carry: A (D, D + 1): identity for measured channels, copies for past commands, kinematics of the position.
        selection: P (D, E).
        predicted: (E,) indices of the channels that f and g predict.
        inputs: (d,) indices into (x, u) of what f and g depend on.
        process_noise: (E,) variances added at each step.
        observation_noise: (D,) variances of what the sensors add; the policy acts on x + ε, the state does not grow by
            it.
    """

    f: KernelSum
    g: KernelSum
    carry: Array
    selection: Array
    predicted: Integers
    inputs: Integers
    process_noise: Array
    observation_noise: Array


def transition_model(model: DynamicsModel) -> TransitionModel:
    """What moment matching needs of a model: f's variance only where the model keeps it, g's always.

    Raises:
        ConfigError: f or g has another kernel than the squared exponential one.
    """
    return TransitionModel(
        f=_kernels(model.f, model.keep_f_variance),
        g=_kernels(model.g, True) if model.g else no_kernels(len(model.measured), len(model.inputs)),
        carry=model.transition_matrix,
        selection=np.ascontiguousarray(model.selection),
        predicted=np.array(model.measured),
        inputs=np.array(model.inputs),
        process_noise=model.process_noise,
        observation_noise=model.sensor_variance,
    )


def check_kernel(kernel: str) -> None:
    """Raise ConfigError where moments cannot be matched on models with this kernel."""
    if kernel != SQUARED_EXPONENTIAL:
        raise ConfigError(
            f"Moment matching needs the squared exponential kernel; the model has {kernel}. Search by particles, "
            f"with search=particles, or fit the model with model.kernel={SQUARED_EXPONENTIAL}."
        )


def _kernels(gp: Posterior, uncertain: bool) -> KernelSum:
    check_kernel(gp.kernel)
    assert isinstance(gp, GaussianProcess)
    variance = gp.variance_matrix if uncertain else np.zeros((gp.outputs, 0, 0))
    return KernelSum(gp.centres, gp.length_scales, gp.signal_variance, gp.weights, variance)


class ForwardStep(NamedTuple):
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
    prediction: MomentPrediction
    jacobian: Array
    next_state: Gaussian


class PolicyGradient(NamedTuple):
    """Derivative of a scalar by the policy's parameters, in the shapes of `RbfPolicy`."""

    centres: Array
    weights: Array
    lengths: Array
    gain: Array


@kernel()
def marginal(joint: Gaussian, kept: Integers) -> Gaussian:
    """The distribution of some of the channels, in the order of `kept`."""
    mean, covariance = np.empty(len(kept)), np.empty((len(kept), len(kept)))
    for a, k in enumerate(kept):
        mean[a] = joint.mean[k]
        for b, l in enumerate(kept):
            covariance[a, b] = joint.covariance[k, l]
    return Gaussian(mean, covariance)


@kernel()
def step_forward(
    model: TransitionModel, network: Network, state: Gaussian, cut: Series, start_degree: int
) -> ForwardStep:
    """One step. The policy sees x + ε; as x and x + ε are jointly normal, Cov(x, u) = S E[∇π] (Stein's lemma)."""
    mean, S = state
    D, predicted = len(mean), model.predicted
    activation = activation_moments(network, mean, S + np.diag(model.observation_noise))
    squashed = squash_moments(activation.mean, activation.variance, network.compensation)
    u_max = network.max_command
    cross = u_max * squashed.gain * (S @ activation.slope)
    joint_mean, joint_covariance = np.empty(D + 1), np.empty((D + 1, D + 1))
    joint_mean[:D], joint_mean[D] = mean, u_max * squashed.mean
    joint_covariance[:D, :D] = S
    joint_covariance[:D, D], joint_covariance[D, :D] = cross, cross
    joint_covariance[D, D] = u_max**2 * squashed.variance
    joint = Gaussian(joint_mean, joint_covariance)
    seen_mean, seen_covariance = marginal(joint, model.inputs)
    moved = np.array([S[k, k] for k in predicted])  # the change is added to a state that varies already
    prediction = predict_by_series(model.f, model.g, seen_mean, seen_covariance, cut, start_degree, moved)
    jacobian = model.carry.copy()
    moving = model.selection @ prediction.slope  # (D, d)
    for a, k in enumerate(model.inputs):
        jacobian[:, k] += moving[:, a]
    next_mean = model.carry @ joint_mean + model.selection @ prediction.mean
    added = prediction.rest + np.diag(model.process_noise)
    moved_covariance = jacobian @ joint_covariance @ jacobian.T + model.selection @ added @ model.selection.T
    next_covariance = np.empty((D, D))
    for j in range(D):
        for k in range(D):
            next_covariance[j, k] = 0.5 * (moved_covariance[j, k] + moved_covariance[k, j])
    return ForwardStep(state, activation, squashed, joint, prediction, jacobian, Gaussian(next_mean, next_covariance))


@kernel()
def step_backward(  # type: ignore[no-untyped-def]
    model: TransitionModel,
    network: Network,
    step: ForwardStep,
    indices: MultiIndices,
    by_mean: Array,
    by_covariance: Array,
):
    """From the derivatives by the next state to those by the state and by the policy.

    Args:
        indices: of the step's series.
        by_mean: (D,).
        by_covariance: (D, D), symmetric.
    """
    D, inputs = len(by_mean), model.inputs
    back_to_outputs = np.ascontiguousarray(model.selection.T)
    by_jacobian = back_to_outputs @ (2.0 * (by_covariance @ step.jacobian @ step.joint.covariance))  # (E, D + 1)
    by_value, by_rest = back_to_outputs @ by_mean, back_to_outputs @ by_covariance @ model.selection
    by_slope = np.empty((len(by_value), len(inputs)))
    for a, k in enumerate(inputs):
        by_slope[:, a] = by_jacobian[:, k]
    seen = marginal(step.joint, inputs)
    by_seen_mean, by_seen_covariance = predict_adjoint(
        step.prediction, seen.covariance, indices, by_value, by_slope, by_rest
    )
    mean_by = model.carry.T @ by_mean
    covariance_by = step.jacobian.T @ by_covariance @ step.jacobian
    for a, k in enumerate(inputs):
        mean_by[k] += by_seen_mean[a]
        for b, l in enumerate(inputs):
            covariance_by[k, l] += by_seen_covariance[a, b]

    # Through the joint's cross term u_max · gain · S slope and its last entry u_max² · variance.
    S, u_max = step.state.covariance, network.max_command
    cross_by = 2.0 * u_max * covariance_by[:D, D]
    along = cross_by @ (S @ step.activation.slope)
    activation_by = (
        u_max * mean_by[D] * step.squashed.mean_by
        + along * step.squashed.gain_by
        + u_max**2 * covariance_by[D, D] * step.squashed.variance_by
    )  # by (mean, variance) of the activation
    slope_by = step.squashed.gain * (S @ cross_by)
    half = 0.5 * step.squashed.gain * np.outer(cross_by, step.activation.slope)
    sensed = S + np.diag(model.observation_noise)
    back = activation_adjoint(network, step.state.mean, sensed, activation_by[0], slope_by, activation_by[1])
    state_covariance_by = covariance_by[:D, :D] + half + half.T + back.covariance
    gradient = PolicyGradient(back.centres, back.weights, back.lengths, back.gain)
    return mean_by[:D] + back.mean, np.ascontiguousarray(state_covariance_by), gradient
