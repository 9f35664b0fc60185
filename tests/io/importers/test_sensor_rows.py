"""Rows of tilt and wheels, on signals whose rows are known: random motion, a filter and an encoder made here."""

import numpy as np
import pytest

from twbal.io.importers.checks.doubt import DoubtKind, LogPart
from twbal.io.importers.checks.implausible_values import smooth_command_doubts
from twbal.io.importers.checks.sensor_rows import is_differenced, tilt_row_doubts, wheel_row_doubts

PERIOD, COUNT, TICK = 0.01, 2000, 0.01


def motion(seed):
    """Angle and rate of a random motion of 0.1 s memory."""
    rng = np.random.default_rng(seed)
    rate = np.convolve(rng.standard_normal(COUNT + 40), np.exp(-np.arange(41) / 10), mode="valid")
    return np.cumsum(PERIOD * rate), rate


def late(values):
    return np.concatenate([values[:1], values[:-1]])


def part(commands=None, **signals):
    given = np.random.default_rng(9).standard_normal(COUNT - 1) if commands is None else commands
    return LogPart(PERIOD, signals, given, {}, False, False, None)


def filtered(seed):
    """A gyro with noise, and the tilt that a complementary filter of 1 s makes of it."""
    rng = np.random.default_rng([seed, 1])
    angle, rate = motion(seed)
    gyro = rate + 0.1 * rng.standard_normal(COUNT)
    tilt = np.zeros(COUNT)
    for k in range(1, COUNT):
        tilt[k] = tilt[k - 1] + PERIOD * gyro[k]
        tilt[k] += PERIOD * (angle[k] + 0.01 * rng.standard_normal() - tilt[k])
    return tilt, gyro


@pytest.mark.parametrize("seed", range(5))
def test_a_filtered_tilt_in_its_row_is_right_and_one_of_the_row_before_is_late(seed):
    tilt, gyro = filtered(seed)
    wheel = motion(seed + 50)[0]
    assert list(tilt_row_doubts(part(tilt=tilt, tilt_rate=gyro, wheel_angle=wheel))) == []
    (doubt,) = tilt_row_doubts(part(tilt=late(tilt), tilt_rate=gyro, wheel_angle=wheel))
    assert doubt.kind is DoubtKind.ROW and doubt.quantity == "tilt" and "in a row (10 ms) late" in doubt.sentence


@pytest.mark.parametrize("seed", range(5))
def test_an_angle_that_is_measured_by_itself_is_right_in_its_row(seed):
    angle, rate = motion(seed)
    noise = np.random.default_rng([seed, 2]).standard_normal((2, COUNT))
    signals = {"tilt_rate": rate + 0.02 * noise[1], "wheel_angle": motion(seed + 50)[0]}
    assert all(
        doubt.kind is DoubtKind.UNTOLD for doubt in tilt_row_doubts(part(tilt=angle + 1e-4 * noise[0], **signals))
    )


def test_a_tilt_without_a_gyro_is_not_told():
    (doubt,) = tilt_row_doubts(part(tilt=motion(1)[0], wheel_angle=motion(2)[0]))
    assert doubt.kind is DoubtKind.UNTOLD and "no tilt_rate" in doubt.sentence


@pytest.mark.parametrize("window", [1, 2, 3])
def test_a_rate_of_ticks_tells_the_row_of_the_angle(window):
    ticks = np.floor(motion(3)[0] / TICK) * TICK
    rate = (ticks - np.concatenate([np.repeat(ticks[:1], window), ticks[:-window]])) / (window * PERIOD)
    right, wrong = part(wheel_angle=ticks, wheel_rate=rate), part(wheel_angle=late(ticks), wheel_rate=rate)
    assert is_differenced(right) and list(wheel_row_doubts(right)) == []
    (doubt,) = wheel_row_doubts(wrong)
    assert doubt.kind is DoubtKind.ROW and doubt.quantity == "wheel_angle"


def test_a_rate_that_is_measured_by_itself_tells_no_row():
    angle, rate = motion(4)
    told = part(wheel_angle=np.floor(angle / TICK) * TICK, wheel_rate=rate)
    assert not is_differenced(told) and list(wheel_row_doubts(told)) == []


def test_a_command_without_noise_is_doubted_only_where_the_sensors_have_some():
    angle, rate = motion(5)
    noise = np.random.default_rng(6).standard_normal(COUNT)
    slow = np.sin(2.0 * PERIOD * np.arange(COUNT - 1))
    noisy = {"tilt": angle, "tilt_rate": rate + 0.1 * noise}
    (doubt,) = smooth_command_doubts(part(slow, **noisy))
    assert doubt.kind is DoubtKind.COLUMN and doubt.quantity == "command"
    assert list(smooth_command_doubts(part(slow + 0.05 * noise[:-1], **noisy))) == []
    smooth = np.sin(3.0 * PERIOD * np.arange(COUNT))
    assert list(smooth_command_doubts(part(slow, tilt=smooth, tilt_rate=3.0 * np.cos(3.0 * smooth)))) == []
