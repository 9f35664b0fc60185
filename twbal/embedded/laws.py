"""The law of each kind of saved policy."""

import numpy as np

from twbal.core.gaussian import Array
from twbal.embedded.c_source import constant_array, real
from twbal.embedded.law import UNIT, Law, Operations, Rounding
from twbal.embedded.mlp_law import mlp_law, mlp_rounding
from twbal.embedded.rbf_law import rbf_law, rbf_rounding
from twbal.policies.linear import LinearPolicy
from twbal.policies.rbf import RbfPolicy
from twbal.policies.saved import SavedPolicy


def law_of(policy: SavedPolicy) -> Law:
    """As C.

    Raises:
        ConfigError: a constant is beyond single precision.
    """
    if isinstance(policy, RbfPolicy):
        return rbf_law(policy)
    return _linear_law(policy) if isinstance(policy, LinearPolicy) else mlp_law(policy)


def rounding_of(policy: SavedPolicy, states: Array) -> Rounding:
    """Commands for states (n, D) that single precision holds exactly, and how far its arithmetic may be off."""
    if isinstance(policy, RbfPolicy):
        return rbf_rounding(policy, states)
    return _linear_rounding(policy, states) if isinstance(policy, LinearPolicy) else mlp_rounding(policy, states)


def _linear_law(policy: LinearPolicy) -> Law:
    """u = u_0 - kᵀx, within ±u_max."""
    width = len(policy.channels)
    body = f"""\
    float u = {real(policy.bias)};
    int i;
    for (i = 0; i < TWBAL_POLICY_CHANNELS; ++i) {{
        u -= TWBAL_READ(twbal_policy_gain[i]) * x[i];
    }}
    if (u > TWBAL_POLICY_MAX_COMMAND) {{
        return TWBAL_POLICY_MAX_COMMAND;
    }}
    return u < -TWBAL_POLICY_MAX_COMMAND ? -TWBAL_POLICY_MAX_COMMAND : u;"""
    return Law(
        formula="u = bias - gain . x, within the largest command",
        constants=constant_array("twbal_policy_gain", policy.gain, "TWBAL_POLICY_CHANNELS"),
        body=body,
        helpers="",
        numbers=width,
        scratch=0,
        operations=Operations(add=width + 2, multiply=width, read=width),
    )


def _linear_rounding(policy: LinearPolicy, states: Array) -> Rounding:
    """As `rbf_rounding`."""
    sizes = np.abs(policy.bias) + np.abs(states) @ np.abs(policy.gain)
    bound = UNIT * ((len(policy.channels) + 3) * sizes + policy.max_command)
    return Rounding(policy.command(states), bound)
