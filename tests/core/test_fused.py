"""The operations that kernels have beyond numba's own, beside exact arithmetic."""

from fractions import Fraction
from math import ldexp

import numpy as np

from twbal.core.compiled import ROUNDING, fused, kernel, times_power


@kernel(is_kept=False)
def fused_rows(left, right, addend):
    found = np.empty(len(left))
    for j in range(len(left)):
        found[j] = fused(left[j], right[j], addend[j])
    return found


@kernel(is_kept=False)
def powers(values, exponents):
    found = np.empty(len(values))
    for j in range(len(values)):
        found[j] = times_power(values[j], exponents[j] + ROUNDING)
    return found


def test_a_fused_operation_rounds_once():
    rng = np.random.default_rng(0)
    left, right = rng.standard_normal((2, 200))
    addend = -left * right  # what is left is the rounding of the product, which two operations lose
    found = fused_rows(left, right, addend)
    assert np.any(found != 0.0)
    for a, b, c, sum_of in zip(left, right, addend, found, strict=True):
        assert sum_of == float(Fraction(a) * Fraction(b) + Fraction(c))


def test_powers_of_two_are_exact():
    values, exponents = np.linspace(0.7, 1.42, 2001), np.arange(-1000.0, 1001.0)
    expected = [ldexp(value, int(k)) for value, k in zip(values, exponents, strict=True)]
    np.testing.assert_array_equal(powers(values, exponents), expected)
    np.testing.assert_array_equal(powers(-values, exponents), np.negative(expected))
