"""The tilt filter against its differential equation, solved by scipy, and the two engines against each other."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from twbal.core.plant import Observation
from twbal.core.robot_parameters import GRAVITY
from twbal.core.start_pose import StartPose
from twbal.effects.actuation_delay import ActuationDelay
from twbal.effects.gyro_bias import GyroBias
from twbal.effects.gyro_scale import GyroScale
from twbal.effects.imu_delay import ImuDelay
from twbal.effects.tilt_filter import TiltFilter
from twbal.planar.planar_plant import PlanarPlant
from twbal.sim.bullet_plant import SimPlant

PERIOD, LEAD, HEIGHT = 0.02, -0.03, 0.5


def motion(t):
    """Speed of the axle, tilt and tilt rate of a robot that goes to and fro."""
    return 2.0 * np.sin(2.0 * t), 0.3 * np.cos(4.0 * t), -1.2 * np.sin(4.0 * t)


GYROS = {"a perfect gyro": (1.0, 0.0), "a scaled gyro": (1.2, 0.0), "a scaled gyro with a bias": (0.9, 0.03)}


@pytest.mark.parametrize("gyro", GYROS)
@pytest.mark.parametrize("rate", [0.2, 1.0, 5.0])
def test_it_follows_its_differential_equation(paper, rate, gyro):
    """The direction is that of an accelerometer half a metre above the axle, which feels all that the body does."""
    (scale, bias), wave = GYROS[gyro], 4.0

    def slope(t, e):
        _, tilt, tilt_rate = motion(t)
        bend = -(wave**2) * tilt
        ahead = 4.0 * np.cos(2.0 * t) + HEIGHT * (bend * np.cos(tilt) - tilt_rate**2 * np.sin(tilt))
        above = GRAVITY - HEIGHT * (bend * np.sin(tilt) + tilt_rate**2 * np.cos(tilt))
        wrong = (scale - 1.0) * tilt_rate + bias
        return -rate * (np.arctan2(ahead, above) + e) + 0.5 * PERIOD * bend + wrong

    times = PERIOD * np.arange(500)
    exact = solve_ivp(slope, (0.0, 10.0), [0.0], t_eval=times, rtol=1e-9, atol=1e-12).y[0]
    shown, before = [], motion(0.0)[0]
    effect = TiltFilter(rate, 0.5 * PERIOD - rate * HEIGHT / GRAVITY)
    filtered = effect.on(paper, [GyroScale(scale), GyroBias(bias)]).start(PERIOD, np.random.default_rng(0))
    for time in times:
        speed, tilt, tilt_rate = motion(time)
        truth = Observation(time, tilt, tilt_rate, (speed - before) / PERIOD, 0.0, 0.0, 0.0)
        shown.append(filtered(truth).tilt - tilt)
        before = speed
    assert np.abs(exact).max() > 0.008
    np.testing.assert_allclose(shown, exact, atol=0.01 * np.abs(exact).max())


def test_it_shows_what_firmware_makes_of_readings_at_the_ends_of_its_periods(paper):
    """Whatever the tilt did in between: the sum of the gyro's readings, of which an accelerometer takes a little."""
    rng, rate = np.random.default_rng(1), 0.2
    tilts, rates = 0.1 * rng.standard_normal((2, 30))
    filtered = TiltFilter(rate, 0.5 * PERIOD).on(paper, []).start(PERIOD, rng)
    shown = [filtered(Observation(0.0, *each, 0.0, 0.0, 0.0, 0.0)).tilt for each in zip(tilts, rates, strict=True)]
    share, expected = rate * PERIOD, [tilts[0]]
    for tilt, tilt_rate in zip(tilts[1:], rates[1:], strict=True):
        expected.append((1.0 - share) * (expected[-1] + PERIOD * tilt_rate) + share * tilt)
    np.testing.assert_allclose(shown, expected, atol=0.05 * np.ptp(expected))


