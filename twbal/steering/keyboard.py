"""The terminal of the person who steers; put back as it was on every way out."""

import os
import sys
import termios
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, Self

from twbal.core.errors import ConfigError
from twbal.steering.keys import KeyDecoder
from twbal.steering.request import Key, Sticks
from twbal.steering.source import TERMINAL, Source

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

    name = TERMINAL

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
        now[_CHARACTERS][termios.VMIN], now[_CHARACTERS][termios.VTIME] = 1, 0
        _forget_halting_keys(now)
        termios.tcsetattr(self._terminal, termios.TCSANOW, now)
        return self

    def __exit__(self, *exception: object) -> None:
        with suppress(termios.error):  # a terminal that is gone needs nothing
            termios.tcflush(self._terminal, termios.TCIFLUSH)  # keys that were held down are not for the shell
            termios.tcsetattr(self._terminal, termios.TCSANOW, self._before)

    def read(self, time: float) -> list[Key | Sticks]:
        """The keys that were pressed; see `Source.read`."""
        return list(self._decoder.feed(self._bytes(self._terminal, 1024), time))


@contextmanager
def without_halting_keys(terminal: int | None = None) -> Iterator[None]:
    r"""Let a terminal know none of Ctrl-Z, Ctrl-\ and Ctrl-S in the body, while a gamepad steers.

    Nothing is changed where there is no terminal, or where it belongs to another program at present.

    Args:
        terminal: file descriptor; standard input where None.
    """
    found = _standard_input() if terminal is None else terminal
    if found is None or not os.isatty(found) or not _is_ours(found):
        yield
        return
    before, now = termios.tcgetattr(found), termios.tcgetattr(found)
    _forget_halting_keys(now)
    termios.tcsetattr(found, termios.TCSANOW, now)
    try:
        yield
    finally:
        with suppress(termios.error):  # a terminal that is gone needs nothing
            termios.tcsetattr(found, termios.TCSANOW, before)


def _forget_halting_keys(modes: list[Any]) -> None:
    modes[_IFLAG] &= ~termios.IXON
    modes[_CHARACTERS][termios.VSUSP] = modes[_CHARACTERS][termios.VQUIT] = _OFF


def _is_ours(terminal: int) -> bool:
    """Whether this process may set a terminal: one in the background would be halted (SIGTTOU)."""
    try:
        return os.tcgetpgrp(terminal) == os.getpgrp()
    except OSError:  # it is not the terminal that started this process, so it does not halt it
        return True


def _standard_input() -> int | None:
    try:
        return sys.stdin.fileno()
    except (AttributeError, OSError, ValueError):  # there is none, or it is closed
        return None
