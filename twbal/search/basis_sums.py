"""GP means and functions sampled from GPs, as weighted sums that compilers turn into vector instructions.

The sums visit whole rows of basis functions: an exponential and a cosine each is a polynomial without a branch, and
rows are padded by functions of weight 0. The order of the additions is fixed, so that the same digits come out of
vectors of any width.
"""

import math
from typing import NamedTuple

import numpy as np

from twbal.core.compiled import fused, kernel
from twbal.core.cosine import cosine_of_turns
from twbal.core.exponential import power_of_two
from twbal.core.gaussian import Array
from twbal.models.function_samples import FunctionSamples
from twbal.models.gp import GaussianProcess
from twbal.models.moments.multi_index import Integers

_WIDTH = 32  # functions in a row: a multiple of it, so that quarters of a row are whole vectors
_AT_ONCE = 6  # inputs that the last loop takes, which knows their number

_NUMBERS = {"nnan", "ninf"}  # what comes in is a number; nothing that would change a digit

_LOWEST = -1000.0  # powers of two below it are 0 next to 1


class BasisSum(NamedTuple):
    """Σ_j weight_j b(offset_j + direction_j · x'), x' = (x - origin) scale, of E outputs.

    b is a Gaussian bell, 2^(offset + direction · x' - ½ |x'|²), or a cosine of turns. Inputs of direction 0 and
    functions of weight 0 fill up d' and n'.

    Attributes:
        are_bells: or they are cosines.
        directions: (E, d', n').
        offsets: (E, n').
        origin: (d,).
        scales: (E, d).
        weights: (E, robots, n'); of one robot where all robots share them.
    """

    are_bells: bool
    directions: Array
    offsets: Array
    origin: Array
    scales: Array
    weights: Array


def bells(gp: GaussianProcess, weights: Array) -> BasisSum:
    """Σ_c weight_c k_a(x, c) over the centres of a GP.

    Args:
        gp: kernel and centres.
        weights: (E, n, robots), or (E, n, 1).
    """
    origin = gp.centres.mean(axis=0) if len(gp.centres) else np.zeros(gp.inputs)  # centring saves digits
    scales = math.sqrt(math.log2(math.e)) / gp.length_scales  # e^z = 2^(z log2 e)
    places = (gp.centres - origin)[None] * scales[:, None, :]  # (E, n, d)
    offsets = -0.5 * np.sum(places**2, axis=2)
    return _padded(True, places, offsets, origin, scales, weights * gp.signal_variance[:, None, None])


def waves(samples: FunctionSamples) -> BasisSum:
    """Σ_m a_m cos(ω_m · x + φ_m), the prior part of sampled functions."""
    outputs, _, inputs = samples.frequencies.shape
    turn = 2.0 * math.pi
    as_they_are = np.zeros(inputs), np.ones((outputs, inputs))
    return _padded(False, samples.frequencies / turn, samples.phases / turn, *as_they_are, samples.features)


def nothing(outputs: int, inputs: int) -> BasisSum:
    """The zero function with E outputs of d inputs."""
    flat = np.zeros(inputs), np.ones((outputs, inputs))
    return _padded(True, np.zeros((outputs, 0, inputs)), np.zeros((outputs, 0)), *flat, np.zeros((outputs, 0, 1)))


def _padded(
    are_bells: bool, directions: Array, offsets: Array, origin: Array, scales: Array, weights: Array
) -> BasisSum:
    """Rows of whole vectors, from directions (E, n, d), offsets (E, n) and weights (E, n, robots)."""
    _, n, d = directions.shape
    functions, inputs = (0, -n % _WIDTH), (0, max(_AT_ONCE - d, 0))
    return BasisSum(
        are_bells,
        np.ascontiguousarray(np.pad(directions, ((0, 0), functions, inputs)).transpose(0, 2, 1)),
        np.pad(offsets, ((0, 0), functions)),
        origin,
        scales,
        np.ascontiguousarray(np.pad(weights, ((0, 0), functions, (0, 0))).transpose(0, 2, 1)),
    )


