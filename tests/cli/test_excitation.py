"""The speed at which a robot is excited, where none is given."""

import pytest
from hydra import compose
from hydra.utils import instantiate

from twbal.cli.composition import composing
from twbal.cli.main import main
from twbal.core.motion_limits import MotionLimits
from twbal.io.logs import read_episode


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


def test_how_far_it_may_drive_the_robot_is_said_before_it_does(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("sys.argv", ["twbal"])
    words = ["experiment=excite", "policy.speed=0.2", "trials=1", "steps=10", f"hydra.run.dir={tmp_path}"]
    assert main(["real-rollout", *words]) == 0
    said = capsys.readouterr().out.splitlines()[0]
    assert "asks for up to 0.2 m/s (0.6 m forward or backward)" in said
    assert "0.27 m/s besides, 0.1 m within a trial" in said


def test_a_robot_that_balances_elsewhere_rolls_off_as_fast_as_is_said(tmp_path, monkeypatch):
    """Simulated by PyBullet, with its centre of mass 1° ahead and nothing that is asked for."""
    monkeypatch.setattr("sys.argv", ["twbal"])
    words = ["policy=excite", "policy.speed=0", "policy.multisine=0", "policy.prbs=0", "rollouts=1", "steps=500"]
    offset = ["+effect@sim.effects.com_offset=com_offset", "sim.effects.com_offset.angle=0.01745"]
    assert main(["sim-collect", *words, *offset, "start.tilt_mean=0", f"hydra.run.dir={tmp_path}"]) == 0
    episode = read_episode(tmp_path / "episodes" / "trial_000.mcap")
    speed = episode.states[300:, episode.channels.index("speed")].mean()
    with composing():
        drift = instantiate(compose("real_rollout", ["experiment=excite"]).policy).drift
    assert abs(speed) == pytest.approx(drift * 0.01745, rel=0.1)


@pytest.mark.parametrize(("robot", "steps"), [("paper", 500), ("balboa", 1000), ("lego", 2000)])
def test_an_episode_lasts_ten_seconds_at_any_control_period(robot, steps):
    with composing():
        assert compose("real_rollout", ["experiment=excite", f"robot={robot}"]).steps == steps
