import numpy as np
import pytest

from twbal.core.compiled import kernel, rarely
from twbal.core.sine_cosine import sine_and_cosine


@kernel(is_kept=False)
def both(angles):
    found = np.empty((2, len(angles)))
    for i in range(len(angles)):
        found[0, i], found[1, i] = sine_and_cosine(angles[i])
    return found


@kernel(is_kept=False)
def halved_where_it_is_odd(number):
    if rarely(number % 2 == 1):
        return 0.5 * number
    return 1.0 * number


def test_both_are_right_to_one_and_a_third_units_in_the_last_place():
    eighth = 0.25 * np.pi
    edges = eighth + np.array([-1e-16, 0.0, 1e-16, -1e-9, 1e-9])
    angles = np.concatenate([np.linspace(-eighth, eighth, 20001), edges, -edges, np.logspace(-300, 0, 200), [0.0]])
    wide = angles.astype(np.longdouble)
    for found, expected in zip(both(angles), (np.sin(wide), np.cos(wide)), strict=True):
        np.testing.assert_array_less(np.abs(found - expected), 1.3 * np.spacing(np.abs(expected).astype(float)))


def test_beyond_an_eighth_of_a_turn_they_are_the_librarys():
    angles = np.concatenate([np.linspace(-20.0, 20.0, 4001), [1e6, -1e300]])
    angles = angles[np.abs(angles) > 0.25 * np.pi]
    np.testing.assert_allclose(both(angles), [np.sin(angles), np.cos(angles)], rtol=4e-16)


def test_sines_are_odd_and_cosines_even():
    angles = np.linspace(0.0, 3.0, 1001)
    (sine, cosine), (negative, same) = both(angles), both(-angles)
    np.testing.assert_array_equal(negative, -sine)
    np.testing.assert_array_equal(same, cosine)


def test_what_is_no_number_gives_none():
    assert np.isnan(both(np.array([np.nan, np.inf, -np.inf]))).all()


@pytest.mark.parametrize(("number", "expected"), [(3, 1.5), (4, 4.0)])
def test_what_happens_rarely_happens_all_the_same(number, expected):
    assert halved_where_it_is_odd(number) == expected
