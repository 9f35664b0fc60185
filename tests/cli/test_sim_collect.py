"""What sim-collect says of the rollouts that it made."""

import numpy as np
import pytest

from twbal.cli.main import main
from twbal.cli.stages.sim_collect import Driven, beyond_limits, driven_of
from twbal.core.motion_limits import MotionLimits
from twbal.io.logs import read_episode

RADIUS = 0.034  # of the wheels of the robot `esp32` [m]


@pytest.fixture
def collected(tmp_path, capsys, monkeypatch):
    """What is said, and the rollouts, of the small robot `esp32` under a friction [N·m]."""
    monkeypatch.setattr("sys.argv", ["twbal"])

    def collect(friction):
        effect = ["+effect@sim.effects.coulomb_friction=coulomb_friction"]
        words = ["policy=excite", "policy.command_width=0.1", "start.tilt_mean=0", "rollouts=1", "steps=300"]
        size = f"sim.effects.coulomb_friction.torque={friction}"
        assert main(["sim-collect", "robot=esp32", *words, *effect, size, f"hydra.run.dir={tmp_path}"]) == 0
        return capsys.readouterr().out, read_episode(tmp_path / "episodes" / "trial_000.mcap")

    return collect


def test_of_a_robot_within_its_limits_nothing_is_said(collected):
    said, _ = collected(0.02)  # 2 % of the torque limit
    assert "fell in none of 1" in said and "the simulated robot drove" not in said


def test_the_way_is_the_integral_of_the_speed(collected):
    _, episode = collected(0.02)
    found = driven_of(episode, RADIUS)
    speed = RADIUS * (episode.observations[:, 2] + episode.observations[:, 5])
    way = np.cumsum(speed) * episode.control_period
    assert found.distance == pytest.approx(np.abs(way).max(), rel=0.02)
    assert found.speed == np.abs(speed).max()


@pytest.mark.parametrize(("speed", "distance", "is_told"), [(11.0, 45.0, True), (11.0, 0.3, False), (0.5, 45.0, False)])
def test_a_robot_that_goes_far_beyond_its_limits_is_told(speed, distance, is_told, paper):
    limit = MotionLimits.of_robot(paper).speed
    assert 0.5 < limit < 5.0
    said = beyond_limits([Driven(0.1, 0.1), Driven(distance, speed)], paper)
    assert said.startswith("the simulated robot drove 45 m at up to 11 m/s: ") if is_told else not said
