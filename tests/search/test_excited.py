"""The speed at which a robot is excited, where none is given."""

import pytest
from hydra import compose
from hydra.utils import instantiate

from twbal.cli.composition import composing
from twbal.cli.main import main
from twbal.core.motion_limits import MotionLimits


@pytest.fixture
def excitation():
    def of_settings(*words):
        with composing():
            cfg = compose("real_rollout", ["experiment=excite", *words])
            return instantiate(cfg.policy), instantiate(cfg.robot)

    return of_settings


@pytest.mark.parametrize("robot", ["paper", "regbot", "balboa", "upkie"])
def test_it_suits_the_robot_and_is_no_faster_than_half_a_metre_a_second(excitation, robot):
    policy, sheet = excitation(f"robot={robot}")
    assert policy.speed == pytest.approx(min(0.5, MotionLimits.of_robot(sheet).speed / 2))


def test_a_given_speed_is_taken_and_says_how_far_the_robot_goes(excitation):
    policy, _ = excitation("policy.speed=0.2")
    assert policy.speed == 0.2
    assert policy.reach == pytest.approx(0.6)  # in the 3 s that it lasts


def test_the_floor_that_it_needs_is_said_before_it_drives(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("sys.argv", ["twbal"])
    words = ["experiment=excite", "policy.speed=0.2", "trials=1", "steps=10", f"hydra.run.dir={tmp_path}"]
    assert main(["real-rollout", *words]) == 0
    assert "have 1.1 m of free floor ahead of it" in capsys.readouterr().out.splitlines()[0]
