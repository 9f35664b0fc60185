"""Cosines as a polynomial without a branch, so that compilers turn loops over them into vector instructions."""

import math

from twbal.core.compiled import ROUNDING, fused, kernel

_SINE = tuple((-1) ** k * (2.0 * math.pi) ** (2 * k + 1) / math.factorial(2 * k + 1) for k in range(10))
"""sin 2πs = s Σ_k _SINE_k s^2k by Taylor: beyond s^19 there is less than 3e-16 for |s| <= ¼."""

_NUMBERS = {"nnan", "ninf"}  # what comes in is a number; nothing that would change a digit


@kernel(fastmath=_NUMBERS)
def cosine_of_turns(turns: float) -> float:
    """cos 2πz of |z| < 2^51, as sin 2πs with s = ¼ - |z modulo 1|; absolute error below 6e-16."""
    s = 0.25 - abs(turns - ((turns + ROUNDING) - ROUNDING))
    y = s * s
    p = fused(_SINE[9], y, _SINE[8])
    p = fused(p, y, _SINE[7])
    p = fused(p, y, _SINE[6])
    p = fused(p, y, _SINE[5])
    p = fused(p, y, _SINE[4])
    p = fused(p, y, _SINE[3])
    p = fused(p, y, _SINE[2])
    p = fused(p, y, _SINE[1])
    return float(s * fused(p, y, _SINE[0]))
