"""An IMU that stands still ends a rollout; one that works, and encoders of wheels that stand, do not."""

import numpy as np
import pytest

from twbal.core.episode import Outcome
from twbal.core.motion_profile import Motion
from twbal.core.plant import Observation
from twbal.link.frozen_sensors import FrozenSensors


def ending_at(seen):
    """How the watch ends, and the time at which; None and None where it does not."""
    watch = FrozenSensors()
    for each in seen:
        if ending := watch(each, Motion(), None, 0.0):
            return ending, each.time
    return None, None


def seen(time, tilt, rate, wheel=0.0):
    return Observation(time, tilt, rate, 0.0, wheel, 0.0, 0.0)


@pytest.mark.parametrize(("period", "last"), [(0.005, 0.6), (0.02, 0.6), (0.05, 0.65), (0.1, 0.8)])
def test_a_frozen_imu_ends_the_rollout_after_100_ms_and_three_repetitions(period, last):
    times = np.arange(0.0, 1.0, period)
    frozen = [seen(t, 0.01 * min(t, 0.5), 0.1 * min(t, 0.5), wheel=t) for t in times.tolist()]
    ending, time = ending_at(frozen)
    assert ending.outcome is Outcome.LINK_LOST
    assert "0.005 rad, 0.05 rad/s" in ending.text and "Is the IMU connected" in ending.text
    assert time == pytest.approx(last)


@pytest.mark.parametrize("moves", ["tilt", "tilt_rate"])
def test_one_digit_that_changes_is_enough(moves):
    still = seen(0.0, 0.1, 0.2)
    samples = [
        still._replace(time=0.02 * k, **{moves: np.nextafter(getattr(still, moves), k % 2).item()}) for k in range(200)
    ]
    assert ending_at(samples) == (None, None)


def test_a_rollout_of_a_few_same_samples_goes_on():
    rng = np.random.default_rng(1)
    samples = [seen(0.02 * k, tilt, 0.0) for k, tilt in enumerate(np.repeat(rng.normal(size=40), 5).tolist())]
    assert ending_at(samples) == (None, None)