@pytest.mark.parametrize("late", [0.005, 0.01, 0.0135, 0.03])
def test_the_filter_of_a_late_imu_adds_up_late_readings(paper, late):
    """Torques that change once a period bend the tilt rate between late readings, whose sum does not see that.

    The planar robot without sensors tells its motion at each physics step. Late readings of it are added up here, and
    beside that the turns between them. A sum that sees all would differ from the filter's by a random walk.
    """
    steps, step, rate = 40, PERIOD / 40, 0.2
    drawn, start = np.random.default_rng(2).standard_normal(200), StartPose(0.0, 0.0, 0.0, 0.0)
    settings = {"start": start, "physics_step": step, "seed": 0}
    fine, commands = PlanarPlant(robot=replace(paper, control_period=step), effects=[], **settings), []
    rows = [fine.reset(0)]
    for each in drawn:  # pushed about, and held upright
        seen = rows[-1]
        speed = paper.wheel_radius * (seen.wheel_rate + seen.tilt_rate)
        commands.append(float(0.5 * each + 80.0 * seen.tilt + 14.0 * seen.tilt_rate + 6.0 * speed))
        rows += [fine.step(commands[-1]) for _ in range(steps)]
    motion = np.array(rows)
    at = np.maximum(steps * np.arange(len(commands) + 1) - round(late / step), 0)
    tilt, tilt_rate = motion[at, 1], motion[at, 2]
    forward = np.diff(paper.wheel_radius * (motion[at, 5] + tilt_rate)) / PERIOD
    lean = tilt[1:] - np.arctan2(forward, GRAVITY)
    turns = np.diff(tilt) + 0.5 * PERIOD * np.diff(tilt_rate)
    share, of_readings, of_turns = rate * PERIOD / (1.0 + rate * PERIOD), [tilt[0]], [tilt[0]]
    for n, turned in enumerate(turns):
        for shown, by in ((of_readings, PERIOD * tilt_rate[n + 1]), (of_turns, turned)):
            shown.append((1.0 - share) * (shown[-1] + by) + share * lean[n])
    filters = [TiltFilter(np.log1p(rate * PERIOD) / PERIOD, 0.5 * PERIOD), ImuDelay(late)]
    with PlanarPlant(robot=paper, effects=filters, **settings) as plant:
        found = np.array([plant.reset(0).tilt, *(plant.step(u).tilt for u in commands)])
    assert np.std(found - of_readings) < 0.2 * np.std(found - of_turns)


def test_a_filter_that_never_follows_the_accelerometer_shows_the_truth():
    filtered = TiltFilter(0.0, 0.0).start(PERIOD, np.random.default_rng(0))
    assert [filtered(Observation(0.0, 0.1, 1.0, 5.0, 0.0, 0.0, 0.0)).tilt for _ in range(9)] == [0.1] * 9


@pytest.mark.parametrize("gyro", GYROS)
@pytest.mark.parametrize("which", ["paper", "regbot"])
def test_both_engines_show_the_same(request, which, gyro):
    robot, start = request.getfixturevalue(which), StartPose(-0.1, 0.0, 0.2, 0.0)
    rng = np.random.default_rng(0)
    commands = 0.3 * robot.torque_limit * rng.standard_normal(12)
    scale, bias = GYROS[gyro]
    shown = {}
    for rate in (0.0, 2.0):
        for kind in (PlanarPlant, SimPlant):
            filters = [TiltFilter(rate, LEAD), GyroScale(scale), GyroBias(bias), ActuationDelay(0.007)]
            with kind(robot=robot, effects=filters, start=start, physics_step=0.0005, seed=0) as plant:
                plant.reset(0)
                shown[rate, kind] = np.array([plant.step(command).tilt for command in commands])
    planar, engine = (shown[2.0, kind] - shown[0.0, kind] for kind in (PlanarPlant, SimPlant))
    assert np.abs(engine).max() > 0.01
    np.testing.assert_allclose(planar, engine, atol=0.03 * np.abs(engine).max())