@kernel(fastmath=_NUMBERS)
def add_sums(basis: BasisSum, inputs: Array, robots: Integers, totals: Array) -> None:
    """Add the functions of some robots, each at its own inputs, to `totals`.

    Args:
        basis: functions of n robots, or one function of them all.
        inputs: (n, d), finite.
        robots: indices of those that count.
        totals: (n, E).
    """
    outputs, d, functions = basis.directions.shape
    place, start, row = np.zeros(d), np.empty(functions), np.empty(functions)
    for a in range(outputs if functions else 0):
        directions, offsets, weights = basis.directions[a], basis.offsets[a], basis.weights[a]
        for i in robots:
            constant = 0.0
            for k in range(inputs.shape[1]):
                place[k] = (inputs[i, k] - basis.origin[k]) * basis.scales[a, k]
                constant -= 0.5 * place[k] * place[k]
            if d > _AT_ONCE:
                _begin(directions, offsets, place, start)
            if basis.are_bells and d > _AT_ONCE:
                _bells(directions, start, constant, place, row)
            elif basis.are_bells:
                _bells(directions, offsets, constant, place, row)
            elif d > _AT_ONCE:
                _cosines(directions, start, place, row)
            else:
                _cosines(directions, offsets, place, row)
            totals[i, a] += _weighted(weights, i if len(weights) > 1 else 0, row)


@kernel(fastmath=_NUMBERS)
def _begin(directions: Array, offsets: Array, place: Array, start: Array) -> None:
    """What the last inputs add to: offsets, and the directions of inputs before the last `_AT_ONCE`."""
    start[:] = offsets
    for k in range(len(place) - _AT_ONCE):
        for j in range(len(start)):
            start[j] = fused(directions[k, j], place[k], start[j])


@kernel(fastmath=_NUMBERS)
def _bells(directions: Array, start: Array, constant: float, place: Array, row: Array) -> None:
    """2^(start + constant + directions · place) by the last inputs, cut at 2^-1000."""
    k = len(place) - _AT_ONCE
    a, b, c, d, e, f = place[k], place[k + 1], place[k + 2], place[k + 3], place[k + 4], place[k + 5]
    for j in range(len(row)):
        z = fused(directions[k, j], a, fused(directions[k + 1, j], b, start[j] + constant))
        z = fused(directions[k + 2, j], c, fused(directions[k + 3, j], d, z))
        z = fused(directions[k + 4, j], e, fused(directions[k + 5, j], f, z))
        row[j] = power_of_two(max(z, _LOWEST))


@kernel(fastmath=_NUMBERS)
def _cosines(directions: Array, start: Array, place: Array, row: Array) -> None:
    """cos 2πz of z = start + directions · place by the last inputs."""
    k = len(place) - _AT_ONCE
    a, b, c, d, e, f = place[k], place[k + 1], place[k + 2], place[k + 3], place[k + 4], place[k + 5]
    for j in range(len(row)):
        z = fused(directions[k, j], a, fused(directions[k + 1, j], b, start[j]))
        z = fused(directions[k + 2, j], c, fused(directions[k + 3, j], d, z))
        z = fused(directions[k + 4, j], e, fused(directions[k + 5, j], f, z))
        row[j] = cosine_of_turns(z)


@kernel(fastmath=_NUMBERS)
def _weighted(weights: Array, robot: int, row: Array) -> float:
    """Σ_j weights_j row_j, in an order of its own: quarters of the row first, then every eighth number."""
    n = len(row) // 4
    for j in range(n):
        left = fused(weights[robot, j], row[j], weights[robot, j + n] * row[j + n])
        right = fused(weights[robot, j + 2 * n], row[j + 2 * n], weights[robot, j + 3 * n] * row[j + 3 * n])
        row[j] = left + right
    a = b = c = d = e = f = g = h = 0.0
    for j in range(0, n, 8):
        a += row[j]
        b += row[j + 1]
        c += row[j + 2]
        d += row[j + 3]
        e += row[j + 4]
        f += row[j + 5]
        g += row[j + 6]
        h += row[j + 7]
    return ((a + b) + (c + d)) + ((e + f) + (g + h))
