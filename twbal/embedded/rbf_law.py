"""The searched policy as C: a radial-basis network with a linear part behind the squash."""

import numpy as np

from twbal.core.gaussian import Array
from twbal.embedded.c_source import constant_array, real
from twbal.embedded.law import UNIT, Law, Operations, Rounding
from twbal.policies.rbf import RbfPolicy
from twbal.policies.squash import squash

_FUNCTION_ULPS = 4.0  # of expf, sinf and erff together with what they are given; libraries stay below 2 each

# The error function in single precision, for boards whose library has none: x (1 + p(x²)) near 0, beyond it
# 1 - exp(-t (1 + q(t))); p and q are fitted by Lawson's weighted least squares. Off by 1e-7 at most (tests/embedded).
_ERF = """\
/* The error function, which avr-libc lacks. */
static inline float twbal_policy_erf(float x)
{
    const float t = fabsf(x), s = x * x;
    float r;
    if (t > 3.9f) {
        return x > 0.0f ? 1.0f : -1.0f;
    }
    if (t > 0.9277f) {
        r = 1.12312275e-05f * t - 3.22803092e-04f;
        r = r * t + 3.64245601e-03f;
        r = r * t - 2.37620567e-02f;
        r = r * t + 1.06236871e-01f;
        r = r * t + 6.35151321e-01f;
        r = r * t + 1.28648489e-01f;
        r = 1.0f - expf(-(r * t + t));
        return x > 0.0f ? r : -r;
    }
    r = -5.95377919e-04f * s + 4.98594971e-03f;
    r = r * s - 2.67617279e-02f;
    r = r * s + 1.12816829e-01f;
    r = r * s - 3.76124811e-01f;
    r = r * s + 1.28379148e-01f;
    return r * x + x;
}

"""


def rbf_law(policy: RbfPolicy) -> Law:
    """u = u_max σ_c(b + kᵀx + Σ w_i φ_i(x)); basis functions of weight 0 are left out."""
    used = np.flatnonzero(policy.weights)
    count, width = len(used), len(policy.channels)
    constants = f"#define TWBAL_POLICY_BASIS {count}\n" + constant_array(
        "twbal_policy_gain", policy.gain, "TWBAL_POLICY_CHANNELS"
    )
    if count:
        constants += constant_array("twbal_policy_inverse_lengths", 1.0 / policy.lengths, "TWBAL_POLICY_CHANNELS")
        scaled = policy.centres[used] / policy.lengths
        constants += constant_array("twbal_policy_centres", scaled, "TWBAL_POLICY_BASIS * TWBAL_POLICY_CHANNELS")
        constants += constant_array("twbal_policy_weights", policy.weights[used], "TWBAL_POLICY_BASIS")
    return Law(
        formula="u = u_max squash(bias + gain . x + sum of weights * exp(-|x / lengths - centres|^2 / 2))",
        constants=constants,
        body=_body(policy, count > 0),
        helpers=_ERF if policy.compensation else "",
        numbers=width + (width + count * (width + 1) if count else 0),
        scratch=width if count else 0,
        operations=_operations(policy, count),
    )


def rbf_rounding(policy: RbfPolicy, states: Array) -> Rounding:
    """First-order error bound of the header's sums, products and functions, for states (n, D) of single precision.

    Each basis function errs by its exponent's error, Σ 2 |gap| δgap / 2, where a gap is the difference of two numbers
    that are rounded; the sums err by a unit of their partial sums' largest size for each term.
    """
    activation = policy.activation(states)
    gaps = (states[:, None, :] - policy.centres) / policy.lengths
    sizes = np.abs(states[:, None, :]) / policy.lengths + np.abs(policy.centres / policy.lengths)
    squares = (gaps**2).sum(axis=-1)
    terms = np.abs(policy.weights) * np.exp(-0.5 * squares)
    exponent = (np.abs(gaps) * 3.0 * sizes).sum(axis=-1) + 0.5 * (len(policy.channels) + 2) * squares
    linear = np.abs(policy.bias) + np.abs(states) @ np.abs(policy.gain)
    summands = len(policy.channels) + np.count_nonzero(policy.weights) + 2
    off = UNIT * (summands * (linear + terms.sum(axis=-1)) + (terms * (exponent + _FUNCTION_ULPS)).sum(axis=-1))
    off += UNIT * np.abs(activation)
    around = np.stack(
        [squash(activation + shift * off, policy.compensation, policy.compensation_width) for shift in (-1.0, 0.0, 1.0)]
    )
    moved = np.abs(around - around[1]).max(axis=0)
    return Rounding(policy.max_command * around[1], policy.max_command * (1.5 * moved + 4 * _FUNCTION_ULPS * UNIT))


def _body(policy: RbfPolicy, has_basis: bool) -> str:
    lines = [f"    float a = {real(policy.bias)}, s;", "    int i;"]
    if has_basis:
        lines += ["    float z[TWBAL_POLICY_CHANNELS];", "    int n;"]
    lines += [
        "    for (i = 0; i < TWBAL_POLICY_CHANNELS; ++i) {",
        "        a += TWBAL_READ(twbal_policy_gain[i]) * x[i];",
    ]
    if has_basis:
        lines += ["        z[i] = x[i] * TWBAL_READ(twbal_policy_inverse_lengths[i]);"]
    lines += ["    }"]
    if has_basis:
        lines += [
            "    for (n = 0; n < TWBAL_POLICY_BASIS; ++n) {",
            "        float squares = 0.0f;",
            "        for (i = 0; i < TWBAL_POLICY_CHANNELS; ++i) {",
            "            const float gap = z[i] - TWBAL_READ(twbal_policy_centres[n * TWBAL_POLICY_CHANNELS + i]);",
            "            squares += gap * gap;",
            "        }",
            "        a += TWBAL_READ(twbal_policy_weights[n]) * expf(-0.5f * squares);",
            "    }",
        ]
    lines += ["    s = sinf(a); /* (9 sin a + sin 3a) / 8 = s (3 - s^2) / 2 */"]
    if not policy.compensation:
        return "\n".join([*lines, "    return TWBAL_POLICY_MAX_COMMAND * (0.5f * s * (3.0f - s * s));"])
    share, scale = policy.compensation, 1.0 / (np.sqrt(2.0) * policy.compensation_width)
    lines += [
        f"    return TWBAL_POLICY_MAX_COMMAND * ({real(1.0 - share)} * (0.5f * s * (3.0f - s * s))",
        f"        + {real(share)} * twbal_policy_erf(asinf(s) * {real(scale)}));",
    ]
    return "\n".join(lines)


def _operations(policy: RbfPolicy, count: int) -> Operations:
    width, has = len(policy.channels), int(policy.compensation > 0)
    return Operations(
        add=width + count * (2 * width + 1) + 1 + has * 9,
        multiply=width * (2 if count else 1) + count * (width + 2) + 4 + has * 10,
        read=width * (2 if count else 1) + count * (width + 1),
        exp=count + has,
        sin=1,
        asin=has,
    )
