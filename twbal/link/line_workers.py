"""Lets the threads of Linux that carry the bytes of serial lines go before ordinary programs.

A worker thread of the kernel, of ordinary priority, carries the bytes of every terminal and serial port from one end
to the other (`flush_to_ldisc` in Linux's drivers/tty/tty_buffer.c). Beside busy programs it waits for its turn, up to
some milliseconds, whatever priority the programs at both ends have.

This file is a program of its own as well: `line_workers_first` runs it. It raises the threads, and those that Linux
adds later, until its standard input is closed. Then it puts all of them back: so also where the command that needed it
was killed. It imports nothing of twbal, so that it starts at once.
"""

import os
import select
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

PRIORITY = 1
"""Of the threads, among 1 to 99: the least that goes before ordinary programs."""

NAMES = "kworker/u"
"""What the names begin with of those workers that may run on any core, as that of serial lines does."""

_PARENT = 2  # the process that all threads of the kernel descend from
_LOOK = 0.5  # how often to look for new ones [s]
_READY = "ready"


@contextmanager
def line_workers_first() -> Iterator[bool]:
    """Let those threads go before ordinary programs in the body, where the system allows it (CAP_SYS_NICE).

    Yields:
        Whether they do.
    """
    if not may_raise():
        yield False
        return
    command = [sys.executable, "-I", "-S", __file__]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True
    ) as helper:
        assert helper.stdin is not None and helper.stdout is not None
        is_ready = helper.stdout.readline().strip() == _READY
        try:
            yield is_ready
        finally:
            helper.stdin.close()
            helper.wait()


def may_raise() -> bool:
    """Whether this process may set the priority of the kernel's threads: tried with a change that is none."""
    try:
        os.sched_setscheduler(_PARENT, os.sched_getscheduler(_PARENT), os.sched_getparam(_PARENT))
    except (OSError, AttributeError):  # not allowed, or not Linux
        return False
    return bool(workers())


def workers() -> list[int]:
    """Process numbers of those threads."""
    return [int(entry.name) for entry in Path("/proc").iterdir() if entry.name.isdigit() and _is_worker(entry)]


def _is_worker(entry: Path) -> bool:
    with suppress(OSError):  # it has ended since
        return (entry / "comm").read_text().startswith(NAMES)
    return False


def _raise(raised: set[int]) -> None:
    for number in set(workers()) - raised:
        with suppress(OSError):
            if os.sched_getscheduler(number) == os.SCHED_OTHER:
                os.sched_setscheduler(number, os.SCHED_FIFO, os.sched_param(PRIORITY))
                raised.add(number)


def _put_back(raised: set[int]) -> None:
    for number in raised.intersection(workers()):
        with suppress(OSError):
            os.sched_setscheduler(number, os.SCHED_OTHER, os.sched_param(0))


def main() -> None:
    """Raise them until the standard input is closed."""
    for each in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(each, signal.SIG_IGN)  # who started it says when it ends, and is ended by these itself
    raised: set[int] = set()
    try:
        _raise(raised)
        print(_READY, flush=True)
        while not select.select([sys.stdin], [], [], _LOOK)[0]:
            _raise(raised)
    finally:
        _put_back(raised)


if __name__ == "__main__":
    main()
