"""A line alone: two processes with real-time priority pass as many bytes as a telemetry has there and back.

What a pseudo-terminal takes longer than a socket is Linux's own: a worker thread of ordinary priority carries the bytes
of every terminal and serial port from one end to the other (`flush_to_ldisc` of drivers/tty/tty_buffer.c). Beside busy
programs it waits for its turn, whatever priority both ends have; `pty_first` has it go before them.
"""

import json
import os
import pty
import select
import socket
import sys
import time
import tty
from contextlib import nullcontext
from typing import Any

from benchmarks.latency.figures import distribution
from benchmarks.latency.load import busy
from benchmarks.latency.robot import PRIORITY
from twbal.link.line_workers import line_workers_first

LINES = ("pty", "pty_first", "socket")
_SIZE, _PERIOD = 90, 0.01  # of a telemetry with its frame [bytes], and between two [s]


def run(load: int, line: str, seconds: float) -> dict[str, Any]:
    """Pass bytes for `seconds`, with programs that compute beside it."""
    here, there = _ends(line)
    with busy(load), line_workers_first() if line == "pty_first" else nullcontext():
        echo = os.fork()
        if echo == 0:
            _echo(there)
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(PRIORITY))
        found = [_round_trip(here) for _ in range(round(seconds / _PERIOD))]
        os.close(here)
        os.kill(echo, 9)
        os.waitpid(echo, 0)
    return {"seconds": seconds, **distribution(found, _PERIOD)}


def _ends(line: str) -> tuple[int, int]:
    if line == "socket":
        one, other = socket.socketpair()
        return one.detach(), other.detach()
    master, slave = pty.openpty()
    tty.setraw(slave)
    return master, slave


def _echo(end: int) -> None:
    """Send back what comes, until it is ended."""
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY - 10))
    while data := _read(end):
        os.write(end, data)
    os._exit(0)


def _read(end: int) -> bytes:
    select.select([end], [], [])
    return os.read(end, _SIZE)


def _round_trip(end: int) -> float:
    time.sleep(_PERIOD)
    begun, got = time.monotonic(), 0
    os.write(end, bytes(_SIZE))
    while got < _SIZE:
        got += len(_read(end))
    return time.monotonic() - begun


if __name__ == "__main__":
    print(json.dumps(run(**json.loads(sys.argv[1]))))
