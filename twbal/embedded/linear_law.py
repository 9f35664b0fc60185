"""A linear law as C."""

import numpy as np

from twbal.core.gaussian import Array
from twbal.embedded.c_source import constant_array, real
from twbal.embedded.law import UNIT, Law, Operations, Rounding
from twbal.policies.linear import LinearPolicy


def linear_law(policy: LinearPolicy) -> Law:
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


def linear_rounding(policy: LinearPolicy, states: Array) -> Rounding:
    """As `rbf_rounding`."""
    sizes = np.abs(policy.bias) + np.abs(states) @ np.abs(policy.gain)
    bound = UNIT * ((len(policy.channels) + 3) * sizes + policy.max_command)
    return Rounding(policy.command(states), bound)
