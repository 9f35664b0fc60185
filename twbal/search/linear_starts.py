"""Linear laws from the slope of the model: dependable starts for the search."""

import numpy as np
import scipy.linalg

from twbal.core.channels import Channels
from twbal.core.cost import Cost
from twbal.core.gaussian import Array
from twbal.models.dynamics import DynamicsModel
from twbal.planar.linearised import DelayedModel
from twbal.policies.rbf import RbfPolicy
from twbal.policies.squash import COMPENSATION_WIDTH, NARROWEST, WIDEST

SQUASH_SLOPE = 1.5  # σ'(0) of eq. 10


def slopes(model: DynamicsModel, swing: float, steps: Array) -> tuple[Array, Array]:
    """x' = A x + B u about the origin, as secants of the model's mean.

    Args:
        swing: commands ± this [N·m]: a slope at zero would sit inside a dead zone.
        steps: (D,) half the width of the secant in each channel.

    Returns:
        A (D, D) and B (D,).
    """
    D = len(steps)
    corners = np.concatenate([np.diag(steps), -np.diag(steps), np.zeros((2, D))])
    commands = np.concatenate([np.zeros(2 * D), [swing, -swing]])
    ends = model.step_mean(corners, commands)
    A = (ends[:D] - ends[D : 2 * D]).T / (2.0 * steps)
    return A, (ends[-2] - ends[-1]) / (2.0 * swing)


def state_space(model: DelayedModel, channels: Channels) -> tuple[Array, Array]:
    """x' = A x + B u of a planar model about its balance, in the channels of the state.

    Args:
        model: with as many commands as the state has past ones.
        channels: of the state; tilt, tilt rate and speed are needed, acceleration and yaw rate stay zero.

    Returns:
        A (D, D) and B (D,).

    Raises:
        ConfigError: the state lacks a channel.
    """
    moved = channels.transition_matrix  # (D, D + 1)
    physical = [channels.index(name) for name in ("tilt", "tilt_rate", "speed")]
    outputs = [channels.measured.index(k) for k in physical]
    change = np.zeros((len(channels.measured), moved.shape[1]))
    change[np.ix_(outputs, physical)] = model.A - np.eye(3)
    change[outputs, -1] = model.B[0]
    for name, lag in channels.lags.items():
        change[outputs, channels.index(name)] = model.B[lag]
    moved += channels.selection @ change
    return moved[:, :-1], moved[:, -1]


def regulator(A: Array, B: Array, cost: Cost, command_width: float) -> Array | None:
    """Gain K (D,) of u = -Kx that minimises Σ xᵀPx + (u / command_width)²; None where there is none.

    P is the cost's curvature.

    The saturating cost is, to second order, half that sum: the discrete-time linear-quadratic regulator starts where
    the search should end, were the model linear.
    """
    price = cost.curvature + 1e-9 * np.eye(len(A))  # the small share keeps unpriced channels observable
    try:
        P = scipy.linalg.solve_discrete_are(A, B[:, None], price, np.array([[command_width**-2.0]]))
    except (np.linalg.LinAlgError, ValueError):
        return None  # the slopes cannot be stabilised; the other starts remain
    PB = P @ B
    gain: Array = (PB @ A) / (command_width**-2.0 + B @ PB)
    # Where no command can hold the system, the solver may return without a explained.
    stable = np.isfinite(gain).all() and np.abs(np.linalg.eigvals(A - np.outer(B, gain))).max() < 1.0
    return gain if stable else None


def linear_law(
    channels: tuple[str, ...],
    gain: Array,
    torque_limit: float,
    compensation: float,
    balance: float = 0.0,
    compensation_tilt: float | None = None,
) -> RbfPolicy:
    """A policy that is u = -gain·x near the origin, with friction compensation and no basis function at work.

    Args:
        channels: names of the D state channels.
        gain: (D,) [N·m / unit of each channel].
        torque_limit: u_max [N·m].
        compensation: share of u_max.
        balance: tilt at which the command is zero where all else is zero [rad].
        compensation_tilt: that moves the activation by the compensation's width (`squash`) [rad]; None: the width of
            policies that do not tell theirs.
    """
    slope = SQUASH_SLOPE * (1.0 - compensation) * torque_limit
    by_tilt = float(gain[channels.index("tilt")] / slope) if "tilt" in channels else 0.0
    width = COMPENSATION_WIDTH if compensation_tilt is None else abs(by_tilt) * compensation_tilt
    return RbfPolicy(
        channels=channels,
        centres=np.zeros((1, len(gain))),
        weights=np.zeros(1),
        lengths=np.ones(len(gain)),
        gain=-gain / slope,
        max_command=torque_limit,
        compensation=compensation,
        bias=balance * by_tilt,
        compensation_width=float(np.clip(width, NARROWEST, WIDEST)),
    )
