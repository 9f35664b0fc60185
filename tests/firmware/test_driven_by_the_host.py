"""The firmware's program over MuJoCo's physics is driven as the robot in Python is, policy here or on board."""

import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from building import build_folder, make, needs_compiler, program

from twbal.algorithm.rollout import rollout
from twbal.core.channels import Channels
from twbal.core.course import Target
from twbal.core.episode import Outcome, Provenance
from twbal.core.errors import ConfigError, LinkLostError
from twbal.core.feed_forward import FeedForward
from twbal.core.motion_limits import MotionLimits
from twbal.embedded.header import Exported, header
from twbal.link.serial_plant import SerialPlant
from twbal.policies.saved import load_policy
from twbal.virtual_robot.process import launch, virtual_robot_command

pytestmark = needs_compiler
POLICY = load_policy(Path(__file__).resolve().parents[2] / "data" / "regression" / "policy.pt")
CHANNELS = Channels(POLICY.channels, 0.15, 0.02)
START, PATIENCE = 240.0, 30.0


class Forward:
    """A third of a metre a second, as soon as may be."""

    limits, give_way = MotionLimits(speed=0.5, acceleration=0.5, jerk=2.0), 1.0

    def target(self, time):
        return Target(speed=0.3)


@contextmanager
def robot(*words, on_board=False):
    command = virtual_robot_command(["faults=light", "seed=4", *words])
    with (
        launch(command, START) as port,
        SerialPlant.open(port, 921600, PATIENCE, PATIENCE, PATIENCE, on_board=on_board) as plant,
    ):
        yield plant


def driven(plant, trial=1, steps=120, targets=None, feed_forward=None):
    provenance = Provenance(plant.robot_name, "robot", trial=trial)
    return rollout(plant, POLICY, CHANNELS, steps, 0.5236, provenance, targets, feed_forward=feed_forward)


@pytest.fixture(scope="module")
def with_policy(paper):
    """The program with the policy on board."""
    folder = build_folder() / "on_board"
    folder.mkdir()
    exported = Exported(POLICY, CHANNELS, 0.02, "paper", "Made by a test.", FeedForward.of_robot(paper))
    (folder / "policy.h").write_text(header(exported))
    make("all", f"POLICY={folder}", folder=folder)
    return folder / "robot_posix"


@pytest.fixture(scope="module")
def in_python():
    with robot() as plant:
        return driven(plant)


def test_an_episode_is_the_same_bit_by_bit(in_python):
    with robot(f"firmware={program()}") as plant:
        assert plant.version == 2
        found = driven(plant)
    assert found.outcome is Outcome.COMPLETED
    for name in ("observations", "states", "commands", "poses"):
        np.testing.assert_array_equal(getattr(found, name), getattr(in_python, name))


def test_the_policy_on_board_drives_as_the_one_here_within_single_precision(in_python, with_policy):
    with robot(f"firmware={with_policy}", on_board=True) as plant:
        found = driven(plant)
    assert found.outcome is Outcome.COMPLETED
    np.testing.assert_allclose(found.commands, in_python.commands, atol=2e-3)
    np.testing.assert_allclose(found.observations, in_python.observations, atol=2e-3)
    assert np.any(found.commands != in_python.commands)  # what was applied, not what this computer would have


@pytest.mark.slow
def test_the_policy_on_board_follows_the_hosts_reference(with_policy, paper):
    """A speed is an error for a policy without place; what it commands differs from standing as the host's own does."""
    with robot(f"firmware={with_policy}", on_board=True) as plant:
        on_board = driven(plant, steps=80, targets=Forward())
        standing = driven(plant, steps=80)
    with robot() as plant:
        here = driven(plant, steps=80, targets=Forward(), feed_forward=FeedForward.of_robot(paper))
        without = driven(plant, steps=80, targets=Forward())
    np.testing.assert_allclose(on_board.commands, here.commands, atol=5e-3)
    assert np.abs(on_board.commands - without.commands[: len(on_board.commands)]).max() > 0.1  # the board feeds forward
    assert np.abs(on_board.commands - standing.commands[: len(on_board.commands)]).max() > 0.1


@pytest.mark.slow
def test_a_robot_without_a_policy_on_board_is_told_how_to_get_one():
    message = r"has no policy on board\. Export one by `twbal export-policy`"
    with pytest.raises(ConfigError, match=message), robot(f"firmware={program()}", on_board=True):
        pass


@pytest.mark.slow
def test_a_host_that_pauses_loses_the_robot_but_not_one_with_its_policy_on_board(with_policy):
    with robot(f"firmware={program()}", "clock=real_time") as plant:
        plant.reset(1)
        plant.step(0.0)
        time.sleep(0.4)
        with pytest.raises(LinkLostError, match="its watchdog"):
            plant.step(0.0)
    with robot(f"firmware={with_policy}", "clock=real_time", on_board=True) as plant:
        plant.reset(1)
        for _ in range(3):
            time.sleep(0.4)
            seen = plant.step(0.0)
        assert abs(seen.tilt) < 0.5236
        assert plant.missed_periods > 30


@pytest.mark.slow
@pytest.mark.parametrize("words", [["firmware=nowhere/robot"], ["firmware=/bin/true"], ["protocol=1"]])
def test_a_program_that_cannot_run_is_one_clear_error(words):
    if words == ["protocol=1"]:
        words = [f"firmware={program()}", "protocol=1"]
    done = subprocess.run(
        [sys.executable, "-m", "twbal", "virtual-robot", *words], capture_output=True, text=True, timeout=START
    )
    assert done.returncode == 1
    assert done.stderr.startswith("twbal: error: ")
    assert done.stderr.count("\n") == 1
    assert done.stdout == ""
