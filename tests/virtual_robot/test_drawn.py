from dataclasses import replace
from math import inf

import numpy as np
import pytest
import yaml
from conftest import CONF

from twbal.core.errors import ConfigError
from twbal.virtual_robot.drawn import draw_ground_truth
from twbal.virtual_robot.ground_truth import Noise

ORIGINAL = {  # of the virtual robots before MuJoCo's, none of which may be narrower now
    "torque_gain": (0.4, 1.4),
    "dead_zone": (0.0, 4.0),
    "delay_periods": (0.0, 2.0),
    "viscous_friction": (0.0, 0.1),
    "coulomb_friction": (0.0, 1.0),
    "body_mass": (0.7, 1.6),
    "com_height": (0.7, 1.4),
    "com_offset": (-0.0873, 0.0873),
}
SHEETS = sorted(path.stem for path in (CONF / "robot").glob("*.yaml"))


@pytest.fixture
def hard(conf):
    return conf("faults/hard")


def test_the_same_seed_is_the_same_robot_and_another_is_not(conf, hard):
    robot = conf("robot/paper")
    assert draw_ground_truth(hard, robot, 1) == draw_ground_truth(hard, robot, 1) != draw_ground_truth(hard, robot, 2)


def test_half_of_a_range_at_either_end_is_uniform_in_it_and_independent_of_the_others(hard):
    uniform = replace(hard, outer=0.5)
    drawn = [uniform.draw(np.random.default_rng(seed)) for seed in range(400)]
    names = [name for name in uniform.ranges() if np.ptp(getattr(uniform, name)) > 0]
    table = np.array([[values[name] for name in names] for values in drawn])
    low, high = np.array([getattr(uniform, name) for name in names]).T
    shares = (table - low) / (high - low)
    assert shares.min() >= 0.0
    assert shares.max() <= 1.0
    np.testing.assert_allclose(shares.mean(0), 0.5, atol=4 / np.sqrt(12 * 400))
    np.testing.assert_allclose(np.ptp(shares, 0), 1.0, atol=0.05)
    correlation = np.corrcoef(shares.T) - np.eye(len(names))
    assert np.abs(correlation).max() < 0.22


def test_hard_robots_come_from_the_outer_fifth_of_each_range_and_as_often_from_either_end(hard):
    drawn = [hard.draw(np.random.default_rng(seed)) for seed in range(300)]
    for name in hard.ranges():
        low, high = getattr(hard, name)
        if low == high:
            continue
        shares = (np.array([values[name] for values in drawn]) - low) / (high - low)
        assert ((shares <= 0.2) | (shares >= 0.8)).all(), name
        assert 110 < (shares < 0.5).sum() < 190, name


def test_hard_ranges_are_no_narrower_than_those_of_earlier_virtual_robots(hard):
    for name, (low, high) in ORIGINAL.items():
        assert getattr(hard, name)[0] <= low, name
        assert getattr(hard, name)[1] >= high, name


def test_moderate_robots_of_the_paper_are_within_what_moderate_means(conf):
    sheet, moderate = conf("robot/paper"), conf("faults/moderate")
    for seed in range(60):
        truth = draw_ground_truth(moderate, sheet, seed)
        body, drive = truth.body, truth.drive
        assert 0.75 <= body.mass / sheet.body_mass <= 1.25, seed
        assert 0.75 <= body.com_height / sheet.com_height <= 1.25, seed
        assert 0.75 <= np.mean(drive.gain) <= 1.25, seed
        assert abs(np.degrees(body.com_offset)) <= 2.0, seed
        assert 0.005 <= drive.delay + drive.lag + truth.sensors.filter_time <= 0.025, seed
        assert 0.0 <= min(drive.dead_zone) <= max(drive.dead_zone) <= 2.0, seed
        assert truth.friction.coulomb <= 0.35, seed


