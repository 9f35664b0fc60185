import numpy as np
import pytest

from twbal.policies.squash import COMPENSATION_WIDTH, NARROWEST, compensation_of, squash, squash_moments, squashed

PLAIN = compensation_of(0.0)
SHARES = (0.2, 0.6)
WIDTHS = (NARROWEST, COMPENSATION_WIDTH)


def by_quadrature(function, m, v, width=0.05):
    """E[function(a)] for a ~ N(m, v), by the trapezoid rule, which is exact to round-off where nothing is narrower."""
    z, step = np.linspace(-12.0, 12.0, int(24 * max(200.0, np.sqrt(v) / width)) + 1, retstep=True)
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
    found = squash_moments(m, v, PLAIN)
    mean = by_quadrature(squash, m, v)
    assert found.mean == pytest.approx(mean, abs=1e-11)
    assert found.gain == pytest.approx(by_quadrature(slope, m, v), abs=1e-11)
    variance = by_quadrature(lambda a: (squash(a) - mean) ** 2, m, v)
    assert found.variance == pytest.approx(variance, rel=1e-8, abs=1e-13)


@pytest.mark.parametrize("m", [-2.0, 0.0, 0.02, 0.9])
@pytest.mark.parametrize("v", [0.02, 1.0, 20.0])
@pytest.mark.parametrize("share", [0.0, *SHARES])
def test_derivatives_equal_finite_differences(m, v, share):
    kept, h = compensation_of(share), 1e-5
    found = squash_moments(m, v, kept)
    along_m = squash_moments(m + h, v, kept), squash_moments(m - h, v, kept)
    along_v = squash_moments(m, v + h, kept), squash_moments(m, v - h, kept)
    for name in ("mean", "gain", "variance"):
        numeric = [(getattr(above, name) - getattr(below, name)) / (2 * h) for above, below in (along_m, along_v)]
        np.testing.assert_allclose(getattr(found, f"{name}_by"), numeric, rtol=1e-5, atol=1e-8)


def test_no_variance_gives_the_squash_itself():
    found = squash_moments(0.4, 0.0, PLAIN)
    assert (found.mean, found.gain, found.variance) == pytest.approx((squash(0.4), slope(0.4), 0.0))


@pytest.mark.parametrize("v", [1e8, 1e300])
def test_a_huge_variance_does_not_overflow(v):
    found = squash_moments(1.0, v, PLAIN)
    assert (found.mean, found.gain) == (0.0, 0.0)
    assert found.variance == pytest.approx(by_quadrature(squash_squared, 0.0, 1e4))
    assert not np.concatenate([found.mean_by, found.gain_by, found.variance_by]).any()


def squash_squared(a):
    return squash(a) ** 2


def compensated(a, share, width):
    """σ_c(a) by its definition: the square wave sign(sin a), smoothed by a normal density."""
    z, step = np.linspace(-8.0, 8.0, 4001, retstep=True)
    density = np.exp(-0.5 * z**2) / np.sqrt(2 * np.pi)
    wave = np.sign(np.sin(np.asarray(a)[:, None] + width * z))
    return (1 - share) * squash(np.asarray(a)) + share * step * (wave @ density)


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("share", SHARES)
def test_friction_compensation_is_a_smoothed_square_wave_beside_the_squash(share, width):
    a = np.linspace(-7.0, 7.0, 1501)
    found = squash(a, share, width)
    np.testing.assert_allclose(found, compensated(a, share, width), atol=1e-3)  # of the quadrature of a jump
    kept = compensation_of(share, width)
    np.testing.assert_allclose([squashed(float(each), kept) for each in a], found, atol=1e-14)
    assert np.abs(found).max() <= 1.0
    np.testing.assert_allclose(squash(-a, share, width), -found, atol=1e-12)


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("share", SHARES)
def test_the_command_jumps_by_the_share_where_the_activation_changes_its_sign(share, width):
    beyond = 4 * width
    assert squash(beyond, share, width) - (1 - share) * squash(beyond) == pytest.approx(share, abs=1e-4)
    assert squash(0.0, share, width) == 0.0
    slope_there = (squash(1e-6, share, width) - squash(-1e-6, share, width)) / 2e-6
    density = 2.0 / (np.sqrt(2 * np.pi) * width)
    assert slope_there == pytest.approx(1.5 * (1 - share) + share * density, rel=1e-6)


@pytest.mark.parametrize("m", [-4.0, -0.03, 0.0, 1.1, 30.0])
@pytest.mark.parametrize("v", [1e-6, 1e-3, 0.01, 0.7, 9.0, 400.0])
@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("share", SHARES)
def test_moments_with_compensation_equal_quadrature(m, v, share, width):
    """The series of the square wave ends below 1e-5 of it, at any activation."""
    found = squash_moments(m, v, compensation_of(share, width))

    def law(a):
        return squash(a, share, width)

    def steepness(a):
        return (law(a + 1e-6) - law(a - 1e-6)) / 2e-6

    mean, fine = by_quadrature(law, m, v, width / 2), width / 2
    assert found.mean == pytest.approx(mean, abs=2e-5)
    assert found.gain == pytest.approx(by_quadrature(steepness, m, v, fine), rel=2e-4, abs=2e-3)
    expected = by_quadrature(lambda a: (law(a) - mean) ** 2, m, v, fine)
    assert found.variance == pytest.approx(expected, rel=1e-3, abs=2e-5)
    assert np.abs(found.mean) <= 1.0 + 1e-5


def test_a_command_moves_with_the_state_as_the_gain_says():
    """Stein's lemma, by samples: Cov(a, σ_c(a)) = v E[σ_c']."""
    m, v, share = 0.05, 0.04, 0.4
    a = m + np.sqrt(v) * np.random.default_rng(0).standard_normal(400_000)
    products = (a - m) * squash(a, share)
    found = v * squash_moments(m, v, compensation_of(share)).gain
    assert abs(products.mean() - found) < 4 * products.std() / np.sqrt(len(a))
