"""A person at a terminal of their own, in which `twbal drive` runs; or at a gamepad, as a pipe of its events."""

import os
import pty
import select
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Self

from benchmarks.latency.robot import environment, period_of, policy, twbal
from benchmarks.latency.timed import ARMED, Times, words
from twbal.core.episode import Episode, Outcome
from twbal.io.logs import read_episode
from twbal.steering.joystick import EVENT

KEYBOARD, GAMEPAD = "keyboard", "gamepad"
RATE = 50
"""Of the control periods [Hz]."""

_AXIS, _SPEED_AXIS = 2, 1  # of joystick events; forward is its negative end, see conf/drive.yaml
_START, _END, _LOOK = 120.0, 60.0, 0.02  # how long a drive may take to begin, to end, and between two looks [s]


class Person:
    """Drives a robot by `twbal drive`, as a context.

    Args:
        port: of the robot.
        folder: for what is written.
        by: `keyboard` or `gamepad`.
        more: settings of the drive.

    Attributes:
        exit_code: of the command, once it has ended; negative: the signal that ended it.
    """

    def __init__(self, port: str, folder: Path, by: str, *more: str) -> None:
        self._folder, self._times, self.exit_code = folder, folder / "times.npz", 0
        told = [f"policy.path={policy(RATE)}", period_of(RATE), f"hydra.run.dir={folder / 'run'}"]
        told += [*words(port, self._times), *more]
        self._pad: int | None = None
        if by == GAMEPAD:
            os.mkfifo(folder / "js0")
            self._pad = os.open(folder / "js0", os.O_RDWR)
            told.append(f"input={folder / 'js0'}")
        self._shown = b""
        self._command = twbal("drive", *told)

    def __enter__(self) -> Self:
        self._process, self._terminal = pty.fork()
        if self._process == 0:
            os.execve(sys.executable, self._command, environment())
        until = time.monotonic() + _START
        while not Path(f"{self._times}{ARMED}").exists():
            self.wait(_LOOK)
            if time.monotonic() > until or os.waitpid(self._process, os.WNOHANG)[0]:
                raise SystemExit(f"{' '.join(self._command)} does not begin:\n{self._shown.decode()}")
        return self

    def __exit__(self, *exception: object) -> None:
        """Wait until the command has ended."""
        until = time.monotonic() + _END
        while time.monotonic() < until:
            ended, status = os.waitpid(self._process, os.WNOHANG)
            if ended:
                self.exit_code = os.waitstatus_to_exitcode(status)
                break
            self.wait(_LOOK)
        else:
            os.kill(self._process, 9)
            os.waitpid(self._process, 0)
            raise SystemExit(f"{' '.join(self._command)} does not end:\n{self._shown.decode()}")
        self.leave_terminal()
        self.lose_pad()

    @property
    def pid(self) -> int:
        """Of the command."""
        return self._process

    def press(self, key: bytes) -> float:
        """Press a key; returns when, on this computer's monotonic clock [s]."""
        now = time.monotonic()
        os.write(self._terminal, key)
        return now

    def push(self, forward: float) -> float:
        """Push the stick, from -1 to 1; returns when [s]."""
        assert self._pad is not None
        now = time.monotonic()
        os.write(self._pad, EVENT.pack(int(1e3 * now) % 2**32, round(-32767 * forward), _AXIS, _SPEED_AXIS))
        return now

    def wait(self, seconds: float) -> None:
        """Let time pass, and look at what is shown, for which there is no room otherwise."""
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0:
            if self._terminal < 0 or not select.select([self._terminal], [], [], left)[0]:
                time.sleep(max(until - time.monotonic(), 0.0))
                continue
            try:
                self._shown = (self._shown + os.read(self._terminal, 4096))[-4000:]
            except OSError:  # nobody is at the other end any more
                time.sleep(max(until - time.monotonic(), 0.0))

    def leave_terminal(self) -> float:
        """Close the terminal; returns when [s]."""
        now = time.monotonic()
        if self._terminal >= 0:
            with suppress(OSError):
                os.close(self._terminal)
            self._terminal = -1
        return now

    def lose_pad(self) -> float:
        """Unplug the gamepad; returns when [s]."""
        now = time.monotonic()
        if self._pad is not None:
            os.close(self._pad)
            self._pad = None
        return now

    def recorded(self) -> tuple[Episode, Times]:
        """What the command wrote, once it has ended; a drive that lost its robot tells nothing of the person."""
        (log,) = (self._folder / "run").glob("*/*.mcap")
        episode = read_episode(log)
        if episode.outcome is Outcome.LINK_LOST:
            why = episode.events[-1].text
            raise SystemExit(f"The drive lost the robot after {episode.duration:.1f} s; is other work running? {why}")
        return episode, Times.read(self._times)
