"""Ctrl-C and its kin, made safe for a robot that drives."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

STOPPING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""Ctrl-C, a polite kill, and a terminal that is closed."""


@contextmanager
def stopped_once() -> Iterator[None]:
    """Let the first of `STOPPING` raise KeyboardInterrupt in the body, and let all that follow it change nothing.

    The way out of a rollout switches the motors off and logs the episode so far; who presses Ctrl-C twice must not cut
    that short, and a closed terminal must go the same way. A signal that this process was told to ignore stays ignored.
    Outside of the main thread, where signals do not arrive, nothing is changed.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    stopped = False

    def stop(number: int, frame: FrameType | None) -> None:
        nonlocal stopped
        if not stopped:
            stopped = True
            raise KeyboardInterrupt

    before = {number: signal.getsignal(number) for number in STOPPING}
    heard = [number for number, handler in before.items() if handler is not signal.SIG_IGN]
    try:
        for number in heard:
            signal.signal(number, stop)
        yield
    finally:
        for number in heard:
            signal.signal(number, before[number])


@contextmanager
def on_hang_up(act: Callable[[], None]) -> Iterator[None]:
    """Let a terminal that is closed (SIGHUP) call `act` in the body, and nothing else.

    As in `stopped_once`, it stays ignored where it was, and nothing is changed outside of the main thread.
    """
    outside = threading.current_thread() is not threading.main_thread()
    if outside or signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
        yield
        return
    before = signal.signal(signal.SIGHUP, lambda number, frame: act())
    try:
        yield
    finally:
        signal.signal(signal.SIGHUP, before)
