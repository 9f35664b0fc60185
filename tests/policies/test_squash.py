import numpy as np
import pytest

from twbal.policies.squash import squash, squash_moments


def by_quadrature(function, m, v):
    """E[function(a)] for a ~ N(m, v), by the trapezoid rule, which is exact to round-off for such integrands."""
    z, step = np.linspace(-12.0, 12.0, int(24 * max(200.0, 20 * np.sqrt(v))) + 1, retstep=True)
    density = np.exp(-0.5 * z**2) / np.sqrt(2 * np.pi)
    return step * np.sum(density * function(m + np.sqrt(v) * z))


def slope(a):
    return (9 * np.cos(a) + 3 * np.cos(3 * a)) / 8


def test_the_squash_meets_its_bounds_and_is_steepest_at_zero():
    assert squash(np.array([0.0, np.pi / 2, -np.pi / 2])) == pytest.approx([0.0, 1.0, -1.0])
    assert (squash(1e-6) - squash(-1e-6)) / 2e-6 == pytest.approx(1.5)
    around = np.concatenate([np.pi / 2 + 1e-4 * np.linspace(-1, 1, 20_001), np.linspace(-20, 20, 20_001)])
    assert np.abs(squash(around)).max() <= 1.0


@pytest.mark.parametrize("m", [-4.0, -0.3, 0.0, 1.1, 30.0])
@pytest.mark.parametrize("v", [1e-6, 0.01, 0.7, 9.0, 400.0, 1e4])
def test_moments_equal_quadrature(m, v):
    found = squash_moments(m, v)
    mean = by_quadrature(squash, m, v)
    assert found.mean == pytest.approx(mean, abs=1e-11)
    assert found.gain == pytest.approx(by_quadrature(slope, m, v), abs=1e-11)
    variance = by_quadrature(lambda a: (squash(a) - mean) ** 2, m, v)
    assert found.variance == pytest.approx(variance, rel=1e-8, abs=1e-13)


@pytest.mark.parametrize("m", [-2.0, 0.0, 0.9])
@pytest.mark.parametrize("v", [0.02, 1.0, 20.0])
def test_derivatives_equal_finite_differences(m, v):
    found, h = squash_moments(m, v), 1e-5
    pairs = [(squash_moments(m + h, v), squash_moments(m - h, v)), (squash_moments(m, v + h), squash_moments(m, v - h))]
    for name in ("mean", "gain", "variance"):
        numeric = [(getattr(above, name) - getattr(below, name)) / (2 * h) for above, below in pairs]
        np.testing.assert_allclose(getattr(found, f"{name}_by"), numeric, rtol=1e-6, atol=1e-9)


def test_no_variance_gives_the_squash_itself():
    found = squash_moments(0.4, 0.0)
    assert (found.mean, found.gain, found.variance) == pytest.approx((squash(0.4), slope(0.4), 0.0))


@pytest.mark.parametrize("v", [1e8, 1e300])
def test_a_huge_variance_does_not_overflow(v):
    found = squash_moments(1.0, v)
    assert (found.mean, found.gain) == (0.0, 0.0)
    assert found.variance == pytest.approx(by_quadrature(squash_squared, 0.0, 1e4))
    assert not np.concatenate([found.mean_by, found.gain_by, found.variance_by]).any()


def squash_squared(a):
    return squash(a) ** 2
