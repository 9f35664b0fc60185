"""What the sensors make of the motion."""

import numpy as np
import pytest

from twbal.virtual_robot.ground_truth import Noise

G = 9.81


def driven(robot, periods=60):
    """Observations, true motions, and mean wheel angles of a robot that is pulled to and fro."""
    seen, true, angles = [robot.reset(0)], [robot.true_motion], [robot.wheel_angles.mean()]
    for k in range(periods):
        seen.append(robot.step(60 * robot.true_motion.tilt + 12 * robot.true_motion.tilt_rate + np.sin(k / 3)))
        true.append(robot.true_motion)
        angles.append(robot.wheel_angles.mean())
    return np.array(seen), np.array(true), np.array(angles)


def test_ideal_sensors_tell_the_truth(make):
    seen, true, angles = driven(make(start=-0.1))
    time, tilt, tilt_rate, acceleration, angle, rate, yaw_rate = seen.T
    np.testing.assert_allclose(time, 0.02 * np.arange(61))
    np.testing.assert_array_equal(tilt, true[:, 0])
    np.testing.assert_array_equal(tilt_rate, true[:, 1])
    np.testing.assert_array_equal(yaw_rate, true[:, 3])
    np.testing.assert_array_equal(angle, angles)
    np.testing.assert_allclose(acceleration[1:], np.diff(true[:, 4]) / 0.02, atol=1e-12)
    np.testing.assert_allclose(0.15 * (rate + tilt_rate), true[:, 4], atol=2e-3)  # wheels roll


def test_encoders_show_whole_ticks_and_rates_count_them_over_the_window(make):
    unit = 2 * np.pi / 780
    for window in (0.02, 0.01):
        seen, _, angles = driven(make(start=-0.1, sensors={"ticks": 780, "rate_window": window}))
        ticks = seen[:, 4] / (0.5 * unit)  # the mean of two
        np.testing.assert_allclose(ticks, np.round(ticks), atol=1e-9)
        assert np.abs(seen[:, 4] - angles).max() <= unit
        counts = seen[:, 5] * window / (0.5 * unit)
        np.testing.assert_allclose(counts, np.round(counts), atol=1e-9)
        exact = driven(make(start=-0.1))[0][:, 5]
        assert np.abs(seen[:, 5] - exact).max() < unit / window + np.abs(np.diff(exact)).max()
    full = driven(make(start=-0.1, sensors={"ticks": 780, "rate_window": 0.02}))[0]
    np.testing.assert_allclose(np.diff(full[:, 4]) / 0.02, full[1:, 5], atol=1e-9)


def test_a_mounting_angle_is_added_and_moves_nothing(make):
    plain, true, _ = driven(make(start=-0.1))
    seen, same, _ = driven(make(start=-0.1, sensors={"mounting_angle": 0.02}))
    np.testing.assert_array_equal(true, same)
    np.testing.assert_allclose(seen[:, 1] - plain[:, 1], 0.02, atol=1e-12)


@pytest.mark.slow
def test_a_gyro_bias_is_seen_in_the_rate_and_walks_as_it_says(make):
    plain = driven(make(start=-0.1))[0]
    biased = driven(make(start=-0.1, sensors={"gyro_bias": 0.01}))[0]
    np.testing.assert_allclose(biased[:, 2] - plain[:, 2], 0.01, atol=1e-12)
    ends = []
    robot = make(start=-0.1, sensors={"gyro_walk": 0.1})
    for trial in range(150):
        robot.reset(trial)
        for _ in range(25):
            robot.step(0.0)
        ends.append(robot._readout.bias)
    assert np.std(ends) == pytest.approx(0.1 * np.sqrt(0.5), rel=0.2)


def test_a_low_pass_lags_by_its_time_constant(make):
    constant = 0.01
    robot, plain = make(start=-0.05, sensors={"filter_time": constant}), make(start=-0.05)
    for one in (robot, plain):
        one.reset(0)
        for _ in range(20):  # falls as an exponential of 5 /s, nearly
            last = one.step(0.0)
        one.last = last
    late = plain.last.tilt - robot.last.tilt
    assert late == pytest.approx(constant * plain.last.tilt_rate, rel=0.08)


def test_a_complementary_filter_shows_bias_times_its_time_constant_at_rest(make):
    robot = make(sensors={"fusion_time": 2.0, "gyro_bias": 0.003})
    assert robot.reset(0).tilt == pytest.approx(0.006)
    for _ in range(10):
        last = robot.step(0.0)
    assert last.tilt == pytest.approx(0.006, abs=1e-5)


def test_a_complementary_filter_takes_speeding_up_for_leaning_back(make):
    constant = 1.0
    seen, true, _ = driven(make(start=-0.1, sensors={"fusion_time": constant}), periods=100)
    accelerations = np.diff(true[:, 4]) / 0.02
    error = [0.0]
    for acceleration in accelerations:  # error' = -(arctan(a / g) + error) / T
        error.append(error[-1] - 0.02 / constant * (np.arctan(acceleration / G) + error[-1]))
    np.testing.assert_allclose(seen[:, 1] - true[:, 0], error, atol=2e-3)
    assert np.ptp(error) > 0.01


def test_noise_is_as_large_as_it_says_and_moves_nothing(make):
    exact, true, _ = driven(make(start=-0.1), periods=300)
    sd = Noise(0.004, 0.02, 0.3, 0.001, 0.05, 0.01)
    robot = make(start=-0.1, sensors={"noise": sd})
    seen, same, _ = driven(robot, periods=300)
    np.testing.assert_array_equal(true, same)
    spread = (seen - exact).std(0)
    np.testing.assert_allclose(spread, [0.0, 0.004, 0.02, 0.3, 0.001, 0.05, 0.01], rtol=0.15)
