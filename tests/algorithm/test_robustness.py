"""Policies on changed robots: unchanged is unchanged, shares are counted right, and all policies meet the same."""

import json
from dataclasses import replace

import numpy as np
import pytest
from conftest import CONF
from hydra.utils import instantiate
from omegaconf import OmegaConf

from twbal.algorithm.perturbations import Axis, Perturbations
from twbal.algorithm.robustness import (
    UPRIGHT,
    Cell,
    MethodRobustness,
    PolicyRobustness,
    Robustness,
    after,
    policy_robustness,
    trial_verdict,
    trials_of,
)
from twbal.algorithm.rollout import rollout
from twbal.algorithm.tested_robot import TestedRobot, direction, perturbed_plant
from twbal.core.channels import Channels
from twbal.core.episode import Provenance
from twbal.core.errors import ConfigError
from twbal.core.evaluation import SuccessCriterion, judged
from twbal.core.json_records import encoded
from twbal.core.start_pose import StartPose
from twbal.policies.linear import LinearPolicy
from twbal.virtual_robot.drawn import draw_ground_truth
from twbal.virtual_robot.ground_truth import Noise

NAMES = ("tilt", "tilt_rate", "speed", "position")
RULE = SuccessCriterion.in_seconds(
    tilt_limit=0.5236,
    settled_tilt_limit=0.17453,
    duration=4.0,
    settle_time=2.0,
    place_time=3.0,
    place_radii=1.0,
    command_change=0.1,
    control_period=0.02,
    wheel_radius=0.15,
    torque_limit=20.0,
)
ASKED = Perturbations(
    model_error=[0.1, 0.3],
    sensor_noise=[1.0],
    torque_noise=[0.05],
    motor_lag=[0.01],
    delay=[0.01, 0.4],
    pushes=[5.0, 60.0],
    noise=Noise(0.0035, 0.02, 0.3, 0.001, 0.05, 0.02),
    push_time=1.0,
    push_duration=0.1,
    trials=2,
    first_trial=2000,
)


@pytest.fixture
def robot(paper):
    moderate = instantiate(OmegaConf.load(CONF / "groups" / "faults.yaml").moderate)
    truth = draw_ground_truth(moderate, paper, 880)
    return TestedRobot(paper, truth, StartPose(-0.17453, 0.02, 0.05, 0.02), 0.00025, 880)


@pytest.fixture
def channels(paper):
    return Channels(NAMES, paper.wheel_radius, paper.control_period)


POLICY = LinearPolicy(NAMES, np.array([-50.0, -10.0, -14.0, -12.0]), 0.0, 20.0)


def episode(plant, channels, trial, steps=150):
    return rollout(plant, POLICY, channels, steps, 0.5236, Provenance("paper", "robot", trial=trial))


@pytest.mark.parametrize("axis", list(Axis))
def test_level_0_of_each_axis_is_the_robot_as_it_is_to_the_byte(axis, robot, channels):
    plain = episode(robot.plant(), channels, 2001)
    changed = episode(perturbed_plant(robot, axis, 0.0, 1, replace(ASKED, push_time=0.5), 0), channels, 2001)
    assert changed.observations.tobytes() == plain.observations.tobytes()
    assert changed.poses.tobytes() == plain.poses.tobytes()


@pytest.mark.parametrize("axis", list(Axis))
def test_a_level_of_each_axis_changes_what_the_robot_does(axis, robot, channels):
    plain = episode(robot.plant(), channels, 2001)
    changed = episode(perturbed_plant(robot, axis, ASKED.levels[axis][0], 1, ASKED, 0), channels, 2001)
    assert changed.poses.shape == plain.poses.shape
    assert not np.allclose(changed.poses, plain.poses, atol=1e-6)


@pytest.mark.slow
def test_unchanged_is_the_plain_evaluation_and_a_hopeless_level_fails(robot, channels):
    found = policy_robustness(POLICY, channels, robot, ASKED, RULE, 0)
    plain = [judged(episode(robot.plant(), channels, trial, RULE.steps), RULE) for trial in (2000, 2001)]
    assert all(verdict.succeeded for verdict in plain)
    assert found.unchanged == Cell(0.0, 2, 2, 2, 2, 2, 2)
    assert [cell.succeeded for cell in found.axes["delay"]] == [2, 0]
    assert [cell.succeeded for cell in found.axes["pushes"]] == [2, 0]
    assert found.axes["pushes"][1].upright == 0


