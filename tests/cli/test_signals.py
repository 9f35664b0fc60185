import os
import signal
import threading

import pytest

from twbal.cli.signals import STOPPING, stopped_once


@pytest.fixture(autouse=True)
def heard():
    """Whoever runs the tests may have told this process to ignore a signal, as nohup does."""
    before = {number: signal.signal(number, signal.default_int_handler) for number in STOPPING}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


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
