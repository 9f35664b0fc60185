"""Each term of the drive against its equation, written down here."""

import numpy as np
import pytest

from twbal.virtual_robot.physics import drive_steps
from twbal.virtual_robot.robot_constants import constants, fresh_memory
from twbal.virtual_robot.wheel_drive import hinge_torque

STEP = 0.00025


def torques(robot, command, seconds):
    """(n, 2) torque of both motors in each physics step under one command from time 0 on."""
    robot.reset(0)
    m, c = robot._memory, robot._constants
    m.commands[:] = command
    rows = []
    for number in range(round(seconds / STEP)):
        drive_steps(c, m, robot._buffers, 0, number, number + 1, 0.0, 0.0)
        rows.append(m.torque.copy())
    return np.array(rows)


@pytest.mark.parametrize("delay", [0.0, 0.0001, 0.00771, 0.02, 0.0333, 0.1])
def test_a_command_acts_after_the_delay_whatever_part_of_a_period_it_is(delay, make):
    acting = torques(make(drive={"delay": delay}), 2.0, 0.15).sum(1)
    assert acting.sum() * STEP / 2.0 == pytest.approx(0.15 - delay, abs=1e-7)
    assert ((acting > 1e-9) & (acting < 2.0 - 1e-9)).sum() <= 1


