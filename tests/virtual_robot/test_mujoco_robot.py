"""The robot behind the interface `Plant`."""

import time
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from analytic import linear
from conftest import CONF

from twbal.core.errors import ConfigError
from twbal.core.start_pose import StartPose
from twbal.virtual_robot.mujoco_robot import MujocoRobot

SHEETS = sorted(path.stem for path in (CONF / "robot").glob("*.yaml"))
START = StartPose(-0.05, 0.02, 0.05, 0.02)


def balanced(robot, seconds, trial=0):
    """Largest |tilt| [rad] under the LQR of the truth, and the last pose."""
    model = linear(robot.truth)
    gain = model.gain(robot.control_period, robot.truth.drive.torque_limit)
    seen, widest = robot.reset(trial), 0.0
    for _ in range(round(seconds / robot.control_period)):
        speed = model.radius * (seen.wheel_rate + seen.tilt_rate)
        seen = robot.step(float(-gain @ [seen.tilt, seen.tilt_rate, speed]))
        widest = max(widest, abs(robot.pose().tilt))
        if widest > 1.0:
            break
    return widest, robot.pose()


@pytest.mark.parametrize("faults", ["none", "moderate", "hard"])
def test_one_seed_and_trial_is_the_same_bytes(faults, make):
    def record(robot, trial):
        rows = [robot.reset(trial)] + [robot.step(3 * np.sin(k)) for k in range(50)]
        return np.array(rows).tobytes() + np.array(robot.pose()).tobytes()

    robot = make(faults=faults, seed=5, start=START)
    first, other, again = record(robot, 0), record(robot, 1), record(robot, 0)
    assert first == again == record(make(faults=faults, seed=5, start=START), 0)
    assert first != other != record(make(faults=faults, seed=6, start=START), 1)


@pytest.mark.parametrize("sheet", SHEETS)
def test_every_data_sheet_stands_ten_seconds_under_its_lqr(sheet, make):
    robot = make(sheet, start=START)
    widest, pose = balanced(robot, 10.0)
    assert widest < 0.3
    assert abs(pose.tilt + robot.truth.body.com_offset) < 0.005


@pytest.mark.slow
def test_most_moderate_robots_stand_ten_seconds_under_the_lqr_of_their_truth(make):
    """It knows nothing of friction, dead zones and delays; a balboa's are large beside its small weight."""
    robots = [make(sheet, "moderate", seed, START) for sheet in SHEETS for seed in range(6)]
    standing = [balanced(robot, 10.0)[0] < 0.6 for robot in robots]
    assert sum(standing) >= 0.8 * len(standing)


def test_the_start_is_that_of_its_distribution(make):
    robot = make(start=StartPose(-0.17, 0.02, 0.05, 0.3))
    starts = []
    for trial in range(200):
        seen = robot.reset(trial)
        starts.append([seen.tilt, seen.tilt_rate, robot.true_motion.speed, 0.15 * (seen.wheel_rate + seen.tilt_rate)])
    mean, sd = np.mean(starts, 0), np.std(starts, 0)
    np.testing.assert_allclose(mean, [-0.17, 0, 0, 0], atol=0.05)
    np.testing.assert_allclose(sd, [0.02, 0.05, 0.3, 0.3], rtol=0.2)
    assert robot.pose()[:3] == (0.0, 0.0, 0.0)


def test_the_true_pose_is_where_the_wheels_have_brought_it(make):
    robot = make(start=-0.1, sensors={"mounting_angle": 0.1})
    robot.reset(0)
    for _ in range(20):
        seen = robot.step(0.0)
    assert robot.pose().tilt == pytest.approx(seen.tilt - 0.1)
    assert robot.pose().x == pytest.approx(0.15 * (seen.wheel_angle + robot.pose().tilt + 0.1), rel=1e-3)


def test_commands_are_cut_at_the_torque_limit(make):
    def after(command):
        robot = make()
        robot.reset(0)
        return robot.step(command)

    assert after(20.0) == after(500.0) != after(19.0)


@pytest.mark.slow
def test_ten_seconds_cost_little(make):
    for faults in ("none", "moderate", "hard"):
        robot = make(faults=faults, seed=3, start=START)
        begun = time.process_time()
        balanced(robot, 10.0)
        assert time.process_time() - begun < 1.2  # 0.2 to 0.4 on an idle core


# Turning


@pytest.mark.parametrize("sheet", SHEETS)
def test_a_difference_of_the_torques_turns_it_as_rigid_bodies_on_rolling_wheels_do(sheet, make):
    """Work of both torques is the kinetic energy of body and wheels about the vertical; a positive one turns left."""
    robot = make(sheet)
    body = robot.truth.body
    robot.reset(0)
    difference = 0.02 * robot.truth.drive.torque_limit
    robot.steer(difference)
    for _ in range(3):
        robot.step(0.0)
    radius, lever = sum(body.wheel_radius) / 2.0, 0.5 * body.track
    across = 0.5 * body.wheel_inertia + body.wheel_mass * body.wheel_width**2 / 12.0
    inertia = body.inertia[2] + 2.0 * (across + body.wheel_mass * lever**2)
    inertia += 2.0 * (body.wheel_inertia + body.rotor_inertia) * (lever / radius) ** 2
    expected = difference * lever / radius / inertia * 3.0 * robot.control_period
    assert robot.true_motion.yaw_rate == pytest.approx(expected, rel=0.05)
    assert robot.pose().heading > 0.0


