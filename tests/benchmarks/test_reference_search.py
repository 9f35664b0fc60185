import json
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.hidden_robots import pushes, reference
from benchmarks.hidden_robots.families import FAMILIES, Family
from benchmarks.hidden_robots.linear_truth import POSITION, SPEED, TILT, linear_truth, sample
from benchmarks.hidden_robots.reached import References
from benchmarks.hidden_robots.reference import TRIALS, Reached, designs, drive, is_sticky, search
from benchmarks.hidden_robots.reference_law import Law
from benchmarks.hidden_robots.robots import Workshop
from twbal.core.evaluation import judged
from twbal.core.start_pose import StartPose
from twbal.virtual_robot.mujoco_robot import MujocoRobot


@pytest.fixture(scope="module", params=["none", "moderate"])
def shop(request):
    return Workshop(Family("paper", request.param, 0, 0))


@pytest.fixture
def moderate():
    return Workshop(FAMILIES["moderate"])


@pytest.mark.slow
def test_a_robot_that_can_be_kept_in_place_is_found_reachable(shop, monkeypatch):
    monkeypatch.setattr(reference, "FURTHER", 1)
    with shop.robot(3) as robot:
        found = search(robot, shop.rules)
        assert found.reachable
        assert not found.is_sticky
        again = next(d for d in designs() if found.design == json.loads(json.dumps(_plain(d))))
        law = Law(robot.truth, again, robot.control_period)
        verdicts = [judged(drive(robot, law, trial, shop.rules.default), shop.rules.default) for trial in range(TRIALS)]
    assert all(verdict.succeeded for verdict in verdicts)
    assert max(verdict.farthest for verdict in verdicts) == found.place


@pytest.mark.slow
def test_a_robot_too_weak_to_right_itself_is_unreachable(moderate):
    truth = moderate.truth(3)
    weak = replace(truth, drive=replace(truth.drive, gain=(0.1, 0.1)))
    with moderate.robot(3, weak) as robot:
        found = search(robot, moderate.rules)
    assert found == Reached(False, is_sticky(weak), len(designs()), None, None, False, None)


def test_the_reference_search_loads_nothing_that_learns():
    code = "import sys, benchmarks.hidden_robots.reference; print('\\n'.join(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    learning = tuple(f"twbal.{part}" for part in ("search", "sysid", "planar", "models", "policies", "sim"))
    loaded = done.stdout.split()
    assert "twbal.virtual_robot.mujoco_robot" in loaded
    assert [name for name in loaded if name.startswith(learning)] == []


def test_a_robot_sticks_from_a_quarter_of_its_limit_on(moderate):
    truth = moderate.truth(3)

    def with_friction(zone, coulomb):
        drive = replace(truth.drive, dead_zone=(zone, 0.5 * zone), gain=(0.5, 0.5), torque_limit=20.0)
        return replace(truth, drive=drive, friction=replace(truth.friction, coulomb=coulomb))

    assert not is_sticky(with_friction(3.0, 0.499))  # 3 + 2 * 0.499 / 0.5 < 5
    assert is_sticky(with_friction(3.0, 0.501))


@pytest.mark.parametrize("delay", [0.0, 0.013, 0.045])
def test_the_sampled_model_moves_as_the_robot_without_dry_friction_does(delay):
    """From near its balance point on a slope, under torques that change from step to step."""
    shop = Workshop(FAMILIES["moderate"])
    ideal, moderate = shop.ideal(), shop.truth(5)
    truth = replace(
        ideal,
        body=replace(moderate.body, eccentricity=0.0, wheel_radius=(0.15, 0.15)),
        drive=replace(ideal.drive, delay=delay, viscous=0.03),
        surroundings=replace(ideal.surroundings, slope=0.005),
    )
    model = linear_truth(truth)
    sampled = sample(model, 0.02)
    start = StartPose(model.balance + 0.002, 0.0, 0.0, 0.0)
    commands = model.holding + 0.2 * np.array([1, -1, 1, 1, -2, 0, 1, 2, -2, 1, 0, 1, -1, 0, 1])
    x, past = np.array([0.002, 0.0, 0.0, 0.0]), [-model.holding] * 4  # nothing acts before the delay is over
    with MujocoRobot(truth=truth, control_period=0.02, start=start, physics_step=0.00025, seed=0) as robot:
        robot.reset(0)
        for command in commands:
            robot.step(command)
            past = [command - model.holding, *past]
            x = sampled.A @ x + sampled.early * past[sampled.whole] + sampled.late * past[sampled.whole + 1]
        moved = robot.true_motion
        assert moved.tilt - model.balance == pytest.approx(x[TILT], abs=3e-4)
        assert robot.pose().x == pytest.approx(x[POSITION], abs=3e-4)
        assert moved.speed == pytest.approx(x[SPEED], abs=3e-3)


def test_what_is_known_is_not_searched_again(tmp_path, monkeypatch):
    known = Reached(True, False, 7, 0.1, 2.0, True, {"torque": 0.3})
    monkeypatch.setattr("benchmarks.hidden_robots.reached.search", lambda robot, rules: known)
    assert References("moderate", tmp_path).of(11) == known
    monkeypatch.setattr("benchmarks.hidden_robots.reached.search", None)
    assert References("moderate", tmp_path).of(11) == known
    assert "hidden" not in (tmp_path / "reference_moderate.json").read_text()


def _plain(design):
    return {**vars(design), "friction": vars(design.friction)}


@pytest.mark.slow
def test_a_push_that_throws_the_reference_over_is_told_from_one_that_it_survives(moderate, monkeypatch):
    """By the poses of the robot itself: 1 N·s for each kg is survived, twelve times as much is not."""
    sheet, rule = moderate.sheet, moderate.rules.default
    with moderate.robot(3) as robot:
        monkeypatch.setattr(reference, "PUSHES", 2)
        design = next(d for d in designs() if reference.tried_out(robot, d, moderate.rules, False, np.inf))
        assert reference.pushed(robot, design, sheet, rule) == [(True, True)] * 2
        monkeypatch.setattr(pushes, "_IMPULSE", 12.0)
        assert reference.pushed(robot, design, sheet, rule) == [(False, False)] * 2


@pytest.mark.slow
def test_pushes_of_a_robot_are_kept_beside_what_was_reached(tmp_path, monkeypatch):
    monkeypatch.setattr(reference, "PUSHES", 1)
    monkeypatch.setattr(reference, "FURTHER", 1)
    first = References("moderate", tmp_path).pushes(3)
    assert [each.survived for each in first] == [True]
    monkeypatch.setattr("benchmarks.hidden_robots.reached.pushed", None)  # is not driven again
    assert References("moderate", tmp_path).pushes(3) == first