@pytest.mark.parametrize("delay", [0.0, 0.013, 0.0333])
def test_commands_follow_each_other_as_they_were_given(delay, make):
    robot = make(drive={"delay": delay})
    robot.reset(0)
    given, seen = np.array([1.0, -2.0, 3.0, 0.5, -1.0, 0.0, 0.0, 0.0]), []
    m, c = robot._memory, robot._constants
    for number, command in enumerate(given):
        m.commands[number % len(m.commands)] = command
        for step in range(80):
            drive_steps(c, m, robot._buffers, number, step, step + 1, 0.0, 0.0)
            seen.append(m.torque.sum())
    middle = (np.arange(len(seen)) + 0.5) * STEP - delay
    expected = np.where(middle < 0, 0.0, given[np.maximum(middle // 0.02, 0).astype(int)])
    assert np.mean(~np.isclose(seen, expected)) <= 8 / len(seen)  # but for the steps in which a command changes


@pytest.mark.parametrize(("command", "left"), [(1.0, 0.0), (2.0, 0.0), (3.0, 1.0), (-0.4, 0.0), (-3.0, -2.5)])
def test_a_dead_zone_is_as_wide_as_it_says_on_either_side(command, left, make):
    assert torques(make(drive={"dead_zone": (2.0, 0.5)}), command, 0.01)[-1].sum() == pytest.approx(left)


def test_unequal_motors_share_a_command_as_their_gains_say(make):
    np.testing.assert_allclose(torques(make(drive={"gain": (1.1, 0.7)}), 4.0, 0.01)[-1], [2.2, 1.4])


def test_a_lag_goes_63_per_cent_of_the_way_in_its_time_constant(make):
    seen = torques(make(drive={"lag": 0.01}), 4.0, 0.03)[:, 0]
    np.testing.assert_allclose(seen, 2.0 * (1 - np.exp(-STEP * np.arange(1, 121) / 0.01)), atol=1e-9)


def test_a_slew_limit_reaches_the_torque_limit_in_its_time(make):
    seen = torques(make(drive={"slew_time": 0.02}), 20.0, 0.03)[:, 0]
    np.testing.assert_allclose(seen, np.minimum(10.0 * STEP * np.arange(1, 121) / 0.02, 10.0), atol=1e-9)


def test_a_battery_sags_under_load_and_with_use(make):
    steady = torques(make(drive={"sag_load": 0.1}), 10.0, 0.05)[-1].sum()
    assert steady == pytest.approx(10.0 / (1 + 0.1 * 10.0 / 20.0), rel=1e-3)  # u = 10 (1 - 0.1 u / 20)
    used = torques(make(drive={"sag_use": 0.2}), 10.0, 0.5).sum(1)
    np.testing.assert_allclose(used, 10.0 * np.exp(-0.2 * 0.5 * STEP * np.arange(2000)), rtol=1e-3)


def sliding(robot, rates):
    """Steady torque in a hinge that is turned at each of these rates."""
    c = constants(robot.truth, STEP, 0.02)
    found = []
    for rate in rates:
        m = fresh_memory(c)
        torque = [hinge_torque(c, m, 0, k * STEP * rate, rate) for k in range(4000)]
        found.append(torque[-1])
    return np.array(found)


def test_sliding_bearings_rub_as_the_stribeck_curve_says(make):
    friction = {"coulomb": 0.4, "static": 0.7, "stribeck_rate": 0.8, "bristle_stiffness": 300.0, "bristle_damping": 0.5}
    rates = np.array([-20.0, -2.0, -0.8, -0.1, 0.1, 0.4, 0.8, 1.6, 5.0])
    expected = -np.sign(rates) * (0.4 + 0.3 * np.exp(-((rates / 0.8) ** 2))) - 0.05 * rates
    seen = sliding(make(friction=friction, drive={"viscous": 0.05}), rates)
    np.testing.assert_allclose(seen, expected, rtol=1e-3)


def test_a_bearing_gives_like_a_spring_before_it_slides_and_springs_back(make):
    friction = {"coulomb": 0.5, "static": 0.5, "bristle_stiffness": 300.0, "bristle_damping": 0.0}
    c = constants(make(friction=friction).truth, STEP, 0.02)
    m = fresh_memory(c)
    out = [hinge_torque(c, m, 0, 0.0, 1e-3) for _ in range(400)]  # 1e-4 rad, of the 1.7e-3 at which it slides
    assert out[-1] == pytest.approx(-300.0 * 1e-4, rel=0.1)
    back = [hinge_torque(c, m, 0, 0.0, -1e-3) for _ in range(400)]
    assert abs(back[-1]) < 0.1 * abs(out[-1])


def test_each_wheel_cogs_with_its_own_phase(make):
    robot = make(drive={"cogging": 0.2, "cogging_count": 7, "cogging_phase": (0.3, 2.0)})
    c = constants(robot.truth, STEP, 0.02)
    for wheel, phase in enumerate((0.3, 2.0)):
        for angle in (-1.0, 0.0, 0.4):
            torque = hinge_torque(c, fresh_memory(c), wheel, angle, 0.0)
            assert torque == pytest.approx(0.2 * np.sin(7 * angle + phase))


def rocked(robot):
    """Observed wheel angles while the motors turn to and fro."""
    seen = [robot.reset(0).wheel_angle]
    seen += [robot.step(0.6 * np.sin(2 * np.pi * 2.0 * k * 0.02)).wheel_angle for k in range(75)]
    return np.array(seen)


def test_an_encoder_on_the_motor_sees_the_play_and_one_on_the_wheel_does_not(make):
    play = 0.02
    body = {"wheel_inertia": 0.009, "rotor_inertia": 0.0035}
    drive = {"play": play, "gear_stiffness": 2000.0, "gear_damping": 1.0}
    wheel, motor = (rocked(make(body=body, drive=drive, sensors={"is_encoder_on_motor": on})) for on in (False, True))
    ahead = motor - wheel
    assert np.ptp(ahead) == pytest.approx(play, rel=0.1)
    assert np.median(np.abs(ahead)) == pytest.approx(0.5 * play, rel=0.05)  # resting on its teeth most of the time
    for on in (False, True):
        seen = rocked(make(body=body, drive={"play": 0.0}, sensors={"is_encoder_on_motor": on}))
        np.testing.assert_array_equal(seen, rocked(make(body=body)))


def test_a_wheel_does_not_move_until_its_rotor_has_crossed_the_play(make):
    body = {"wheel_inertia": 0.009, "rotor_inertia": 0.0035}
    drive = {"play": 0.1, "gear_stiffness": 2000.0, "gear_damping": 1.0}
    robot = make(body=body, drive=drive)
    robot.reset(0)
    c, m = robot._constants, robot._memory
    m.commands[:] = 1.0
    crossing = np.sqrt(2 * 0.05 / (0.5 / 0.0035))  # half of the gap, from its middle, under 0.5 N·m
    moved = []
    for number in range(round(2 * crossing / STEP)):
        drive_steps(c, m, robot._buffers, 0, number, number + 1, 0.0, 0.0)
        moved.append(abs(robot.wheel_angles[0]))
    first = np.argmax(np.array(moved) > 1e-6) * STEP
    assert first == pytest.approx(crossing, rel=0.02)