def test_both_encoders_tell_the_turn(make):
    robot = make(sensors={"ticks": 4096.0, "rate_window": 0.01})
    body = robot.truth.body
    robot.reset(0)
    robot.steer(1.0)
    for _ in range(20):
        robot.step(0.0)
    apart, truly = robot.wheel_difference(), np.diff(robot.wheel_angles)[0]
    assert apart.angle == pytest.approx(truly, abs=2 * 2 * np.pi / 4096)
    assert body.wheel_radius[0] / body.track * apart.angle == pytest.approx(robot.pose().heading, rel=0.02)
    assert apart.rate == pytest.approx(body.track / body.wheel_radius[0] * robot.true_motion.yaw_rate, rel=0.2)


def test_noise_of_the_encoders_is_twice_as_large_in_their_difference_as_in_their_mean(make):
    robot = make()
    noise = replace(robot.truth.sensors.noise, wheel_angle=0.01, wheel_rate=0.1)
    robot = make(sensors={"noise": noise})
    robot.reset(0)
    seen = []
    for _ in range(2000):
        robot.step(0.0)
        apart = robot.wheel_difference()
        seen.append((apart.angle - np.diff(robot.wheel_angles)[0], apart.rate))
        if abs(robot.true_motion.tilt) > 0.3:
            robot.reset(len(seen))
    assert np.std(seen, axis=0) == pytest.approx([0.02, 0.2], rel=0.1)


def test_a_new_rollout_begins_without_a_difference(make):
    robot = make()
    robot.reset(0)
    robot.steer(5.0)
    robot.step(0.0)
    robot.reset(1)
    for _ in range(5):
        robot.step(0.0)
    assert robot.pose().heading == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("parts", [(0.0031, 0.0125), (0.02,), (0.00025, 0.0005, 0.0199)])
def test_a_period_that_is_driven_in_parts_is_the_same_bytes(parts, make):
    def record(robot, parts):
        rows = [robot.reset(1)]
        for k in range(40):
            robot.steer(0.5 * np.cos(k))
            for until in parts:
                robot.drive_until(until, 3 * np.sin(k))
            rows.append(robot.step(3 * np.sin(k)))
        return np.array(rows).tobytes() + np.array(robot.pose()).tobytes()

    robot = make(faults="hard", seed=5, start=START)
    assert record(robot, parts) == record(robot, ())


@pytest.mark.parametrize("delay", [0.0, 0.0071, 0.03])
def test_a_command_that_comes_within_a_period_acts_from_then_on_and_after_the_delay(delay, make):
    robot, given, time = make(drive={"delay": delay}), [2.0, -1.0, 0.5, 3.0, 0.0, 0.0, 0.0], 0.0075
    robot.reset(0)
    torque = []  # of both motors in each physics step
    for before, now in pairwise([0.0, *given]):  # `before` goes on until `time`
        for step in range(1, 81):
            until = step * 0.00025
            robot.drive_until(until, before if until <= time else now)
            torque.append(robot._memory.torque.sum())
        robot.step(now)
    middle = (np.arange(len(torque)) + 0.5) * 0.00025 - delay - time
    expected = np.where(middle < 0, 0.0, np.array(given)[np.maximum(middle // 0.02, 0).astype(int)])
    assert np.mean(~np.isclose(torque, expected)) <= len(given) / len(torque)  # but for steps in which it changes


@pytest.mark.parametrize("delay", [0.0, 0.0071, 0.025, 0.0433])
def test_each_of_many_commands_within_a_period_acts_after_the_delay(delay, make):
    robot, rng = make(drive={"delay": delay}), np.random.default_rng(1)
    robot.reset(0)
    given, torque = [], []  # in each physics step
    for _ in range(12):
        parts = rng.integers(0, 12, 80 // 5).repeat(5)[:80]  # some last longer than others
        for step, part in enumerate(parts, 1):
            robot.steer(0.1 * part)
            robot.drive_until(step * 0.00025, float(part))
            given.append((part, 0.1 * part))
            torque.append((robot._memory.torque.sum(), robot._memory.torque[1] - robot._memory.torque[0]))
        robot.step(float(part))
    middle = ((np.arange(len(torque)) + 0.5) * 0.00025 - delay) / 0.00025
    expected = np.where(middle[:, None] < 0, 0.0, np.array(given)[np.maximum(middle, 0).astype(int)])
    is_steady = np.all(expected == np.roll(expected, 1, axis=0), axis=1)  # but for steps in which it changes
    assert is_steady.sum() > 700
    np.testing.assert_allclose(np.array(torque)[is_steady], expected[is_steady], atol=1e-9)


def test_the_acceleration_of_a_period_in_parts_is_that_of_the_whole(make):
    robot = make(start=START)
    before, seen = robot.reset(0), None
    robot.drive_until(0.015, 4.0)
    seen = robot.step(4.0)
    speeds = [0.15 * (each.wheel_rate + each.tilt_rate) for each in (before, seen)]
    assert seen.acceleration == pytest.approx((speeds[1] - speeds[0]) / 0.02, rel=0.02)


@pytest.mark.parametrize(("period", "bound", "used"), [(0.0166667, 0.00025, 0.0166667 / 67), (0.00025, 0.001, 0.00025)])
def test_the_physics_step_is_an_upper_bound(period, bound, used, make):
    """What falls under gravity alone for some control periods is where the same robot is at the step that divides."""

    def after(physics_step):
        settings = {"truth": make().truth, "start": START, "seed": 0}
        robot = MujocoRobot(control_period=period, physics_step=physics_step, **settings)
        robot.reset(0)
        seen = [robot.step(0.0) for _ in range(5)]
        assert robot._model.opt.timestep == pytest.approx(used)
        assert robot._data.time == pytest.approx(5 * period)
        return seen[-1]

    assert after(bound) == after(used)


@pytest.mark.parametrize("step", [0.0, -0.001, float("nan")])
def test_a_physics_step_that_is_none_is_refused(step, make):
    with pytest.raises(ConfigError, match="must be positive"):
        make(physics_step=step)
