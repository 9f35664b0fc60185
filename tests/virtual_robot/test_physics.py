"""The robot moves as equations say that are derived here, by hand."""

import numpy as np
import pytest
from analytic import G, energy, linear

from twbal.core.mobility import com_speed_ratio

SHEETS = ("balboa", "esp32", "lego", "paper", "regbot", "tumbller", "upkie")


def moved(robot, seconds, command=lambda t: 0.0):
    """Pose, motion and wheel angles at each control period, from the start on."""
    robot.reset(0)
    rows = [(robot.pose(), robot.true_motion, robot.wheel_angles)]
    for k in range(round(seconds / robot.control_period)):
        robot.step(command(k * robot.control_period))
        rows.append((robot.pose(), robot.true_motion, robot.wheel_angles))
    return rows


@pytest.mark.parametrize("sheet", SHEETS)
@pytest.mark.parametrize("share", [0.0, 0.7])
def test_an_uncontrolled_robot_falls_as_the_analytic_exponential(sheet, share, make):
    body = make(sheet).truth.body
    split = {"wheel_inertia": (1 - share) * body.wheel_inertia, "rotor_inertia": share * body.wheel_inertia}
    robot = make(sheet, start=1e-3 - body.com_offset, body=split)
    pole = linear(robot.truth).pole
    rows = moved(robot, 3.0 / pole)
    time = robot.control_period * (len(rows) - 1)
    growth = np.arccosh((rows[-1][1].tilt + body.com_offset) / 1e-3) / time
    assert growth == pytest.approx(pole, rel=0.01)
    assert rows[-1][1].tilt_rate == pytest.approx(1e-3 * pole * np.sinh(pole * time), rel=0.02)


@pytest.mark.parametrize("sheet", SHEETS)
@pytest.mark.parametrize("pull", [0.0, 0.1], ids=["falling", "driven"])
def test_wheels_roll_to_a_thousandth_of_their_path(sheet, pull, make):
    robot = make(sheet, start=0.15)
    body, radius = robot.truth.body, robot.truth.body.wheel_radius[0]
    torque = pull * (body.mass + 2 * body.wheel_mass) * G * radius  # tyres hold up to a pull of 1
    rows = moved(robot, 2.0 / linear(robot.truth).pole, lambda t: torque)
    x = np.array([pose.x for pose, *_ in rows])
    turned = np.array([motion.tilt + angles for _, motion, angles in rows])
    path = np.abs(np.diff(x)).sum()
    assert path > 0.05 * radius
    np.testing.assert_allclose(radius * (turned - turned[0]), np.stack([x, x], 1), atol=1e-3 * path)


def test_a_torque_moves_body_and_wheels_apart_as_the_analytic_equations_say(make):
    robot = make("paper")
    k, torque = linear(robot.truth), 2.0
    rows = moved(robot, 0.02, lambda t: torque)
    acceleration, tilting = np.linalg.solve([[k.a, k.b], [k.b, k.c]], [torque / k.radius, -torque])
    assert rows[-1][1].speed / 0.02 == pytest.approx(acceleration, rel=0.01)
    assert rows[-1][1].tilt_rate / 0.02 == pytest.approx(tilting, rel=0.01)


def test_on_a_slope_an_upright_robot_rolls_down_as_the_analytic_equations_say(make):
    slope = 0.05
    robot = make("paper", surroundings={"slope": slope})
    body, k = robot.truth.body, linear(robot.truth)
    rows = moved(robot, 0.02)
    weight = (body.mass + 2 * body.wheel_mass) * G
    across = k.b * np.cos(slope)
    assert rows[-1][1].speed / 0.02 == pytest.approx(-weight * np.sin(slope) / (k.a - across**2 / k.c), rel=0.01)
    assert rows[0][1].tilt == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("sheet", SHEETS)
