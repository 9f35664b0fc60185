"""The robot of a trial, as a process: twbal's virtual robot, whose sensors can fail, and which can start anew.

    python -m benchmarks.link_faults.robot <folder> <program or -> [settings of twbal virtual-robot]

It says its port in `folder`/port, each time that it starts. What its motors got, and its true tilt, stand in
`folder`/steps: a line for each control period since it was put at its start. `folder`/sensors says which sensors fail
in the next rollout, and how. SIGUSR1 is a reset of its board: all that it knew is lost, and its port for a while.
"""

import os
import signal
import sys
import time
from collections.abc import Sequence
from contextlib import closing, redirect_stdout
from io import StringIO
from math import nan
from pathlib import Path
from types import FrameType

from hydra import compose

from twbal.cli.composition import composing
from twbal.cli.stages.virtual_robot import identity_of, plant_of
from twbal.core.files import write_atomically
from twbal.core.plant import Observation, Plant, Pose, WheelDifference
from twbal.virtual_robot.firmware import Firmware, Identity
from twbal.virtual_robot.posix_firmware import serve_firmware
from twbal.virtual_robot.pseudo_terminal import PseudoTerminal
from twbal.virtual_robot.server import attend, ended_by_signals

BOOT = 0.3  # of a board that was reset [s]
_IDLE = 1e9  # it ends with who started it [s]


class Watched(Plant):
    """A robot that notes what its motors get, and whose sensors fail when they are told to.

    Args:
        robot: it.
        folder: for its notes.
    """

    turns = True

    def __init__(self, robot: Plant, folder: Path) -> None:
        self.control_period = robot.control_period
        self._robot, self._folder, self._steps = robot, folder, 0
        self._fails, self._from, self._last = "", 0, Observation(*(0.0,) * len(Observation._fields))
        self._notes = (folder / "steps").open("w", buffering=1)

    def reset(self, trial: int) -> Observation:
        """Begin a rollout, and its notes."""
        self._fails, _, begin = (self._folder / "sensors").read_text().partition(" ")
        self._from, self._steps = int(begin or 0), 0
        self._notes.seek(0)
        self._notes.truncate()
        self._last = self._robot.reset(trial)
        return self._last

    def step(self, command: float) -> Observation:
        """Drive for a control period."""
        seen = self._robot.step(command)
        self._steps += 1
        self._notes.write(f"{command!r}\n")
        if self._steps < self._from or not self._fails:
            self._last = seen
            return seen
        kind, _, names = self._fails.partition(":")
        values = {name: nan if kind == "nan" else getattr(self._last, name) for name in names.split(",")}
        return seen._replace(**values)

    def steer(self, difference: float) -> None:
        """See the robot's."""
        self._robot.steer(difference)

    def pose(self) -> Pose | None:
        """The true one."""
        return self._robot.pose()

    def wheel_difference(self) -> WheelDifference | None:
        """See the robot's."""
        return self._robot.wheel_difference()

    def stop(self) -> None:
        """See the robot's."""
        self._robot.stop()

    def close(self) -> None:
        """It stays for when the board has started anew."""


class _Reset(BaseException):
    """The board starts anew."""


def _reset(number: int, frame: FrameType | None) -> None:
    raise _Reset


class _PortFile(StringIO):
    """Keeps the port that is printed to it in a file."""

    def __init__(self, file: Path) -> None:
        super().__init__()
        self._file = file

    def flush(self) -> None:
        """Write the last line."""
        if self.getvalue():
            write_atomically(self._file, self.getvalue().split()[-1])


def _serve(plant: Plant, identity: Identity, program: Path | None, parent: int) -> None:
    """From power-on to a reset."""
    if program is not None:
        serve_firmware(program, plant, identity, _IDLE, parent)
        return
    with closing(PseudoTerminal()) as line:
        print(f"port {line.path}", flush=True)
        attend(line, Firmware(plant, identity), _IDLE, parent)


def main(words: Sequence[str]) -> None:
    """Be a robot until the process that started this one ends, or SIGTERM comes."""
    folder, program, parent = Path(words[0]), None if words[1] == "-" else Path(words[1]), os.getppid()
    with composing():
        cfg = compose("virtual_robot", list(words[2:]))
    plant, identity = Watched(plant_of(cfg), folder), identity_of(cfg)
    signal.signal(signal.SIGUSR1, _reset)
    with ended_by_signals(), redirect_stdout(_PortFile(folder / "port")):
        while os.getppid() == parent:
            try:
                _serve(plant, identity, program, parent)
            except _Reset:
                (folder / "port").unlink(missing_ok=True)
                time.sleep(BOOT)


if __name__ == "__main__":
    main(sys.argv[1:])
