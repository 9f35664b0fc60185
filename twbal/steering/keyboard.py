"""The terminal of the person who steers; put back as it was on every way out."""

import os
import sys
import termios
from contextlib import suppress
from typing import Any, Self

from twbal.core.errors import ConfigError
from twbal.steering.keys import KeyDecoder
from twbal.steering.request import Key, Sticks
from twbal.steering.source import Source

_LFLAG, _IFLAG, _CHARACTERS = 3, 0, 6  # of what tcgetattr returns
_OFF = b"\0"  # in place of a character that means something to the terminal (POSIX: _POSIX_VDISABLE on Linux)


class Keyboard(Source):
    r"""Keys as they are pressed, while it is a context.

    In it the terminal shows nothing that is typed, waits for no Enter, and knows none of Ctrl-Z, Ctrl-\ and Ctrl-S,
    which would leave a balancing robot alone. Ctrl-C it knows.

    Args:
        terminal: file descriptor; standard input where None.

    Raises:
        ConfigError: it is no terminal.
    """

    name = "terminal"

    def __init__(self, terminal: int | None = None) -> None:
        found = _standard_input() if terminal is None else terminal
        if found is None or not os.isatty(found):
            raise ConfigError(
                "A robot is steered by keys, but standard input is no terminal (a pipe, a file or nothing). Run this "
                "command in a terminal, or give a gamepad by input=/dev/input/js0."
            )
        self._terminal, self._decoder = found, KeyDecoder()
        self._before: list[Any] = []

    def __enter__(self) -> Self:
        self._before = termios.tcgetattr(self._terminal)
        now = termios.tcgetattr(self._terminal)
        now[_LFLAG] &= ~(termios.ECHO | termios.ICANON)
        now[_IFLAG] &= ~termios.IXON
        now[_CHARACTERS][termios.VMIN], now[_CHARACTERS][termios.VTIME] = 1, 0
        now[_CHARACTERS][termios.VSUSP] = now[_CHARACTERS][termios.VQUIT] = _OFF
        termios.tcsetattr(self._terminal, termios.TCSANOW, now)
        return self

    def __exit__(self, *exception: object) -> None:
        with suppress(termios.error):  # a terminal that is gone needs nothing
            termios.tcflush(self._terminal, termios.TCIFLUSH)  # keys that were held down are not for the shell
            termios.tcsetattr(self._terminal, termios.TCSANOW, self._before)

    def lose(self) -> None:
        """Take it that the terminal is gone."""
        self.lost = True

    def read(self, time: float) -> list[Key | Sticks]:
        """The keys that were pressed; see `Source.read`."""
        return list(self._decoder.feed(self._bytes(self._terminal, 1024), time))


def _standard_input() -> int | None:
    try:
        return sys.stdin.fileno()
    except (AttributeError, OSError, ValueError):  # there is none, or it is closed
        return None
