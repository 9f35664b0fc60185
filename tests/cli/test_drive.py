"""`twbal real-rollout` with a course, from its settings to its files."""

import json

import numpy as np
import pytest

from twbal.cli.main import main
from twbal.cli.stages.real_rollout import COURSE
from twbal.io.checkpoint import save_checkpoint
from twbal.io.logs import read_episode
from twbal.policies.linear import LinearPolicy

CHANNELS = ("tilt", "tilt_rate", "speed", "command_1", "command_2", "position", "position_integral")
GAIN = [-71.6, -11.7, -11.2, 0.0, 0.0, -14.5, -4.0]  # of a linear-quadratic regulator of the sheet, with a place


@pytest.fixture
def policy(tmp_path):
    made = LinearPolicy(CHANNELS, np.array(GAIN), 0.0, 20.0)
    save_checkpoint(tmp_path / "policy.pt", "policy", made.to_payload())
    return f"policy.path={tmp_path / 'policy.pt'}"


def test_a_course_is_driven_to_its_end_told_of_and_drawn(policy, tmp_path, capsys):
    course = "course.segments=[{seconds:3,speed:0},{position:0.2},{seconds:1.0,speed:0}]"
    words = [policy, "experiment=drive", course, 'link.overrides=["faults=none"]', f"hydra.run.dir={tmp_path / 'out'}"]
    assert main(["real-rollout", *words]) == 0
    said = capsys.readouterr().out
    assert "needs 0.2 m of free floor ahead of the robot and 0.0 m behind it" in said and "to 0.20 m" in said
    episode = read_episode(tmp_path / "out" / "episodes" / "trial_000.mcap")
    assert episode.references is not None and episode.references[-1, 0] == pytest.approx(0.2, abs=1e-6)
    (trial,) = json.loads((tmp_path / "out" / COURSE).read_text())["trials"]
    assert not trial["fell"] and trial["place_by"] == "pose" and len(trial["segments"]) == 3
    assert trial["seconds"] == pytest.approx(trial["segments"][-1]["end"], abs=0.02)
    assert "reference" in (tmp_path / "out" / "figures" / "trial_000.svg").read_text()


def test_a_policy_that_does_not_keep_the_robot_in_its_place_is_said_to_need_more_floor(tmp_path, capsys):
    """A regulator of `twbal lqr` leans on the tilt of the sheet: where the robot balances at another, it rolls off."""
    gain = [*GAIN[:5], 0.0, 0.0]
    save_checkpoint(tmp_path / "policy.pt", "policy", LinearPolicy(CHANNELS, np.array(gain), 0.0, 20.0).to_payload())
    course = "course.segments=[{seconds:10,speed:0}]"
    words = [f"policy.path={tmp_path / 'policy.pt'}", "experiment=drive", course, f"hydra.run.dir={tmp_path / 'out'}"]
    assert main(["real-rollout", *words]) == 0
    said = capsys.readouterr().out
    assert "nothing keeps the robot in its place" in said
    assert "rolls off at 0.11 m/s, 1.1 m within a trial" in said  # 71.6 / 11.2 · 1°


@pytest.mark.parametrize(
    ("word", "message"),
    [
        ("course.segments=[{seconds:3,speed:9}]", r"asks for 9 m/s; the limit is 1.05 m/s"),
        ("course.segments=[{seconds:3}]", r"Segment 0 of the course is"),
        ("course.give_way=0", r"cannot have course.give_way=0"),
    ],
)
def test_a_course_that_cannot_be_driven_is_refused_before_the_robot_is_reached(policy, tmp_path, capsys, word, message):
    words = [policy, "experiment=drive", word, "link=serial", "link.port=/dev/null", f"hydra.run.dir={tmp_path / 'o'}"]
    assert main(["real-rollout", *words]) != 0
    assert message in capsys.readouterr().err


def test_a_state_without_a_place_is_refused(tmp_path, capsys):
    words = ["policy=random", "state=rolling", "experiment=drive", "link=serial", "link.port=/dev/null"]
    assert main(["real-rollout", *words, f"hydra.run.dir={tmp_path / 'o'}"]) != 0
    assert "has no position, which is needed here" in capsys.readouterr().err


TURN = "course.segments=[{seconds:3,speed:0},{turn:90},{seconds:3,speed:0}]"


def drive(policy, out, *words):
    words = (policy, "experiment=drive", TURN, f"hydra.run.dir={out}", *words)
    assert main(["real-rollout", *words]) == 0
    (trial,) = json.loads((out / COURSE).read_text())["trials"]
    return read_episode(out / "episodes" / "trial_000.mcap"), trial


def test_a_robot_turns_over_the_link_and_that_is_kept_told_and_drawn(policy, tmp_path, capsys):
    episode, trial = drive(policy, tmp_path / "out", 'link.overrides=["faults=light"]')
    said = capsys.readouterr().out
    assert "heading off by at most" in said and "m from its start" in said
    assert np.degrees(episode.poses[-1, 2]) == pytest.approx(90.0, abs=3.0)
    assert np.degrees(episode.headings[-1, [0, 2]]) == pytest.approx(90.0, abs=3.0)
    assert np.degrees(trial["turned"]) == pytest.approx(90.0, abs=3.0)
    assert trial["segments"][1]["asked_heading"] == pytest.approx(np.pi / 2)
    assert abs(np.degrees(trial["segments"][2]["heading_off_at_end"])) < 3.0
    assert "heading" in (tmp_path / "out" / "figures" / "trial_000.svg").read_text()


def test_a_robot_of_version_1_is_driven_without_turning_and_that_is_said_once(policy, tmp_path, capsys):
    episode, trial = drive(policy, tmp_path / "out", 'link.overrides=["faults=none","protocol=1"]')
    said = capsys.readouterr().out
    why = "it speaks version 1 of the link protocol, which knows one command for both wheels"
    assert said.count(f"the robot paper cannot be turned: {why}; the turns of the course are left out") == 1
    assert episode.headings is None and not trial["fell"]
    assert trial["turned"] == pytest.approx(0.0, abs=0.01)
    assert trial["segments"][1]["asked_heading"] is None and trial["heading_error"] is None
