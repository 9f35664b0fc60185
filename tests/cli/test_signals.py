import os
import signal
import subprocess
import sys
import threading

import pytest

from twbal.cli.signals import STOPPING, interruptible, never_suspended, stopped_once

INTERRUPTED_KERNEL = """
import os, signal, threading, time
from typing import NamedTuple
import numba
from twbal.cli.signals import interruptible, stopped_once

class Inner(NamedTuple):
    value: float

class Outer(NamedTuple):
    inner: Inner
    steps: int

@numba.njit(nogil=True)
def work(steps):
    value = 0.5
    for _ in range(steps):
        value = 3.9 * value * (1.0 - value)
    return Outer(Inner(value), steps)

signal.signal(signal.SIGINT, signal.default_int_handler)
work(1)
try:
    with {context}():
        sender = threading.Timer(0.05, os.kill, [os.getpid(), signal.SIGINT])
        sender.start()
        while sender.is_alive():
            work(100_000_000)
        work(100_000_000)
        time.sleep(10.0)
except KeyboardInterrupt:
    print("stopped")
"""


@pytest.fixture(autouse=True)
def heard():
    """Whoever runs the tests may have told this process to ignore a signal, as nohup does."""
    before = {number: signal.signal(number, signal.default_int_handler) for number in STOPPING}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def test_a_suspension_changes_nothing_and_is_heard_as_before_afterwards():
    heard = []
    before = signal.signal(signal.SIGTSTP, lambda number, frame: heard.append(number))
    try:
        with never_suspended():
            os.kill(os.getpid(), signal.SIGTSTP)
        assert not heard
        os.kill(os.getpid(), signal.SIGTSTP)
        assert heard == [signal.SIGTSTP]
    finally:
        signal.signal(signal.SIGTSTP, before)


@pytest.mark.parametrize("number", STOPPING)
def test_the_first_signal_interrupts_and_the_next_do_not_disturb_the_way_out(number):
    left_in_order = False
    with pytest.raises(KeyboardInterrupt), stopped_once():
        try:
            os.kill(os.getpid(), number)
        finally:
            for again in STOPPING:
                os.kill(os.getpid(), again)
            left_in_order = True
    assert left_in_order


def test_afterwards_signals_act_as_before():
    with stopped_once():
        pass
    assert {signal.getsignal(number) for number in STOPPING} == {signal.default_int_handler}


def test_what_was_to_be_ignored_stays_ignored():
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    with stopped_once():
        os.kill(os.getpid(), signal.SIGHUP)
    assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN


def test_in_another_thread_nothing_changes():
    seen = []

    def look():
        with stopped_once():
            seen.extend(signal.getsignal(number) for number in STOPPING)

    thread = threading.Thread(target=look)
    thread.start()
    thread.join()
    assert set(seen) == {signal.default_int_handler}


@pytest.mark.parametrize("context", ["interruptible", "stopped_once"])
def test_ctrl_c_in_a_kernel_that_returns_named_tuples_is_no_segmentation_fault(context):
    code = INTERRUPTED_KERNEL.replace("{context}", context)
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert (found.returncode, found.stdout) == (0, "stopped\n"), found.stderr


def test_interruptible_raises_at_once_and_leaves_the_handler_as_it_was():
    with pytest.raises(KeyboardInterrupt), interruptible():
        os.kill(os.getpid(), signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_interruptible_leaves_alone_whoever_hears_ctrl_c_already():
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with interruptible():
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN


def test_at_the_end_the_next_ctrl_c_ends_the_process_without_a_word():
    code = "import os, signal; from twbal.cli.signals import end_at_next_interrupt as end; end(); "
    code += "os.kill(os.getpid(), signal.SIGINT)"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert (found.returncode, found.stderr) == (-signal.SIGINT, "")


def test_a_handler_that_python_did_not_install_is_left_alone(monkeypatch):
    """As of a program in C that Python is part of: it could not be put back."""
    set_now = []
    monkeypatch.setattr(signal, "getsignal", lambda number: None)
    monkeypatch.setattr(signal, "signal", lambda *given: set_now.append(given))
    with stopped_once():
        pass
    assert not set_now
