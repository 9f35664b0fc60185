"""A neural network as C."""

import numpy as np

from twbal.core.gaussian import Array
from twbal.embedded.c_source import constant_array
from twbal.embedded.law import UNIT, Law, Operations, Rounding
from twbal.policies.mlp import MlpPolicy

_FUNCTION_ULPS = 4.0
_DEVIATIONS = 6.0
_ACTIVATION = {"tanh": "tanhf(a)", "relu": "a < 0.0f ? 0.0f : a"}  # of no number it makes none
_SQUASH = {"tanh": "tanhf(a)", "clip": "a > 1.0f ? 1.0f : (a < -1.0f ? -1.0f : a)"}
_LAYER = """\
    for (i = 0; i < {rows}; ++i) {{
        float a = TWBAL_READ(twbal_policy_biases_{layer}[i]);
        for (j = 0; j < {columns}; ++j) {{
            a += TWBAL_READ(twbal_policy_weights_{layer}[i * {columns} + j]) * {source}[j];
        }}
        {target}[i] = {function};
    }}"""


def mlp_law(policy: MlpPolicy) -> Law:
    """u = u_max σ(W_L h_{L-1} + b_L), layer by layer between two buffers."""
    constants, steps = "", []
    widest = max(map(len, policy.biases))
    for number, (W, b) in enumerate(zip(policy.weights, policy.biases, strict=True)):
        rows, columns = W.shape
        constants += constant_array(f"twbal_policy_weights_{number}", W, f"{rows} * {columns}")
        constants += constant_array(f"twbal_policy_biases_{number}", b, f"{rows}")
        is_last = number == len(policy.weights) - 1
        function = _SQUASH[policy.squash] if is_last else _ACTIVATION[policy.activation]
        source = f"h[{(number + 1) % 2}]" if number else "x"
        places = {"source": source, "target": f"h[{number % 2}]", "function": function, "layer": number}
        steps.append(_LAYER.format(rows=rows, columns=columns, **places))
    last = f"    return TWBAL_POLICY_MAX_COMMAND * h[{(len(policy.weights) - 1) % 2}][0];"
    numbers = sum(W.size + b.size for W, b in zip(policy.weights, policy.biases, strict=True))
    return Law(
        formula="u = u_max f(W h + b), layer by layer",
        constants=constants,
        body="\n".join([f"    float h[2][{widest}];", "    int i, j;", *steps, last]),
        helpers="",
        numbers=numbers,
        scratch=2 * widest,
        operations=_operations(policy, numbers),
    )


def mlp_rounding(policy: MlpPolicy, states: Array) -> Rounding:
    """Six standard deviations of the rounding errors, which are taken for independent (Higham and Mary 2019).

    A layer's error is that of its sums, √n units of the size of what is summed, and that of the layer before times its
    weights, all of it times the slope of its activation. The bound of the worst case would be hundreds of times wider.
    """
    hidden, off = states, np.zeros_like(states)
    for number, (W, b) in enumerate(zip(policy.weights, policy.biases, strict=True)):
        is_last = number == len(policy.weights) - 1
        name = policy.squash if is_last else policy.activation
        sizes = np.abs(hidden) @ np.abs(W).T + np.abs(b)
        variance = off**2 @ (W**2).T + (UNIT * sizes) ** 2 * (W.shape[1] + 3)
        a = hidden @ W.T + b
        hidden = np.tanh(a) if name == "tanh" else np.clip(a, -1.0 if is_last else 0.0, 1.0 if is_last else np.inf)
        slope = 1.0 - hidden**2 if name == "tanh" else 1.0
        off = slope * np.sqrt(variance) + _FUNCTION_ULPS / 2 * UNIT * np.abs(hidden)
    return Rounding(policy.max_command * hidden[:, 0], policy.max_command * (_DEVIATIONS * off[:, 0] + 4 * UNIT))


def _operations(policy: MlpPolicy, numbers: int) -> Operations:
    products = sum(W.size for W in policy.weights)
    hidden = sum(map(len, policy.biases[:-1]))
    calls = hidden * (policy.activation == "tanh") + (policy.squash == "tanh")
    return Operations(add=products + hidden + 2, multiply=products + 1, read=numbers, tanh=calls)
