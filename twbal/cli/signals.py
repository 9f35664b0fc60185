"""Ctrl-C and its kin, made safe for a robot that drives."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

_NEVER_INTERRUPTED = ("numba.core.serialize", "namedtuple_", "llvmlite.")
"""How modules are called that make named tuples of what a kernel returns, and the one that loads its machine code."""
_SOON_S = 0.001

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
        if not stopped and not _comes_again(number, frame):
            stopped = True
            raise KeyboardInterrupt

    before = {number: signal.getsignal(number) for number in STOPPING}
    # None is a handler that Python did not install, and cannot put back.
    heard = [number for number, handler in before.items() if handler not in (signal.SIG_IGN, None)]
    try:
        for number in heard:
            signal.signal(number, stop)
        yield
    finally:
        for number in heard:
            signal.signal(number, before[number])


@contextmanager
def interruptible() -> Iterator[None]:
    """Let Ctrl-C raise KeyboardInterrupt in the body, also where it comes while a compiled kernel runs.

    Numba does not look whether the Python code failed that turns a kernel's result into named tuples: an exception
    there is a segmentation fault. One in llvmlite makes it free memory twice. So Ctrl-C waits for the end of that code.
    Nothing is changed outside of the main thread, and where something else than Python's own handler hears Ctrl-C.
    """
    outside = threading.current_thread() is not threading.main_thread()
    if outside or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return

    def interrupt(number: int, frame: FrameType | None) -> None:
        if not _comes_again(number, frame):
            raise KeyboardInterrupt

    signal.signal(signal.SIGINT, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def end_at_next_interrupt() -> None:
    """Let the next Ctrl-C end this process at once, as nothing is left to be done but to say that it was stopped."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.SIG_DFL)


def _comes_again(number: int, frame: FrameType | None) -> bool:
    """Whether a signal came where no exception may be raised: it is then sent once more, a little later."""
    while frame is not None:
        if str(frame.f_globals.get("__name__")).startswith(_NEVER_INTERRUPTED):
            # Not from here: its handler would be called within this one, again and again.
            threading.Timer(_SOON_S, signal.raise_signal, [number]).start()
            return True
        frame = frame.f_back
    return False


@contextmanager
def never_suspended() -> Iterator[None]:
    """Let SIGTSTP, which Ctrl-Z sends, change nothing in the body, also not for programs that are started in it.

    Outside of the main thread, where signals cannot be set, nothing is changed.
    """
    before = signal.getsignal(signal.SIGTSTP)
    if threading.current_thread() is not threading.main_thread() or before is None:
        yield
        return
    signal.signal(signal.SIGTSTP, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGTSTP, before)


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
