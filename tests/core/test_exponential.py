import numpy as np

from twbal.core.exponential import expm1_in_place


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
