import numpy as np

from twbal.core.exponential import exp_in_place, expm1_in_place


def test_it_is_the_librarys_to_two_units_in_the_last_place():
    small = np.logspace(-18, 0, 500)
    x = np.concatenate([np.linspace(-60.0, 60.0, 5001), small, -small, [0.0, -700.0, 599.9]])
    values = x.copy()
    expm1_in_place(values)
    np.testing.assert_allclose(values, np.expm1(x), rtol=4.5e-16)


def test_numbers_beyond_what_doubles_can_hold_stay_finite():
    values = np.array([-1e300, -1e4, 1e4, 1e300])
    expm1_in_place(values)
    np.testing.assert_allclose(values, [-1.0, -1.0, np.expm1(600.0), np.expm1(600.0)], rtol=1e-12)


def test_the_exponential_is_the_librarys_to_digits_of_x():
    x = np.concatenate([np.linspace(-60.0, 0.0, 5001), -np.logspace(-18, 0, 500), [-0.0, -692.0]])
    values = x.copy()
    exp_in_place(values)
    exact = np.exp(x.astype(np.longdouble))
    assert np.max(np.abs(values / exact - 1.0) / np.maximum(np.abs(x), 2.0)) < 2e-16


def test_the_exponential_of_what_is_far_below_zero_is_next_to_nothing():
    values = np.array([-np.inf, -1e300, -1e4, -700.0])
    exp_in_place(values)
    assert np.all((values > 0.0) & (values < 1e-300))


def test_the_exponential_of_what_is_no_number_is_none():
    values = np.array([-1.0, np.nan, -2.0, np.nan, 0.0, -3.0, -np.nan, -4.0, -5.0])
    exp_in_place(values)
    np.testing.assert_array_equal(np.isnan(values), [False, True, False, True, False, False, True, False, False])
