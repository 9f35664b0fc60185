from dataclasses import asdict, replace

import numpy as np
import pytest

from twbal.core.errors import ConfigError
from twbal.effects.effect import assemble
from twbal.virtual_robot.faults import draw_faults


def values(effects):
    """Every parameter by effect and name, the noise's left out."""
    named = {f"{type(e).__name__}.{k}": v for e in effects for k, v in asdict(e).items()}
    return {k: v for k, v in named.items() if not k.startswith("SensorNoise")}


@pytest.fixture
def recipe(conf):
    return conf("faults/random")


def test_the_same_seed_is_the_same_robot_and_another_is_not(conf, recipe):
    robot = conf("robot/paper")
    assert draw_faults(recipe, robot, 1) == draw_faults(recipe, robot, 1) != draw_faults(recipe, robot, 2)


def test_half_of_a_range_at_either_end_is_uniform_in_the_ranges_of_the_paper_robot(conf, recipe):
    recipe = replace(recipe, outer=0.5)
    drawn = [values(draw_faults(recipe, conf("robot/paper"), seed)) for seed in range(400)]
    expected = {
        "TorqueGain.gain": (0.4, 1.4),
        "DeadZone.width": (0.0, 4.0),
        "ActuationDelay.delay": (0.0, 0.04),
        "MotorLag.time_constant": (0.0, 0.0),
        "ViscousFriction.coefficient": (0.0, 0.1),
        "CoulombFriction.torque": (0.0, 1.0),
        "BodyMass.factor": (0.7, 1.6),
        "ComHeight.factor": (0.7, 1.4),
        "ComOffset.angle": (-np.deg2rad(5), np.deg2rad(5)),
    }
    assert drawn[0].keys() == expected.keys()
    table = np.array([list(d.values()) for d in drawn])
    low, high = np.array(list(expected.values())).T
    span = high - low
    assert (table >= low - 1e-5).all()
    assert (table <= high + 1e-5).all()
    np.testing.assert_allclose(table.mean(0), (low + high) / 2, atol=4 * span.max() / np.sqrt(12 * 400))
    np.testing.assert_allclose(np.ptp(table, 0), span, atol=0.05 * span.max())
    correlation = np.corrcoef(table[:, span > 0].T) - np.eye((span > 0).sum())
    assert np.abs(correlation).max() < 0.2


def test_draws_come_from_the_outer_share_of_a_range_at_both_ends(conf, recipe):
    recipe = replace(recipe, outer=0.1)
    gains = np.array([draw_faults(recipe, conf("robot/paper"), seed)[0].gain for seed in range(200)])
    low, high = gains <= 0.5, gains >= 1.3
    assert (low | high).all()
    assert 70 < low.sum() < 130


@pytest.mark.parametrize("outer", [0.0, 0.6, -1.0])
def test_an_outer_share_that_is_none_is_an_error(recipe, outer):
    with pytest.raises(ConfigError, match="outer"):
        replace(recipe, outer=outer)


def test_torques_scale_with_the_torque_limit_and_delays_with_the_control_period(conf, recipe):
    paper = conf("robot/paper")
    small = replace(paper, torque_limit=0.5, control_period=0.01)
    big, little = (values(draw_faults(recipe, robot, 7)) for robot in (paper, small))
    factors = {
        "DeadZone": 0.025,
        "ViscousFriction": 0.025,
        "CoulombFriction": 0.025,
        "ActuationDelay": 0.5,
        "MotorLag": 0.5,
    }
    for name, value in big.items():
        assert little[name] == pytest.approx(value * factors.get(name.split(".")[0], 1.0))


def test_nothing_hidden_leaves_the_data_sheet_as_it_is(conf):
    robot = conf("robot/regbot")
    machine = assemble(robot, draw_faults(conf("faults/none"), robot, 3))
    assert machine.robot == robot
    running = machine.start(0.001, np.random.default_rng(0))
    assert [running.actuate(u) for u in (0.3, -0.2, 0.0)] == [0.3, -0.2, 0.0]


@pytest.mark.parametrize("bad", [[1.0], [2.0, 1.0], [0.0, float("nan")]])
def test_a_range_out_of_order_is_an_error(recipe, bad):
    with pytest.raises(ConfigError, match=r"dead_zone must be \[lowest, highest\]"):
        replace(recipe, dead_zone=bad)
