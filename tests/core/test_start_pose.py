import numpy as np
import pytest

from twbal.core.errors import ConfigError
from twbal.core.start_pose import StartPose


def test_draws_have_the_stated_mean_and_spread():
    start = StartPose(-0.2, 0.03, 0.5, 0.1)
    rng = np.random.default_rng(0)
    draws = np.array([start.draw(rng) for _ in range(4000)])
    sd = np.array([0.03, 0.5, 0.1])
    assert np.all(np.abs(draws.mean(0) - [-0.2, 0, 0]) < 4 * sd / np.sqrt(4000))
    np.testing.assert_allclose(draws.std(0), sd, rtol=0.06)


def test_without_spread_the_start_is_the_mean():
    assert StartPose(0.1, 0, 0, 0).draw(np.random.default_rng(1)) == (0.1, 0.0, 0.0)


@pytest.mark.parametrize("values", [(-10, 0, 0, 0), (0, -0.1, 0, 0), (0, 0, float("nan"), 0)])
def test_an_impossible_start_is_refused(values):
    with pytest.raises(ConfigError, match="found"):
        StartPose(*values)
