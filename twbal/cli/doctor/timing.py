"""Whether this computer answers in time: its priority, its load, its clock, and how late it wakes up."""

import getpass
import os
import resource
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from statistics import median

from twbal.core.check import Check, CheckStatus
from twbal.link.line_workers import may_raise
from twbal.link.protocol import WATCHDOG
from twbal.link.real_time import WAKE_UP

PERIOD = 0.01
"""Of the loop whose wake-ups are timed [s]."""

_LATE = 0.005  # a command that is later than this acts noticeably late [s]
_COARSE = 1e-3  # resolution of a clock by which periods of milliseconds cannot be kept [s]


def priority_check() -> Check:
    """Whether this process may have real-time priority; tried, and taken back."""
    name, limit = "real-time priority", resource.getrlimit(resource.RLIMIT_RTPRIO)[0]
    policy, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    if policy in (os.SCHED_FIFO, os.SCHED_RR):
        return Check(name, CheckStatus.OK, f"this process has it, {parameters.sched_priority}")
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
    except OSError as error:
        line = f"'{_user()} - rtprio 90'"
        advice = (
            f"Append {line} to /etc/security/limits.conf and log in again: commands that drive then take it themselves."
        )
        return Check(name, CheckStatus.WARNING, f"not allowed ({error.strerror}; RLIMIT_RTPRIO is {limit})", "", advice)
    with suppress(OSError):  # to lower it is always allowed
        os.sched_setscheduler(0, policy, parameters)
    return Check(name, CheckStatus.OK, "allowed; commands that drive a robot in real time take it by themselves")


def sleep_check(wake_up: Path = WAKE_UP) -> Check:
    """Whether this process may keep the cores awake while it drives. No problem where not: it costs a fraction of a ms.

    Args:
        wake_up: the file by which Linux is told.
    """
    name = "sleeping cores"
    if os.access(wake_up, os.W_OK):
        return Check(name, CheckStatus.OK, "commands that drive a robot in real time keep them awake")
    return Check(
        name,
        CheckStatus.OK,
        f"may sleep between two measurements; who may write to {wake_up} (root, or by a rule of udev) keeps them awake",
    )


def line_check() -> Check:
    """Whether this process may let the threads of Linux that carry the line's bytes go before ordinary programs."""
    name = "the line's threads"
    if may_raise():
        return Check(name, CheckStatus.OK, "commands that drive a robot in real time let them go before other programs")
    found = "have ordinary priority: beside busy programs the line can be late by some milliseconds"
    return Check(name, CheckStatus.OK, f"{found}; root, or who has CAP_SYS_NICE, lets them go first")


def load_check(cores: int, load: float) -> Check:
    """Whether other programs leave a core to the one that drives.

    Args:
        cores: that this process may use.
        load: programs that ran or wanted to, mean of the last minute.
    """
    found = f"{cores} cores, a load of {load:.1f} over the last minute"
    if cores < 2 or load > cores - 1:
        advice = "Close other programs before you drive, or use real-time priority."
        return Check("cores and load", CheckStatus.WARNING, found, "a core to spare", advice)
    return Check("cores and load", CheckStatus.OK, found)


def clock_check() -> Check:
    """Whether the clock by which the host waits is fine enough."""
    resolution = time.get_clock_info("monotonic").resolution
    found = f"resolves {resolution * 1e9:.3g} ns"
    if resolution > _COARSE:
        advice = "Use a kernel with high-resolution timers."
        return Check("clock", CheckStatus.PROBLEM, found, f"at most {_COARSE * 1e3:g} ms", advice)
    return Check("clock", CheckStatus.OK, found)


def lateness(
    seconds: float, clock: Callable[[], float] = time.monotonic, sleep: Callable[[float], None] = time.sleep
) -> list[float]:
    """How late each wake-up of a loop at 100 Hz is [s]; those that a longer stall swallows, by the rest of it.

    Args:
        seconds: for how long it is timed [s].
        clock: tells the time [s].
        sleep: sleeps for a time [s].
    """
    began, late = clock(), []
    for number in range(1, max(1, round(seconds / PERIOD)) + 1):
        due = began + number * PERIOD
        sleep(max(0.0, due - clock()))
        late.append(clock() - due)
    return late


def lateness_check(late: Sequence[float]) -> Check:
    """Whether wake-ups come in time.

    Args:
        late: of each [s], as by `lateness`.
    """
    middle, worst = median(late), max(late)
    found = (
        f"wake-ups at 100 Hz are late by {middle * 1e3:.2f} ms (median), {worst * 1e3:.2f} ms (worst of {len(late)})"
    )
    advice = "Close other programs, and use real-time priority."
    expected = f"at most {_LATE * 1e3:g} ms"
    if middle > WATCHDOG / 2:
        return Check(
            "lateness", CheckStatus.PROBLEM, f"{found}: the watchdog would end every rollout", expected, advice
        )
    if worst > WATCHDOG:
        return Check(
            "lateness", CheckStatus.WARNING, f"{found}: the watchdog would have ended a rollout", expected, advice
        )
    if worst > _LATE:
        return Check("lateness", CheckStatus.WARNING, found, expected, advice)
    return Check("lateness", CheckStatus.OK, found)


def _user() -> str:
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return "<you>"
