"""e^x and e^x - 1 over a row of numbers, as loops that compilers turn into vector instructions.

For the latter x = k ln 2 + r with |r| <= ½ ln 2, and e^x - 1 = 2^k (e^r - 1) + (2^k - 1): for small x, k = 0 and no
digit is lost. The library's own `expm1` takes one number at a time, three to four times slower.
"""

import math

from twbal.core.compiled import ROUNDING, fused, kernel, times_power
from twbal.core.gaussian import Array

_LOG2_E = 1.4426950408889634
_LN2_HIGH, _LN2_LOW = 6.93147180369123816490e-01, 1.90821492927058770002e-10  # ln 2 in two parts, as in fdlibm
_LEAST = -693.0  # e^x is 1e-301 there
_LOWEST, _HIGHEST = -700.0, 600.0  # beyond them e^x is 0 next to 1, or the sums it goes into are lost anyway
_OF_E = tuple(1.0 / math.factorial(k) for k in range(14))
"""e^r by Taylor: beyond r^13 there is less than 4e-18 of r for |r| <= ½ ln 2."""
_OF_2 = tuple(math.log(2.0) ** k / math.factorial(k) for k in range(13))
"""2^r by Taylor: beyond r^12 there is less than 2e-16 of it for |r| <= ½."""

_NUMBERS = {"nnan", "ninf"}  # what comes in is a number; nothing that would change a digit


@kernel(fastmath=_NUMBERS)
def expm1_in_place(values: Array) -> None:
    """Replace each x of `values` (n,) by e^x - 1, with x cut to [-700, 600]. Relative error about 2e-16."""
    for j in range(len(values)):
        x = min(max(values[j], _LOWEST), _HIGHEST)
        shifted = x * _LOG2_E + ROUNDING
        k = shifted - ROUNDING
        r = fused(-k, _LN2_LOW, fused(-k, _LN2_HIGH, x))
        p = fused(_OF_E[13], r, _OF_E[12])
        p = fused(p, r, _OF_E[11])
        p = fused(p, r, _OF_E[10])
        p = fused(p, r, _OF_E[9])
        p = fused(p, r, _OF_E[8])
        p = fused(p, r, _OF_E[7])
        p = fused(p, r, _OF_E[6])
        p = fused(p, r, _OF_E[5])
        p = fused(p, r, _OF_E[4])
        p = fused(p, r, _OF_E[3])
        p = fused(p, r, _OF_E[2])
        p = fused(r * r, p, r)
        power = times_power(1.0, shifted)
        values[j] = fused(power, p, power - 1.0)


@kernel(is_kept=False, is_inlined=True)
def power_of_two(z: float) -> float:
    """2^z of -1000 <= z <= 1000 to about 2e-16 of it; what is NaN stays NaN."""
    shifted = z + ROUNDING
    r = z - (shifted - ROUNDING)  # within ±½
    p = fused(_OF_2[12], r, _OF_2[11])
    p = fused(p, r, _OF_2[10])
    p = fused(p, r, _OF_2[9])
    p = fused(p, r, _OF_2[8])
    p = fused(p, r, _OF_2[7])
    p = fused(p, r, _OF_2[6])
    p = fused(p, r, _OF_2[5])
    p = fused(p, r, _OF_2[4])
    p = fused(p, r, _OF_2[3])
    p = fused(p, r, _OF_2[2])
    p = fused(p, r, _OF_2[1])
    return float(times_power(fused(p, r, 1.0), shifted))


@kernel()
def exp_in_place(values: Array) -> None:
    """Replace each x <= 0 of `values` (n,) by e^x, with x cut to at least -693, within 2e-16. What is NaN stays NaN.

    As 2^z with z = x log2(e), which is rounded: relatively the error is up to |x| 2e-16.
    """
    for j in range(len(values)):
        x = values[j]
        values[j] = power_of_two((_LEAST if x < _LEAST else x) * _LOG2_E)
