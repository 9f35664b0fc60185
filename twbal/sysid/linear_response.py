r"""Prediction errors that torques leave of which the model does not know, by the linear model.

With δ the true state less the predicted one, e_n = C δ_n and δ_{n+1} = F (δ_n - K_n e_n) + B τ_n. All series take a
step together, so that the compiler makes vectors of them; entries of F and C that are 0, most of them, are left out.
"""

import numpy as np

from twbal.core.compiled import kernel
from twbal.core.gaussian import Array


@kernel(is_inlined=True)
def _see(C: Array, delta: Array, seen: Array) -> None:
    """Write the errors C δ of each series, (4, m)."""
    for j in range(4):
        seen[j] = 0.0
        for i in range(len(delta)):
            if C[j, i] != 0.0:
                for m in range(delta.shape[1]):
                    seen[j, m] += C[j, i] * delta[i, m]


@kernel(is_inlined=True)
def _carry(F: Array, K: Array, B: Array, torques: Array, seen: Array, moved: Array, delta: Array) -> None:
    """Carry δ of each series (S, m) over a control period with torques (m,); `moved` (S, m) is scratch space."""
    states, count = delta.shape
    for i in range(states):
        for m in range(count):
            moved[i, m] = delta[i, m]
        for j in range(4):
            for m in range(count):
                moved[i, m] -= K[i, j] * seen[j, m]
    for i in range(states):
        for m in range(count):
            delta[i, m] = B[i] * torques[m]
        for j in range(states):
            if F[i, j] != 0.0:
                for m in range(count):
                    delta[i, m] += F[i, j] * moved[j, m]


@kernel()
def respond_each(F: Array, C: Array, gains: Array, B: Array, torques: Array) -> Array:
    """Prediction errors (m, T + 1, 4) that m series of torques (T, m) leave; B is (S,)."""
    steps, count = torques.shape
    errors = np.zeros((count, steps + 1, 4))
    delta, moved, seen = np.zeros((len(F), count)), np.empty((len(F), count)), np.empty((4, count))
    last = len(gains) - 1
    for n in range(steps + 1):
        _see(C, delta, seen)
        for j in range(4):
            errors[:, n, j] = seen[j]
        if n < steps:
            _carry(F, gains[min(n, last)], B, torques[n], seen, moved, delta)
    return errors


@kernel()
def match_each(
    F: Array, C: Array, gains: Array, B: Array, torques: Array, whiteners: Array, weights: Array, white: Array
) -> tuple[Array, Array]:
    """Regressions of errors on those that torques leave: what their normal equations need of each regression.

    Args:
        F, C, gains, B: as of `respond_each`.
        torques: (T, columns, m), of each of m regressions.
        whiteners: (G, 4, 4) of the filter, lower triangles.
        weights: (T + 1,) of instants, by which whitened errors are multiplied.
        white: (T, 4) whitened and weighted errors, without the first instant.

    Returns:
        Inner products of the columns with the errors, (columns, m), and with each other, (columns, columns, m).
    """
    steps, columns, count = torques.shape
    width = columns * count
    flat = torques.reshape(steps, width)
    pull, squares = np.zeros(width), np.zeros((columns, columns, count))
    delta, moved, seen = np.zeros((len(F), width)), np.empty((len(F), width)), np.empty((4, width))
    own = np.empty(width)
    for n in range(steps + 1):
        _see(C, delta, seen)
        if n > 0 and weights[n] > 0.0:
            W, weight = whiteners[min(n, len(whiteners) - 1)], weights[n]
            for i in range(4):
                own[:] = 0.0
                for j in range(i + 1):
                    factor = weight * W[i, j]
                    for m in range(width):
                        own[m] += factor * seen[j, m]
                error = white[n - 1, i]
                for m in range(width):
                    pull[m] += error * own[m]
                for a in range(columns):
                    for b in range(a + 1):
                        for m in range(count):
                            squares[a, b, m] += own[a * count + m] * own[b * count + m]
        if n < steps:
            _carry(F, gains[min(n, len(gains) - 1)], B, flat[n], seen, moved, delta)
    for a in range(columns):
        for b in range(a):
            squares[b, a] = squares[a, b]
    return pull.reshape(columns, count), squares
