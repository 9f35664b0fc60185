"""Whether the motors are equal, told from the yaw rate of robots in MuJoCo."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import twbal
from twbal.core.episode import Episode, Estimated, Outcome, Provenance
from twbal.core.mobility import yaw_mobility
from twbal.core.plant import Observation
from twbal.core.start_pose import StartPose
from twbal.diagnosis.diagnosis_file import as_record
from twbal.diagnosis.motor_difference import motor_difference
from twbal.diagnosis.side_findings import MotorDifference, effects_of
from twbal.effects.dead_zone import DeadZone
from twbal.effects.library import library, values_of
from twbal.effects.unequal_motors import UnequalMotors
from twbal.planar.parameters import planar_parameters
from twbal.sim.bullet_plant import SimPlant

sys.path.insert(0, str(Path(__file__).parents[1] / "virtual_robot"))
from conftest import conf, make  # noqa: F401 - fixtures


def driven(robot, sheet, periods=1500):
    """An episode of a robot that a regulator shakes; nothing controls its heading."""
    pushes = np.repeat(np.random.default_rng(7).normal(0.0, 2.0, periods // 5), 5)
    seen, commands = [robot.reset(0)], []
    for push in pushes:
        now = seen[-1]
        speed = sheet.wheel_radius * (now.wheel_rate + now.tilt_rate)
        commands.append(80 * now.tilt + 14 * now.tilt_rate + 6 * speed + push)
        seen.append(robot.step(commands[-1]))
    return episode(np.array(seen), np.array(commands), sheet)


def episode(seen, commands, sheet, **more):
    source = Provenance(sheet.name, "robot")
    return Episode(("tilt",), sheet.control_period, seen, seen[:, 1:2], commands, Outcome.COMPLETED, source, **more)


def found(episodes, sheet, effects=None):
    return motor_difference(episodes, sheet, planar_parameters(sheet, effects or {}), 0.7)


@pytest.mark.parametrize("share", [pytest.param(0.05, marks=pytest.mark.slow), -0.15])
def test_the_stronger_motor_of_a_robot_in_mujoco_is_told_with_its_share(share, make, conf):  # noqa: F811
    sheet = conf("robot/paper")
    log = driven(make("paper", start=0.02, drive={"gain": (1 - share, 1 + share)}), sheet)
    told = found([log], sheet)
    assert told.share == pytest.approx(share, rel=0.1)
    assert told.low95 < share < told.high95
    assert f"the {'right' if share > 0 else 'left'} motor gives" in told.text
    assert UnequalMotors(**effects_of(None, told)["unequal_motors"]).share == told.share


@pytest.mark.parametrize("faults", ["none", pytest.param("moderate", marks=pytest.mark.slow)])
def test_equal_motors_are_not_told_apart(faults, make, conf):  # noqa: F811
    sheet = conf("robot/paper")
    assert found([driven(make("paper", faults, seed=4, start=0.02, drive={"gain": (1.0, 1.0)}), sheet)], sheet) is None


def test_what_a_dead_zone_takes_is_not_taken_for_weaker_motors(make, conf):  # noqa: F811
    sheet, share = conf("robot/paper"), 0.15
    robot = make("paper", start=0.02, drive={"gain": (1 - share, 1 + share), "dead_zone": (1.0, 1.0)})
    log = driven(robot, sheet)
    assert found([log], sheet, values_of([DeadZone(1.0)])).share == pytest.approx(share, rel=0.2)
    assert found([log], sheet).share < 0.9 * share


def test_commands_that_no_motor_can_follow_count_as_what_it_gives(make, conf):  # noqa: F811
    """A robot whose log has the commands from before they were cut to the torque limit."""
    sheet, limit = conf("robot/paper"), 2.0
    robot = make("paper", start=0.02, drive={"gain": (0.85, 1.15)})
    log = driven(robot, sheet)
    weak = replace(sheet, torque_limit=limit)
    cut = replace(log, commands=np.clip(log.commands, -limit, limit))
    assert (np.abs(log.commands) > limit).mean() > 0.05
    assert found([log], weak) == found([cut], weak)


def test_a_yaw_rate_that_was_not_measured_tells_nothing(make, conf):  # noqa: F811
    sheet = conf("robot/paper")
    log = driven(make("paper", start=0.02, drive={"gain": (0.85, 1.15)}), sheet, 750)
    assert found([log], sheet) is not None
    assert found([replace(log, estimated=(Estimated("yaw_rate", np.inf),))], sheet) is None


def test_the_difference_that_was_commanded_is_not_the_motors(make, conf):  # noqa: F811
    """A constant pull to one side, of what the heading's control gave."""
    sheet, rng = conf("robot/paper"), np.random.default_rng(1)
    robot = make("paper", start=0.02)
    seen, commands, steered = [robot.reset(0)], [], []
    for _ in range(1000):
        now = seen[-1]
        speed = sheet.wheel_radius * (now.wheel_rate + now.tilt_rate)
        commands.append(80 * now.tilt + 14 * now.tilt_rate + 6 * speed + rng.normal(0.0, 2.0))
        steered.append(0.1 * commands[-1] + rng.normal(0.0, 0.2) - 0.3 * now.yaw_rate)
        robot.steer(steered[-1])
        seen.append(robot.step(commands[-1]))
    headings = np.zeros((len(seen), 5))
    headings[:-1, 4] = steered
    seen, commands = np.array(seen), np.array(commands)
    assert found([episode(seen, commands, sheet)], sheet) is not None
    assert found([episode(seen, commands, sheet, headings=headings)], sheet) is None


def test_the_physics_engine_turns_with_unequal_motors_as_the_sheet_tells(conf):  # noqa: F811
    sheet, share, torque = conf("robot/paper"), 0.2, 1.0
    start = StartPose(0.0, 0.0, 0.0, 0.0)
    with SimPlant(robot=sheet, effects=[UnequalMotors(share)], start=start, physics_step=0.0005, seed=0) as plant:
        plant.reset(0)
        rate = plant.step(torque)[Observation._fields.index("yaw_rate")]
    assert rate == pytest.approx(yaw_mobility(sheet) * share * torque * sheet.control_period, rel=0.05)


def test_the_planar_model_passes_it_over_and_no_diagnosis_weighs_it(paper):
    assert planar_parameters(paper, values_of([UnequalMotors(0.2)])) == planar_parameters(paper, {})
    assert "unequal_motors" not in library()


@pytest.mark.slow
def test_a_diagnosis_says_so_and_its_simulation_turns_with_the_command(make, conf):  # noqa: F811
    sheet, share = conf("robot/paper"), -0.15
    log = driven(make("paper", start=0.02, drive={"gain": (1 - share, 1 + share)}), sheet)
    quick = ["diagnosis.max_effects=1", "diagnosis.tempered_search=false", "starts=4", "next_experiment=false"]
    result = twbal.diagnose([log], overrides=quick)
    told = result.diagnosis.motor_difference
    assert told.share == pytest.approx(share, rel=0.1)
    assert result.diagnosis.advice[-1] == told.text
    assert result.simulation.effects["unequal_motors"] == {"share": told.share}
    assert as_record(result.diagnosis)["motor_difference"]["share"] == told.share
    known = [*quick, "+effect@sim.effects.unequal_motors=unequal_motors", f"sim.effects.unequal_motors.share={share}"]
    assert twbal.diagnose([log], overrides=known).diagnosis.motor_difference is None


def test_the_sentence_has_side_and_interval():
    text = MotorDifference(-0.08, -0.1, -0.06).text
    assert "the left motor gives 8% (6% to 10%) more torque" in text and "lies to the right" in text
