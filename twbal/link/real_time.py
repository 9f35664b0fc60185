"""A loop that has to answer in time.

It goes before other programs, as do the threads of Linux that carry its bytes; it collects no garbage, and lets no core
sleep.
"""

import gc
import os
import struct
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from twbal.link.line_workers import line_workers_first

PRIORITY = 50
"""Of a loop in real time, among 1 to 99: above other programs, below the threads of Linux that serve interrupts."""

WAKE_UP = Path("/dev/cpu_dma_latency")
"""Where Linux is told how long a core may take to wake up, as long as the file is held open (PM QoS)."""


@contextmanager
def uncollected() -> Iterator[None]:
    """Collect no garbage in the body: what is there is collected before, and what the body leaves after it.

    A collection visits every object that the libraries made, which takes longer than a control period. What the loops
    of twbal drop has no cycles, and is freed at once all the same.
    """
    was_enabled = gc.isenabled()
    gc.collect()
    gc.freeze()
    gc.disable()
    try:
        yield
    finally:
        gc.unfreeze()
        if was_enabled:
            gc.enable()


@contextmanager
def real_time_priority() -> Iterator[bool]:
    """Let this thread go before other programs in the body, where the system allows it (`sched(7)`, SCHED_FIFO).

    A thread that has real-time priority already keeps its own. Processes that are started in the body do not have it.

    Yields:
        Whether the thread has it.
    """
    if not hasattr(os, "sched_setscheduler"):  # not Linux
        yield False
        return
    policy, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    if policy & ~os.SCHED_RESET_ON_FORK in (os.SCHED_FIFO, os.SCHED_RR):
        yield True
        return
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(PRIORITY))
    except OSError:
        yield False
        return
    try:
        yield True
    finally:
        with suppress(OSError):  # to lower it is allowed; only root may take the flag away, too
            os.sched_setscheduler(0, policy | os.SCHED_RESET_ON_FORK, parameters)
            os.sched_setscheduler(0, policy, parameters)


@contextmanager
def cores_awake() -> Iterator[bool]:
    """Let no core fall asleep in the body, where the system allows it (Linux: `WAKE_UP`, for root by default).

    A core without work saves power, and takes time to wake up; one of a virtual machine waits for its host. Programs
    that measure latencies keep cores awake in the same way (`cyclictest`).

    Yields:
        Whether they stay awake.
    """
    try:
        held = os.open(WAKE_UP, os.O_WRONLY)
    except OSError:
        yield False
        return
    try:
        os.write(held, struct.pack("i", 0))  # [µs]
        yield True
    finally:
        os.close(held)


@contextmanager
def punctual() -> Iterator[bool]:
    """All of the above; yields whether the thread has real-time priority."""
    with uncollected(), cores_awake(), line_workers_first(), real_time_priority() as has_it:
        yield has_it