@pytest.mark.slow
def test_the_same_seed_is_the_same_bytes_and_each_trial_is_counted(robot, channels):
    asked, driven = replace(ASKED, delay=[0.02], pushes=[5.0], sensor_noise=[3.0]), []

    def record():
        found = policy_robustness(POLICY, channels, robot, asked, RULE, 0, lambda: driven.append(1))
        return json.dumps(encoded(found))

    assert record() == record()
    assert len(driven) == 2 * trials_of(asked) == 2 * 2 * 8


def test_eight_trials_take_all_directions_of_a_model_error_and_the_seed_decides_their_order():
    drawn = [direction(trial, 880, 0) for trial in range(16)]
    assert len(set(drawn[:8])) == len(set(drawn[8:])) == 8
    assert drawn == [direction(trial, 880, 0) for trial in range(16)]
    assert drawn != [direction(trial, 880, 1) for trial in range(16)]
    assert drawn != [direction(trial, 881, 0) for trial in range(16)]


def test_all_policies_meet_the_same_start_and_the_same_noise(robot, channels):
    other = replace(POLICY, gain=1.2 * POLICY.gain)
    for axis in (Axis.SENSOR_NOISE, Axis.TORQUE_NOISE):
        first, second = (
            rollout(perturbed_plant(robot, axis, 1.0, 0, ASKED, 0), policy, channels, 1, 0.5, Provenance("p", "robot"))
            for policy in (POLICY, other)
        )
        np.testing.assert_array_equal(first.observations[0], second.observations[0])


def test_after_a_push_the_rules_times_begin_anew(robot, channels):
    later = after(RULE, 55)
    assert (later.steps, later.settle_step, later.place_step) == (255, 155, 205)
    assert later.tilt_limit == RULE.tilt_limit
    asked = perturbed_plant(robot, Axis.PUSHES, 12.0, 0, ASKED, 0)
    verdict = trial_verdict(asked, POLICY, channels, robot.sheet, 2000, RULE)
    assert verdict.seconds == pytest.approx(1.1 + 4.0)
    assert verdict.succeeded
    asked = perturbed_plant(robot, Axis.PUSHES, 12.0, 0, ASKED, 0)
    pushed = rollout(asked, POLICY, channels, 200, 0.5236, Provenance("paper", "robot", trial=2000))
    assert np.abs(pushed.tilt[55:80]).max() > 0.1  # which is why


def policy(seed, *succeeded):
    cells = tuple(Cell(float(k + 1), 4, s, 4, 4, 4, 4) for k, s in enumerate(succeeded))
    return PolicyRobustness("paper", seed, Cell(0.0, 4, 4, 4, 4, 4, 4), {"delay": cells, "pushes": cells[::-1]})


def test_shares_are_of_all_robots_together_and_means_are_over_levels_without_the_unchanged():
    method = MethodRobustness("m", (policy(1, 4, 2, 0), policy(2, 4, 4, 0)))
    assert method.shares("delay") == [1.0, 0.75, 0.0]
    assert method.shares("pushes") == [0.0, 0.75, 1.0]
    assert method.mean("delay") == pytest.approx(1.75 / 3)
    assert method.overall() == pytest.approx(1.75 / 3)
    assert method.overall(UPRIGHT) == method.unchanged() == 1.0
    assert method.least == pytest.approx(0.5)


def test_methods_on_other_robots_are_noticed():
    one, two = MethodRobustness("a", (policy(1, 4),)), MethodRobustness("b", (policy(2, 4),))
    assert Robustness(0, 4, (), (one, one)).on_same_robots
    assert not Robustness(0, 4, (), (one, two)).on_same_robots


@pytest.mark.parametrize("levels", [[], [0.0, 0.1], [0.2, 0.1], [0.1, 0.1]])
def test_levels_that_do_not_increase_from_above_0_are_refused(levels):
    with pytest.raises(ConfigError, match=r"perturbation\.delay must be levels above 0 that increase"):
        replace(ASKED, delay=levels)


def test_a_model_error_of_all_there_is_is_refused():
    with pytest.raises(ConfigError, match="must stay below 1"):
        replace(ASKED, model_error=[0.5, 1.0])
