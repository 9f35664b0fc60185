"""The rehearsal of `twbal check-link` in docs/firmware.md: the firmware in a hand, and a person at both terminals."""

import io
import subprocess
import sys

import pytest
from building import needs_compiler, program

from twbal.cli.main import main

pytestmark = [needs_compiler, pytest.mark.slow, pytest.mark.usefixtures("as_from_a_shell")]
QUICK = ("exchanges=20", "rest=0.5", "hand_time=2.5", "link.timeout=2", "hydra.run.dir=out")


class Person(io.StringIO):
    """Presses Enter where this program asks, and then a key of the robot's terminal."""

    def __init__(self, robot, keys):
        super().__init__()
        self._robot, self._keys = robot, iter(keys)

    def isatty(self):
        return True

    def readline(self, *limit):
        if key := next(self._keys):
            self._robot.stdin.write(f"{key}\n")
            self._robot.stdin.flush()
        return "\n"


def test_the_firmware_in_a_hand_passes_and_its_sheet_is_written(monkeypatch, capsys):
    words = ["virtual-robot", "robot=esp32", "held=true", "clock=real_time", f"firmware={program()}"]
    command = [sys.executable, "-m", "twbal", *words]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1) as robot:
        try:
            port = next(line for line in robot.stdout if line.startswith("port ")).split()[1]
            monkeypatch.setattr(sys, "stdin", Person(robot, ["", "l", "a", "d", "t"]))
            assert main(["check-link", "robot=esp32", "link=serial", f"link.port={port}", *QUICK]) == 0
        finally:
            robot.terminate()
    said = capsys.readouterr().out
    for row in (
        "sensors at rest",
        "tilt sign",
        "left wheel sign",
        "right wheel sign",
        "yaw rate sign",
        "torque sign",
        "watchdog",
    ):
        assert f"ok       {row}" in said
    assert "next  twbal lqr --config-dir=my_conf robot=my_esp32" in said
