from math import sqrt

import numpy as np
import pytest

from twbal.core.errors import ConfigError
from twbal.core.motion_limits import MotionLimits
from twbal.core.motion_profile import Motion, MotionProfile, Phase, profile_to_position, profile_to_speed

LIMITS = MotionLimits(speed=1.0, acceleration=0.5, jerk=2.0)


def random_chain(rng: np.random.Generator, length: int) -> tuple[MotionLimits, list[tuple[MotionProfile, float]]]:
    """Profiles to random speeds and places, each begun at a random time of the one before, with that time."""
    limits = MotionLimits(*np.exp(rng.uniform(-2.0, 2.0, 3)))
    motion, chain = Motion(), []
    for _ in range(length):
        if rng.random() < 0.5:
            profile = profile_to_speed(motion, rng.uniform(-1.5, 1.5) * limits.speed, limits)
        else:
            size = limits.speed**2 / limits.acceleration * rng.choice([0.01, 1.0, 5.0])
            profile = profile_to_position(motion, motion.position + size * rng.standard_normal(), limits)
        left = rng.uniform(0.0, 1.2) * profile.duration
        chain.append((profile, left))
        motion = profile.at(left)
    return limits, chain


@pytest.mark.parametrize("seed", range(10))
def test_random_wishes_that_change_at_any_time_keep_all_limits_and_never_jump(seed: int) -> None:
    rng = np.random.default_rng(seed)
    for _ in range(15):
        limits, chain = random_chain(rng, 5)
        for profile, left in chain:
            times = np.sort(rng.uniform(0.0, left + 1e-9, 20))
            moved = np.array([profile.at(time) for time in times])
            assert (np.abs(moved[:, 1:]) <= np.array([limits.speed, limits.acceleration]) * (1 + 1e-9)).all()
            steps = np.diff(times)
            # Between two samples nothing changes faster than its own limit allows.
            assert (np.abs(np.diff(moved[:, 0])) <= limits.speed * steps + 1e-9).all()
            assert (np.abs(np.diff(moved[:, 1])) <= limits.acceleration * steps + 1e-9).all()
            assert (np.abs(np.diff(moved[:, 2])) <= limits.jerk * steps + 1e-9).all()


def test_position_and_speed_are_integrals_of_what_is_below_them() -> None:
    for seed in range(6):
        _, chain = random_chain(np.random.default_rng(seed), 3)
        profile = chain[-1][0]
        times = np.linspace(0.0, 1.1 * profile.duration, 4_001)
        moved = np.array([profile.at(time) for time in times])
        for below, above in ((1, 0), (2, 1)):
            mean = 0.5 * (moved[1:, below] + moved[:-1, below])
            summed = moved[0, above] + np.cumsum(mean) * (times[1] - times[0])
            np.testing.assert_allclose(summed, moved[1:, above], atol=3e-4 * (1.0 + np.abs(moved[:, above]).max()))


@pytest.mark.parametrize("seed", range(5))
def test_random_wishes_are_met_without_acceleration_and_places_at_rest(seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    for _ in range(15):
        limits, chain = random_chain(rng, 4)
        start = chain[-1][0].at(chain[-1][1])
        speed, place = rng.uniform(-1.0, 1.0) * limits.speed, start.position + rng.standard_normal()
        reached = profile_to_speed(start, speed, limits).end
        assert reached.speed == pytest.approx(speed, abs=1e-9 * limits.speed)
        assert reached.acceleration == pytest.approx(0.0, abs=1e-9 * limits.acceleration)
        arrived = profile_to_position(start, place, limits).end
        np.testing.assert_allclose(arrived, [place, 0.0, 0.0], atol=1e-8)


def test_a_speed_from_rest_takes_as_long_as_the_trapezoid_of_its_acceleration() -> None:
    """Closed form: v / a + a / j where the acceleration's limit is met, else 2 sqrt(v / j)."""
    assert profile_to_speed(Motion(), 0.9, LIMITS).duration == pytest.approx(0.9 / 0.5 + 0.5 / 2.0)
    assert profile_to_speed(Motion(), -0.1, LIMITS).duration == pytest.approx(2 * sqrt(0.1 / 2.0))
    assert profile_to_speed(Motion(3.0, 0.4, 0.0), 0.4, LIMITS).duration == pytest.approx(0.0)


def test_a_place_from_rest_takes_the_time_of_the_closed_form() -> None:
    """Closed forms of rest-to-rest motion: all limits are met; no cruise; the jerk's alone, 4 (s / 2 j)^(1/3)."""
    all_met = 5.0 / 1.0 + 1.0 / 0.5 + 0.5 / 2.0
    assert profile_to_position(Motion(), 5.0, LIMITS).duration == pytest.approx(all_met)
    ramp, distance = 0.5 / 2.0, 1.0
    no_cruise = ramp + sqrt(ramp**2 + 4.0 * distance / 0.5)  # of s = v (v / a + a / j), T = 2 (v / a + a / j)
    assert profile_to_position(Motion(), -distance, LIMITS).duration == pytest.approx(no_cruise)
    assert profile_to_position(Motion(), 0.01, LIMITS).duration == pytest.approx(4 * (0.01 / (2 * 2.0)) ** (1 / 3))


def test_a_wish_repeated_on_the_way_changes_nothing() -> None:
    profile = profile_to_position(Motion(), 2.0, LIMITS)
    for time in np.linspace(0.0, profile.duration, 23):
        again = profile_to_position(profile.at(time), 2.0, LIMITS)
        for later in (0.1, 0.7, 3.0):
            np.testing.assert_allclose(again.at(later), profile.at(time + later), atol=1e-6)


def test_the_motion_goes_on_at_its_speed_after_the_last_phase() -> None:
    profile = MotionProfile(Motion(1.0, 2.0, 0.0), (Phase(0.5, 0.0),))
    assert profile.at(2.0) == Motion(5.0, 2.0, 0.0)


@pytest.mark.parametrize("wrong", [0.0, -1.0, float("inf"), float("nan")])
def test_limits_are_positive_and_finite(wrong: float) -> None:
    with pytest.raises(ConfigError, match=r"limit of its jerk; found"):
        MotionLimits(1.0, 1.0, wrong)
