"""Values drawn from what data leave open of a linear fit scatter as fits to other data of the same kind do."""

from types import SimpleNamespace

import numpy as np
import pytest

from twbal.sysid.intervals import drawn_values, standard_errors
from twbal.sysid.model import FreeParameter

COUNT, BLOCKS, VALUES = 2000, 20, np.array([0.3, -2.0, 40.0])
NAMES = ["first", "second", "third"]


@pytest.fixture(scope="module")
def slopes():
    """Of errors by three values of other sizes, the first two of which do nearly the same."""
    rng = np.random.default_rng(1)
    same = rng.standard_normal(COUNT)
    columns = same + 0.3 * rng.standard_normal(COUNT), same + 0.3 * rng.standard_normal(COUNT)
    return np.column_stack([*columns, rng.standard_normal(COUNT)]) * np.array([1.0, 5.0, 0.02])


def fit_of(white, low=-1e6, sd=np.inf):
    free = [FreeParameter(name, low, 1e6, value, sd, 1e-6) for name, value in zip(NAMES, VALUES, strict=True)]
    known = dict(zip(NAMES, VALUES.tolist(), strict=True))
    return SimpleNamespace(model=SimpleNamespace(value=known.get), free_parameters=free, white=white)


@pytest.mark.parametrize("level", [1.0, 3.0], ids=["as large as the noise says", "three times as large"])
@pytest.mark.parametrize("held", [(), ("second",)])
def test_draws_scatter_as_fits_to_other_data_do(slopes, level, held):
    rng = np.random.default_rng(2)
    moving = [i for i, name in enumerate(NAMES) if name not in held]
    errors = level * rng.standard_normal((COUNT, 4000))
    refitted = np.linalg.lstsq(slopes[:, moving], errors, rcond=None)[0]
    white = errors[:, 0] - slopes @ np.linalg.lstsq(slopes, errors[:, 0], rcond=None)[0]
    draws = drawn_values(fit_of(white), slopes, BLOCKS, 1.0, held, 4000)
    found = np.array([[draw[NAMES[i]] for i in moving] for draw in draws])
    assert all(set(draw) == {NAMES[i] for i in moving} for draw in draws)
    np.testing.assert_allclose(found.mean(axis=0), VALUES[moving], atol=0.1 * refitted.std(axis=1).max())
    # a standard error from 20 blocks is known to about a sixth, and is never less than that of the curvature
    np.testing.assert_allclose(found.std(axis=0), refitted.std(axis=1), rtol=0.35)
    np.testing.assert_allclose(np.corrcoef(found.T), np.corrcoef(refitted), atol=0.06)


def test_alone_they_are_as_wide_as_the_standard_errors(slopes):
    fit = fit_of(np.random.default_rng(3).standard_normal(COUNT))
    draws = drawn_values(fit, slopes, BLOCKS, 1.0, (), 4000)
    found = np.std([[draw[name] for name in NAMES] for draw in draws], axis=0)
    np.testing.assert_allclose(found, standard_errors(fit, slopes, BLOCKS), rtol=0.05)


def test_they_keep_within_bounds_and_are_the_same_each_time(slopes):
    fit = fit_of(np.random.default_rng(3).standard_normal(COUNT), low=-2.0)
    draws = [drawn_values(fit, slopes, BLOCKS, 1.0, (), 50) for _ in range(2)]
    assert draws[0] == draws[1]
    seconds = np.array([draw["second"] for draw in draws[0]])
    assert (seconds >= -2.0).all() and 10 < (seconds == -2.0).sum() < 40
