"""`known=`: what logs told of a robot, read before any work and refused where nothing would use it."""

import numpy as np
import pytest
from hydra import compose

from twbal.algorithm.distribution_file import save_distribution
from twbal.cli.composition import composing
from twbal.cli.known_robot import known_robot
from twbal.cli.main import main
from twbal.core.errors import CheckpointError, ConfigError
from twbal.planar.robot_distribution import prior_of


def told(*words):
    with composing():
        cfg = compose("iterate", list(words))
    return known_robot(cfg)


def test_nothing_is_known_without_it():
    assert told() is None


def test_a_run_folder_or_its_file_tells(paper, tmp_path):
    save_distribution(tmp_path / "robot_distribution.pt", prior_of(paper, {"torque_gain": {"gain": 0.5}}))
    for given in (tmp_path, tmp_path / "robot_distribution.pt"):
        found = told(f"known={given}")
        np.testing.assert_array_equal(found.mean, prior_of(paper, {"torque_gain": {"gain": 0.5}}).mean)


@pytest.mark.parametrize("words", [("method=pilco",), ("robust=none",), ("method=lqr",)])
def test_it_is_refused_where_no_policy_is_searched_for_such_robots(paper, tmp_path, words):
    save_distribution(tmp_path / "robot_distribution.pt", prior_of(paper))
    with pytest.raises(ConfigError, match="or choose method=twbal"):
        told(f"known={tmp_path}", *words)


def test_a_file_that_is_not_there_or_of_another_robot_is_refused(paper, tmp_path):
    for given in (tmp_path / "nothing_here", tmp_path):
        with pytest.raises(CheckpointError, match=f"in {given} cannot be used.*run folder of `twbal identify`"):
            told(f"known={given}")
    save_distribution(tmp_path / "robot_distribution.pt", prior_of(paper))
    with pytest.raises(ConfigError, match="is one of robot 'paper'"):
        told(f"known={tmp_path}", "robot=regbot")


def test_iterate_says_nothing_of_going_on_where_it_cannot_begin(tmp_path, capsys):
    assert main(["iterate", "known=nowhere", f"hydra.run.dir={tmp_path / 'run'}"]) == 1
    said = capsys.readouterr()
    assert said.out == ""
    assert "nowhere cannot be used" in said.err
