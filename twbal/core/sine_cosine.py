"""Sine and cosine of one angle together, for loops in which calls of the C library would take much of the time."""

import math
from math import cos, sin
from typing import NamedTuple

from twbal.core.compiled import fused, kernel, rarely

_SINE = tuple((-1) ** k / math.factorial(2 * k + 1) for k in range(1, 9))
"""sin x = x + x z Σ_k _SINE_k z^k with z = x², by Taylor: beyond x^17 there is less than 1e-19 for |x| <= π/4."""
_COSINE = tuple((-1) ** k / math.factorial(2 * k) for k in range(2, 10))
"""cos x = 1 - z/2 + z² Σ_k _COSINE_k z^k, by Taylor: beyond x^18 there is less than 4e-21 for |x| <= π/4."""
_EIGHTH = 0.25 * math.pi  # of a turn


class SineCosine(NamedTuple):
    """Of one angle."""

    sine: float
    cosine: float


@kernel(is_kept=False, is_inlined=True)
def sine_and_cosine(angle: float) -> SineCosine:
    """Sine and cosine of an angle [rad], to 1.3 units in the last place; the C library's beyond ±π/4.

    Terms are added in pairs, as in Estrin's scheme: a series that is summed up one by one waits for each sum.
    """
    if rarely(abs(angle) > _EIGHTH):
        return SineCosine(sin(angle), cos(angle))
    z = angle * angle
    z2 = z * z
    z4 = z2 * z2
    low = fused(fused(_SINE[3], z, _SINE[2]), z2, fused(_SINE[1], z, _SINE[0]))
    high = fused(fused(_SINE[7], z, _SINE[6]), z2, fused(_SINE[5], z, _SINE[4]))
    sine = fused(angle * z, fused(high, z4, low), angle)
    low = fused(fused(_COSINE[3], z, _COSINE[2]), z2, fused(_COSINE[1], z, _COSINE[0]))
    high = fused(fused(_COSINE[7], z, _COSINE[6]), z2, fused(_COSINE[5], z, _COSINE[4]))
    cosine = fused(z2, fused(high, z4, low), fused(-0.5, z, 1.0))
    return SineCosine(sine, cosine)
