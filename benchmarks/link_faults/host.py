"""The host of a trial: `twbal real-rollout` as a process of its own, started by a fork because imports take seconds."""

import os
import signal
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

from twbal.cli.main import main

KILLED = 137
"""What shells say of a command that `kill -9` ended."""


def get_ready(words: Sequence[str]) -> None:
    """Import what hosts need, by a command line that ends with an error."""
    with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
        main(words)


class Host:
    """A command line of twbal that runs.

    Args:
        command: runs it, and returns its exit code.
        folder: for what it prints.
    """

    def __init__(self, command: Callable[[], int], folder: Path) -> None:
        self._out, self._err = folder / "out", folder / "err"
        self.pid, self._code = os.fork(), -1
        self._since = time.monotonic()
        if not self.pid:
            self._run(command)

    def _run(self, command: Callable[[], int]) -> None:
        """In the process itself; it never returns."""
        code = 1
        try:
            os.setsid()
            os.closerange(3, 1024)  # the line's ends, which would hide that its port has vanished
            for number, file in ((1, self._out), (2, self._err)):
                os.dup2(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
            code = command()
            sys.stdout.flush()
            sys.stderr.flush()
        except BaseException:
            traceback.print_exc()
            sys.stderr.flush()
        finally:
            os._exit(code)

    @property
    def seconds(self) -> float:
        """Since it was started [s]."""
        return time.monotonic() - self._since

    @property
    def has_ended(self) -> bool:
        """Whether it has."""
        if self._code < 0:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            code = os.waitstatus_to_exitcode(status)
            self._code = (code if code >= 0 else KILLED) if pid else -1
        return self._code >= 0

    @property
    def code(self) -> int:
        """Its exit code."""
        return self._code

    def kill(self) -> None:
        """End it as `kill -9` does."""
        os.kill(self.pid, signal.SIGKILL)

    @property
    def complaints(self) -> list[str]:
        """Lines of its standard error."""
        return self._err.read_text().splitlines()

    @property
    def words(self) -> str:
        """What it printed."""
        return self._out.read_text()
