"""Starts the process of a live view, and tells it of a drive without ever waiting for it."""

import importlib.util
import json
import os
import select
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Self
from urllib.parse import urlsplit

from twbal.core.errors import ConfigError, install_advice
from twbal.core.robot_parameters import RobotParameters
from twbal.viz.live.dropping import DroppingQueue
from twbal.viz.live.sample import Sample, encoded
from twbal.viz.live.shape import Shape

WINDOW, FILE, ADDRESS, READY = "window", "file", "rerun+http", "ready"
CAPACITY = 65536
"""Of the queue [bytes]: 744 samples, some 15 s at 50 Hz, after which what is new is dropped."""
_START, _END = 120.0, 60.0  # how long it may take to begin, and to write what it has [s]
_ANSWER, _PORT = 3.0, 9876  # of a viewer, until it answers [s], and where it does unless told otherwise
_TAIL = 600  # of its last words, for messages [bytes]


class LiveView:
    """A process that draws a drive. Everything that may take time happens before the drive and after it.

    Args:
        command: program and arguments; reads samples from standard input, and prints `ready` once it can.
        start_timeout: how long that may take [s].
        end_timeout: how long it may take to end, once nothing more comes [s].

    Raises:
        ConfigError: it did not begin; the message has its last words.
    """

    def __init__(self, command: Sequence[str], start_timeout: float = _START, end_timeout: float = _END) -> None:
        self._end_timeout = end_timeout
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115, a pipe that nobody empties would block it; closed below
        reading, writing = os.pipe()
        self._queue = DroppingQueue(writing, CAPACITY)
        try:
            self._process = subprocess.Popen(
                command,
                stdin=reading,
                stdout=subprocess.PIPE,
                bufsize=0,
                stderr=self._errors,
                start_new_session=True,  # Ctrl-C is for the host, which then ends the view in good order
            )
        finally:
            os.close(reading)
        try:
            self._wait_for_start(start_timeout)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    @property
    def pid(self) -> int:
        """Of the process."""
        return self._process.pid

    def show(self, sample: Sample) -> None:
        """Have a sample drawn, if there is room for it in the queue."""
        self._queue.put(encoded(sample))

    def close(self) -> str | None:
        """Have it draw the rest, and end it; safe to call twice.

        Returns:
            what a person should know of it; None: all was drawn.
        """
        self._queue.close()
        if self._errors.closed:
            return None
        try:
            code = self._process.wait(self._end_timeout)
            ended = "" if code == 0 else f"it ended with exit code {code}: {self._tail()}"
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
            ended = f"it did not end within {self._end_timeout:g} s"
        if self._process.stdout is not None:
            self._process.stdout.close()
        self._errors.close()
        dropped, sent = self._queue.dropped, self._queue.dropped + self._queue.taken
        lacks = f"the live view lacks {dropped} of {sent} control periods" if dropped else ""
        return "; ".join(filter(None, (lacks, ended and f"the live view failed: {ended}"))) or None

    def _wait_for_start(self, timeout: float) -> None:
        assert self._process.stdout is not None
        until = time.monotonic() + timeout
        said = b""
        while select.select([self._process.stdout], [], [], max(until - time.monotonic(), 0.0))[0]:
            data = os.read(self._process.stdout.fileno(), 4096)
            said += data
            if READY.encode() in said.split(b"\n"):
                return
            if not data:
                self._process.wait()
                raise ConfigError(f"The live view did not start; its last words: {self._tail()}")
        raise ConfigError(f"The live view was not ready within {timeout:g} s; its last words: {self._tail()}")

    def _tail(self) -> str:
        size = self._errors.seek(0, os.SEEK_END)
        self._errors.seek(max(0, size - _TAIL))
        return self._errors.read().decode(errors="replace").strip().rpartition("\n")[2] or "none"


def check_installed() -> None:
    """Raise ConfigError where Rerun is not installed."""
    if importlib.util.find_spec("rerun") is None:
        raise ConfigError(f"This needs rerun-sdk: {install_advice('viewers')}; or leave it out.")


def check_target(target: str) -> None:
    """Check that a live view can be drawn, before a robot waits for it.

    Args:
        target: `window`, `file`, or the address of a viewer.

    Raises:
        ConfigError: it is none of these, Rerun is not installed, there is no screen for a window, or nobody answers
            at the address.
    """
    if target not in (WINDOW, FILE) and not target.startswith(ADDRESS):
        raise ConfigError(
            f"view is window, file, or the address of a viewer such as {ADDRESS}://127.0.0.1:9876/proxy; found "
            f"{target!r}."
        )
    check_installed()
    if target.startswith(ADDRESS):
        _check_answered(target)
    if target == WINDOW and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise ConfigError(
            "view=window needs a screen, and there is none (neither DISPLAY nor WAYLAND_DISPLAY is set). Write a "
            f"recording by view=file, or give the address of a viewer on another computer, {ADDRESS}://...:9876/proxy."
        )


def _check_answered(address: str) -> None:
    """Rerun itself tries on and on without a word."""
    try:
        parts = urlsplit(address)
        with socket.create_connection((parts.hostname or "", parts.port or _PORT), _ANSWER):
            return
    except (OSError, ValueError) as error:
        raise ConfigError(
            f"No viewer answers at {address} ({error}). Start `rerun` there first, and let its port through."
        ) from error


def view_command(robot: RobotParameters, target: str | Path) -> list[str]:
    """The command line of a live view of a robot; see `twbal.viz.live.__main__`."""
    shape = json.dumps(Shape.of(robot)._asdict())
    return [sys.executable, "-m", "twbal.viz.live", shape, str(target)]