@pytest.mark.parametrize("faults", ["light", "moderate", "hard"])
@pytest.mark.parametrize("name", SHEETS)
def test_every_robot_that_is_drawn_can_exist(name, faults, conf):
    sheet, ranges = conf(f"robot/{name}"), conf(f"faults/{faults}")
    for seed in range(20):
        truth = draw_ground_truth(ranges, sheet, seed)
        *others, largest = sorted(truth.body.inertia)
        assert largest <= sum(others) * (1 + 1e-9), seed
        body = truth.body
        assert min(body.mass, body.com_height, body.wheel_mass, body.wheel_inertia, body.rotor_inertia) > 0, seed
        assert truth.friction.static >= truth.friction.coulomb >= 0, seed
        assert 0.45 * sheet.wheel_inertia < body.wheel_inertia + body.rotor_inertia < 1.6 * sheet.wheel_inertia, seed


def test_torques_scale_with_the_torque_limit_and_delays_with_the_control_period(conf, hard):
    paper = conf("robot/paper")
    small = replace(paper, torque_limit=0.5, control_period=0.01)
    big, little = (draw_ground_truth(hard, robot, 7) for robot in (paper, small))
    for name in ("viscous", "cogging"):
        assert getattr(little.drive, name) == pytest.approx(0.025 * getattr(big.drive, name))
    assert little.drive.dead_zone == pytest.approx([0.025 * width for width in big.drive.dead_zone])
    assert little.friction.coulomb == pytest.approx(0.025 * big.friction.coulomb)
    assert little.drive.delay == pytest.approx(0.5 * big.drive.delay)
    assert little.body == big.body


def test_delays_of_moderate_robots_are_in_seconds(conf):
    paper = conf("robot/paper")
    fast = replace(paper, control_period=0.005)
    slow, quick = (draw_ground_truth(conf("faults/moderate"), robot, 7) for robot in (paper, fast))
    assert slow.drive.delay == quick.drive.delay > 0


@pytest.mark.parametrize("name", SHEETS)
def test_nothing_hidden_leaves_the_data_sheet_as_it_is(name, conf):
    sheet = conf(f"robot/{name}")
    truth = draw_ground_truth(conf("faults/none"), sheet, 3)
    body, drive = truth.body, truth.drive
    assert (body.mass, body.com_height, body.com_offset) == (sheet.body_mass, sheet.com_height, sheet.com_offset)
    assert body.inertia == (sheet.body_inertia_roll, sheet.body_inertia_pitch, sheet.body_inertia_yaw)
    assert (body.wheel_mass, body.wheel_inertia, body.rotor_inertia) == (sheet.wheel_mass, sheet.wheel_inertia, 0.0)
    assert body.wheel_radius == (sheet.wheel_radius, sheet.wheel_radius)
    assert drive.gain == (1.0, 1.0)
    assert drive.torque_limit == sheet.torque_limit
    nothing = (*drive.dead_zone, drive.delay, drive.lag, drive.slew_time, drive.viscous, drive.cogging, drive.play)
    around = truth.surroundings
    nothing += (drive.sag_load, drive.sag_use, truth.friction.static, around.slope, around.wave_slope, around.scrub)
    assert set(nothing) | {around.drag, body.eccentricity, truth.sensors.ticks, truth.sensors.fusion_time} == {0.0}
    assert truth.sensors.noise == Noise(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("bad", [[1.0], [2.0, 1.0], [0.0, float("nan")]])
def test_a_range_out_of_order_is_an_error(hard, bad):
    with pytest.raises(ConfigError, match=r"dead_zone must be \[lowest, highest\]"):
        replace(hard, dead_zone=bad)


@pytest.mark.parametrize("outer", [0.0, 0.6, -1.0])
def test_an_outer_share_that_is_none_is_an_error(hard, outer):
    with pytest.raises(ConfigError, match="outer"):
        replace(hard, outer=outer)


def test_a_reference_torque_that_is_none_is_an_error(hard):
    with pytest.raises(ConfigError, match="reference_torque"):
        replace(hard, reference_torque=-inf)


def test_every_range_of_hard_that_is_drawn_says_where_it_is_taken_from():
    lines = (CONF / "groups" / "faults.yaml").read_text().split("\nhard:")[1].split("\n\n")[0].splitlines()
    hard = yaml.safe_load((CONF / "groups" / "faults.yaml").read_text())["hard"]
    ranges = [name for name, value in hard.items() if isinstance(value, list)]
    said = {line.split(":")[0].strip() for line in lines if "#" in line}
    assert set(ranges) <= said
