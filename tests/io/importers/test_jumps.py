"""Angles that jump: wraps and single faulty samples are said, and no motion of a correct log is."""

import numpy as np
import pytest

from twbal.core.errors import ConfigError
from twbal.io.importers.checks.all_checks import doubts
from twbal.io.importers.checks.doubt import DoubtKind, LogPart
from twbal.io.importers.checks.jumps import TILT, WHEEL, jumps, without_jumps
from twbal.io.importers.columns import Columns
from twbal.io.importers.mapping import mapping

TURN = 2 * np.pi


def ride(period, seconds=20.0):
    """Tilt and wheel angle of a robot that drives to and fro, with noise."""
    rng = np.random.default_rng(0)
    t = np.arange(0.0, seconds, period)
    tilt = 0.05 * np.sin(3 * t) + 0.02 * np.sin(11 * t) + 0.002 * rng.standard_normal(len(t))
    wheel = 12 * np.sin(0.9 * t) + 0.3 * np.sin(11 * t) + 0.002 * rng.standard_normal(len(t))
    return tilt, wheel


def part(tilt, wheel, period, sides=None):
    signals = {"time": period * np.arange(len(tilt)), "tilt": tilt, "wheel_angle": wheel}
    return LogPart(period, signals, np.sin(np.arange(len(tilt) - 1)), sides or {}, False, False, None)


def said(*args):
    return [doubt.sentence for doubt in without_jumps(part(*args))[0]]


@pytest.mark.parametrize("period", [0.005, 0.015, 1 / 30])
@pytest.mark.parametrize("range_of", [TURN, 2 * TURN, 65536 * TURN / 16384])
def test_a_wheel_angle_that_wraps_is_said_with_its_size_and_can_be_mended(period, range_of):
    tilt, wheel = ride(period)
    wrapped = (wheel + 3.0) % range_of
    (doubt,), rest = without_jumps(part(tilt, wrapped, period))
    count = int((np.abs(np.diff(wrapped)) > 0.5 * range_of).sum())
    assert doubt.kind is DoubtKind.JUMP and doubt.quantity == "wheel_angle"
    assert f"in {count} places" in doubt.sentence and "does it wrap round" in doubt.sentence
    assert np.abs(jumps(wrapped, period, WHEEL).sizes).max() == pytest.approx(range_of, rel=0.1)
    assert rest.signals["wheel_angle"] - rest.signals["wheel_angle"][0] == pytest.approx(
        wheel - wheel[0], abs=0.1 * count
    )


@pytest.mark.parametrize(("wraps", "size"), [(360.0, 180.0 / np.pi), (65536.0, 5000.0)])
def test_a_column_of_which_the_mapping_tells_the_range_is_unwrapped_also_where_samples_are_missing(wraps, size):
    tilt, wheel = ride(0.01)
    counted = (size * wheel + 0.4 * wraps) % wraps
    missing = np.arange(500, 503)
    counted[missing] = np.nan
    angle = {"from": ["l", "r"], "scale": [1.0 / size, -1.0 / size], "wraps": wraps}
    told = {"tilt": "tilt", "wheel_angle": angle, "command": "drive"}
    columns = np.column_stack([tilt, counted, (wraps - counted) % wraps, tilt])
    read = Columns(columns, np.arange(len(tilt)) + 1, np.arange(len(tilt)), "row", ())
    signals = mapping(told, [], 100.0, False, False, 0.0, 3).signals(read)
    there = np.isfinite(signals["wheel_angle"])
    assert np.flatnonzero(~there).tolist() == missing.tolist()
    for name in ("wheel_angle", "left wheel_angle", "right wheel_angle"):
        moved = signals[name][there] - signals[name][0]
        assert moved == pytest.approx((wheel - wheel[0])[there], abs=1e-9)


def test_a_range_that_cannot_be_is_refused():
    told = {"tilt": "tilt", "wheel_angle": {"from": "w", "wraps": -360}, "command": "drive"}
    with pytest.raises(ConfigError, match=r"`wraps` of wheel_angle is the range .* found -360"):
        mapping(told, [], 100.0, False, False, 0.0, 3)


