"""The firmware as a program; `tests/firmware` drives it."""

import os
import time

import pytest

from twbal.core.errors import ConfigError
from twbal.core.plant import Observation, Plant
from twbal.link.protocol import Clock
from twbal.virtual_robot import posix_firmware
from twbal.virtual_robot.firmware import Identity
from twbal.virtual_robot.posix_firmware import serve_firmware

ME = Identity("still", torque_limit=20.0, tilt_limit=1.0, watchdog=0.1, clock=Clock.LOCKSTEP)


class Still(Plant):
    """A robot at rest."""

    control_period = 0.02

    def reset(self, trial):
        return Observation(*[0.0] * 7)

    def step(self, command):
        return Observation(*[0.0] * 7)

    def stop(self):
        pass

    def close(self):
        pass


@pytest.mark.parametrize(
    ("script", "said"),
    [
        ("exec sleep 60", "it says nothing"),
        ("printf half >&2; exec sleep 60", "half"),
        ("exit 1", "it says nothing"),
        ("echo another firmware >&2; exec sleep 60", "another firmware"),
    ],
    ids=["silent", "half a line", "ends", "another program"],
)
def test_a_program_that_does_not_say_its_port_in_time_is_an_error_and_is_ended(script, said, tmp_path, monkeypatch):
    monkeypatch.setattr(posix_firmware, "_STARTS", 0.5)
    program = tmp_path / "program"
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(0o755)
    begun = time.monotonic()
    with pytest.raises(ConfigError, match=rf"The firmware .*program does not start: {said}\."):
        serve_firmware(program, Still(), ME, 1.0, os.getppid())
    assert time.monotonic() - begun < 20.0
