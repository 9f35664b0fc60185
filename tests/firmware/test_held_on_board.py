"""A robot that something holds while it is driven: the policy on board winds up no more than the one on the host."""

import math
import struct
import subprocess
import threading
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from building import build_folder, make, needs_compiler

from twbal.algorithm.rollout import rollout
from twbal.core.channels import Channels
from twbal.core.course import Target
from twbal.core.episode import Outcome, Provenance
from twbal.core.feed_forward import FeedForward
from twbal.core.motion_limits import MotionLimits
from twbal.core.plant import Observation, Plant
from twbal.embedded.header import Exported, header
from twbal.link.protocol import NEEDED
from twbal.link.serial_plant import SerialPlant
from twbal.policies.saved import load_policy

pytestmark = needs_compiler
POLICY = load_policy(Path(__file__).resolve().parents[2] / "data" / "regression" / "placed.pt")
STEPS, LET_GO, PERIOD, TORQUE_LIMIT = 400, 300, 0.02, 20.0
ORDER, ANSWER = struct.Struct("<cIIff"), struct.Struct("<14f")  # of firmware/boards/posix/physics.h


def sensed(period):
    """Tilt, its rate, wheel angle and wheel rate: held upright in place for 6 s, and then it rolls after its reference.

    The last digits move, as those of a sensor that is not frozen.
    """
    rate = 0.3 if period > LET_GO else 0.0
    values = 1e-4 * (period % 3), 1e-3 * (period % 5), rate * PERIOD * max(period - LET_GO, 0) / 0.15, rate / 0.15
    return tuple(float(np.float32(value)) for value in values)


class Forward:
    """Half a metre a second, a second after the start."""

    limits, give_way = MotionLimits(speed=1.0, acceleration=0.5, jerk=2.0), 0.3

    def target(self, time):
        return Target(speed=0.5 if time > 1.0 else 0.0)


class Held(Plant):
    """That robot, driven from here."""

    control_period, command_limit, _period = PERIOD, TORQUE_LIMIT, 0

    def reset(self, trial):
        self._period = 0
        return self._seen()

    def step(self, command):
        self._period += 1
        return self._seen()

    def stop(self):
        pass

    def close(self):
        pass

    def _seen(self):
        tilt, tilt_rate, wheel_angle, wheel_rate = sensed(self._period)
        return Observation(self._period * PERIOD, tilt, tilt_rate, 0.0, wheel_angle, wheel_rate, 0.0)


def attend(program):
    """Be the body of the firmware's program until it ends."""
    period = 0
    while len(order := program.stdout.read(ORDER.size)) == ORDER.size:
        kind, *_ = ORDER.unpack(order)
        period = 0 if kind == b"R" else period + 1
        tilt, tilt_rate, wheel_angle, wheel_rate = sensed(period)
        values = (tilt, tilt_rate, math.nan, wheel_angle, wheel_rate, *[math.nan] * 9)
        program.stdin.write(ANSWER.pack(*values))
        program.stdin.flush()


@contextmanager
def with_firmware(path):
    """The same robot with the firmware and its policy in it, in lockstep."""
    words = ["held", round(PERIOD * 1e6), TORQUE_LIMIT, 0.0, 1.0, 100_000, 0, int(NEEDED), 60.0]
    pipes = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.PIPE)
    with subprocess.Popen([path, *map(str, words)], **pipes) as program:
        port = program.stderr.readline().decode().split()[1]
        body = threading.Thread(target=attend, args=[program])
        body.start()
        try:
            with SerialPlant.open(port, 921600, 30.0, 30.0, 30.0, on_board=True) as plant:
                yield plant
        finally:
            program.terminate()
            body.join()


def driven(plant, channels, feed_forward):
    provenance = Provenance("held", "robot")
    return rollout(plant, POLICY, channels, STEPS, 0.5236, provenance, Forward(), feed_forward=feed_forward)


@pytest.fixture(scope="module")
def both(paper):
    """The episodes of the policy here and on board."""
    channels, feed_forward = Channels(POLICY.channels, paper.wheel_radius, PERIOD), FeedForward.of_robot(paper)
    folder = build_folder() / "held_on_board"
    folder.mkdir()
    (folder / "policy.h").write_text(header(Exported(POLICY, channels, PERIOD, "held", "By a test.", feed_forward)))
    make("all", f"POLICY={folder}", folder=folder)
    with with_firmware(folder / "robot_posix") as plant:
        on_board = driven(plant, channels, feed_forward)
    return driven(Held(), channels, feed_forward), on_board


def test_a_robot_that_is_held_and_let_go_gets_the_same_commands_from_the_policy_on_board(both):
    here, on_board = both
    assert (here.outcome, on_board.outcome) == (Outcome.COMPLETED,) * 2
    assert [event.text for event in here.events] == ["the reference gives way", "the reference goes on"]
    assert on_board.events == here.events
    np.testing.assert_allclose(on_board.commands, here.commands, atol=1e-3)


def test_while_it_is_held_its_command_does_not_grow(both):
    _, on_board = both
    since = round(4.0 / PERIOD)
    held = np.abs(on_board.commands[since:LET_GO])
    assert held.max() - held.min() < 0.1 < 3.0 < held.min()