def test_a_fast_wheel_that_wraps_every_few_samples_is_said():
    t = 0.015 * np.arange(800)
    speed = 67 * np.sin(0.5 * t) ** 2  # up to 1 rad within a sample
    (sentence,) = said(ride(0.015)[0][:800], np.cumsum(0.015 * speed) % TURN, 0.015)
    assert "wrap round" in sentence


def test_an_angle_that_is_set_to_zero_once_is_said_where_it_is():
    tilt, wheel = ride(0.01)
    wheel[700:] -= 40.0
    (sentence,) = said(tilt, wheel, 0.01)
    assert sentence.startswith("the wheel angle jumps by 40 rad at 7 s: ")


@pytest.mark.parametrize("period", [0.005, 0.02, 1 / 30])
@pytest.mark.parametrize("size", [0.5, -3.0])
def test_a_single_sample_of_the_tilt_that_is_off_is_said(period, size):
    tilt, wheel = ride(period)
    right = tilt.copy()
    tilt[300] += size
    (doubt,), rest = without_jumps(part(tilt, wheel, period))
    assert doubt.kind is DoubtKind.JUMP and doubt.quantity == "tilt"
    assert doubt.sentence.startswith("the tilt is ") and f"at {300 * period:.6g} s" in doubt.sentence
    assert rest.signals["tilt"] == pytest.approx(right, abs=0.02)


def test_single_samples_of_the_wheels_that_are_off_are_counted():
    tilt, wheel = ride(0.01)
    wheel[[200, 900, 1500]] += [60.0, -8.0, 3.0]
    (sentence,) = said(tilt, wheel, 0.01)
    assert "off its neighbours in 3 samples, such as at 2 s" in sentence


def test_the_wheel_that_wraps_is_named_where_there_are_two():
    tilt, wheel = ride(0.01)
    (sentence,) = said(tilt, 0.5 * (wheel + wheel % TURN), 0.01, {"wheel_angle": (wheel, wheel % TURN)})
    assert sentence.startswith("the right wheel's angle jumps by 6.")


def test_the_checks_say_a_jump_and_go_on_with_the_rest():
    tilt, wheel = ride(0.01)
    tilt[500] += 3.0
    kinds = [doubt.kind for doubt in doubts({}, part(tilt, wheel, 0.01))]
    assert kinds[0] is DoubtKind.JUMP and len(kinds) > 1


@pytest.mark.parametrize("period", [0.002, 0.01, 1 / 30, 0.1])
@pytest.mark.parametrize("tick", [0.0, np.radians(1), np.radians(5), TURN / 12, TURN / 4])
@pytest.mark.parametrize("speed", [0.05, 1.0, 5.0])
def test_nothing_is_said_of_coarse_encoders_and_slow_sampling_of_fast_wheels(period, tick, speed):
    tilt, wheel = ride(period)
    wheel = np.floor(speed * wheel / tick) * tick if tick else speed * wheel
    assert said(tilt, wheel, period) == []


@pytest.mark.parametrize("period", [0.005, 0.015, 1 / 30])
def test_nothing_is_said_of_a_fall_a_push_or_a_wheel_that_spins_up_and_stops(period):
    tilt, wheel = ride(period)
    t = period * np.arange(len(tilt))
    falling = np.clip(0.01 * np.exp(np.minimum(6 * np.maximum(t - 10, 0), 50)) - 0.01, 0, 1.5)
    pushed = 0.5 * np.maximum(t - 12, 0)  # the rate jumps
    spinning = np.where(t > 14, 60 * (t - 14 - 0.03 * (1 - np.exp(-(np.maximum(t, 14) - 14) / 0.03))), 0.0)
    stopped = np.where(t > 16, spinning[np.searchsorted(t, 16)], spinning)
    assert said(tilt + falling, wheel + pushed + stopped, period) == []


@pytest.mark.parametrize("period", [0.005, 1 / 30])
def test_nothing_is_said_of_rows_that_are_lost(period):
    tilt, wheel = ride(period)
    kept = np.flatnonzero(np.random.default_rng(1).random(len(tilt)) > 0.03)
    assert said(tilt[kept], wheel[kept], period) == []


def test_a_recording_of_a_few_samples_is_taken_as_it_is():
    assert not jumps(np.array([0.0, 0.0, 9.0, 0.0]), 0.01, TILT).sizes.any()
