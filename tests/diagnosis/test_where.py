"""The map of disagreement says where errors are, and which way."""

from itertools import pairwise

import numpy as np
import pytest

from twbal.diagnosis.where import regions

CHANNELS = ("tilt", "tilt_rate")


@pytest.fixture
def driven():
    """Errors of unit noise in tilt and 0.1 in tilt rate, over speeds and directions."""
    rng = np.random.default_rng(0)
    speed = rng.uniform(-2.0, 2.0, 4000)
    axes = {"speed": speed, "direction": np.sign(speed)}
    return rng.standard_normal((4000, 2)) * [1.0, 0.1], axes


def only(found, channel, axis):
    return [region for region in found if (region.channel, region.axis) == (channel, axis)]


def test_noise_alone_is_no_disagreement(driven):
    errors, axes = driven
    for region in regions(errors, np.array([1.0, 0.1]), axes, CHANNELS, bins=5):
        assert region.rms == pytest.approx(1.0, abs=0.1)
        assert abs(region.bias) < 0.15


def test_an_error_that_turns_with_the_direction_is_found_there_first_and_with_its_sign(driven):
    errors, axes = driven
    errors = errors + np.column_stack([np.zeros(4000), 0.3 * axes["direction"]])
    found = regions(errors, np.array([1.0, 0.1]), axes, CHANNELS, bins=5)
    assert found[0].channel == "tilt_rate"
    back, forth = sorted(only(found, "tilt_rate", "direction"), key=lambda region: region.low)
    assert (back.low, back.high, forth.low, forth.high) == (-1.0, 0.0, 0.0, 1.0)
    assert (back.bias, forth.bias) == pytest.approx((-3.0, 3.0), abs=0.1)
    assert forth.rms == pytest.approx(np.sqrt(10.0), rel=0.05)


def test_ranges_cover_all_samples_once(driven):
    errors, axes = driven
    found = only(regions(errors, np.ones(2), axes, CHANNELS, bins=7), "tilt", "speed")
    assert sum(region.samples for region in found) == 4000
    ends = sorted((region.low, region.high) for region in found)
    assert all(high == low for (_, high), (low, _) in pairwise(ends))


def test_ranges_with_hardly_a_sample_are_left_out():
    errors, values = np.ones((30, 1)), np.array([0.0] * 25 + [1.0] * 5)
    found = regions(errors, np.ones(1), {"direction": np.where(values > 0, 1.0, -1.0)}, ("tilt",), bins=4)
    assert [region.samples for region in found] == [25]