def test_energy_stays_where_nothing_rubs_and_goes_where_something_does(sheet, make):
    def levels(robot):
        falling = [motion for _, motion, _ in moved(robot, 3.0)]
        stop = np.argmax(np.abs([m.tilt for m in falling]) > 1.0)  # further on, light wheels leave the ground
        assert stop > 0
        return [energy(robot.truth, m.tilt, m.tilt_rate, m.speed) for m in falling[:stop]]

    free = make(sheet, start=0.3)
    scale, limit = linear(free.truth).mgl, free.truth.drive.torque_limit
    kept = levels(free)
    np.testing.assert_allclose(kept, kept[0], atol=1e-3 * scale)
    friction = {"coulomb": 0.01 * limit, "static": 0.015 * limit, "bristle_stiffness": 10.0 * limit}
    lost = levels(make(sheet, start=0.3, friction=friction, drive={"viscous": 0.001 * limit}))
    assert np.diff(lost).max() < 1e-4 * scale
    assert lost[-1] < lost[0] - 5e-4 * scale


def test_an_eccentric_wheel_lifts_its_axle_by_as_much(make):
    robot = make("paper", start=0.1, body={"eccentricity": 0.002, "eccentric_phase": (0.0, 0.0)})
    robot.reset(0)
    heights, angles = [], []
    for _ in range(60):
        robot.step(0.0)
        heights.append(robot._data.qpos[2])
        angles.append(robot.wheel_angles[0] + robot.true_motion.tilt)
    np.testing.assert_allclose(heights, 0.15 - 0.002 * np.cos(angles), atol=1e-4)
    assert np.ptp(heights) > 0.002


def test_a_push_at_the_axle_moves_it_as_the_analytic_equations_say(make):
    robot = make("paper")
    k = linear(robot.truth)
    robot.reset(0)
    robot.push = 5.0
    robot.step(0.0)
    acceleration, tilting = np.linalg.solve([[k.a, k.b], [k.b, k.c]], [5.0, 0.0])
    assert robot.true_motion.speed / 0.02 == pytest.approx(acceleration, rel=0.01)
    assert robot.true_motion.tilt_rate / 0.02 == pytest.approx(tilting, rel=0.01)
    robot.reset(0)
    assert robot.push == 0.0


@pytest.mark.parametrize("sheet", SHEETS)
def test_a_push_at_the_axle_takes_the_centre_of_mass_along_as_the_sheet_tells(sheet, make, conf):
    robot = make(sheet, start=-conf(f"robot/{sheet}").com_offset)
    body = robot.truth.body
    robot.reset(0)
    robot.push = 0.2 * G * body.mass  # tyres hold
    robot.step(0.0)
    motion = robot.true_motion
    carried = 1.0 + body.com_height * motion.tilt_rate / motion.speed
    assert carried == pytest.approx(com_speed_ratio(conf(f"robot/{sheet}")), abs=0.02)


def test_unequal_motors_turn_it_and_scrubbing_tyres_hold_it(make):
    turned = {}
    for scrub in (0.0, 1.0):
        robot = make("paper", drive={"gain": (1.1, 0.9)}, surroundings={"scrub": scrub})
        turned[scrub] = moved(robot, 0.06, lambda t: 4.0)[-1][0].heading
    body = robot.truth.body
    across = 0.5 * body.wheel_inertia + body.wheel_mass * body.wheel_width**2 / 12
    half = 0.5 * body.track
    inertia = body.inertia[2] + 2 * (
        across + (body.wheel_mass + body.wheel_inertia / body.wheel_radius[0] ** 2) * half**2
    )
    difference = 4.0 * 0.1  # N·m, the left motor's torque less the right one's
    assert turned[0.0] == pytest.approx(-0.5 * difference / body.wheel_radius[0] * half / inertia * 0.06**2, rel=0.01)
    assert -0.9 * abs(turned[0.0]) < turned[1.0] < 0.0


def test_air_slows_a_rolling_robot_by_the_square_of_its_speed(make):
    losses = []
    for speed in (1.0, 2.0):
        start = make("paper")._start
        free, dragged = (make("paper", start=start, surroundings={"drag": drag}) for drag in (0.0, 1.0))
        ends = []
        for robot in (free, dragged):
            robot.reset(0)
            robot._data.qvel[0] = speed
            robot._data.qvel[6:8] = speed / 0.15
            for _ in range(2):
                robot.step(0.0)
            ends.append(robot.true_motion.speed)
        losses.append(ends[0] - ends[1])
    assert losses[1] / losses[0] == pytest.approx(4.0, rel=0.02)
