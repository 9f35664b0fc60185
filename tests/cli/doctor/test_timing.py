"""Lateness is measured on a clock that the test makes; priority is compared with what `chrt` can do."""

import os
import shutil
import subprocess
import time

import pytest

from twbal.cli.doctor.timing import (
    PERIOD,
    lateness,
    lateness_check,
    line_check,
    load_check,
    priority_check,
    sleep_check,
)
from twbal.core.check import CheckStatus


class LateClock:
    """A clock whose sleeps end later than asked, each by its own time [s]."""

    def __init__(self, overshoots):
        self.now, self._overshoots = 100.0, iter(overshoots)

    def sleep(self, seconds):
        self.now += seconds + next(self._overshoots)


def test_lateness_is_how_much_later_sleeps_end():
    overshoots = [0.001, 0.0, 0.003, 0.002]
    clock = LateClock(overshoots)
    assert lateness(4 * PERIOD, lambda: clock.now, clock.sleep) == pytest.approx(overshoots)


def test_a_stall_makes_late_what_it_swallows():
    clock = LateClock([0.0, 0.025, 0.0, 0.0, 0.0])
    found = lateness(5 * PERIOD, lambda: clock.now, clock.sleep)
    assert found == pytest.approx([0.0, 0.025, 0.015, 0.005, 0.0])


def test_a_real_loop_lasts_as_long_as_it_is_told():
    began = time.monotonic()
    late = lateness(0.1)
    assert len(late) == 10
    assert min(late) >= 0.0  # a sleep never ends early
    assert time.monotonic() - began >= 0.1


@pytest.mark.parametrize(
    ("late", "verdict", "said"),
    [
        ([1e-4] * 50, "ok", "late by 0.10 ms (median), 0.10 ms (worst of 50)"),
        ([1e-4] * 49 + [6e-3], "warning", "6.00 ms (worst of 50)"),
        ([1e-4] * 49 + [0.11], "warning", "the watchdog would have ended a rollout"),
        ([8e-3] * 50, "warning", "late by 8.00 ms (median)"),
        ([0.06] * 50, "problem", "the watchdog would end every rollout"),
    ],
)
def test_wake_ups_are_judged_by_the_worst_and_by_the_median(late, verdict, said):
    check = lateness_check(late)
    assert check.verdict == verdict
    assert said in check.found


@pytest.mark.parametrize(("cores", "load", "verdict"), [(4, 0.5, "ok"), (4, 3.5, "warning"), (1, 0.0, "warning")])
def test_a_core_must_be_left(cores, load, verdict):
    assert load_check(cores, load).verdict == verdict


@pytest.mark.skipif(shutil.which("chrt") is None, reason="needs chrt, of util-linux")
def test_priority_is_allowed_where_chrt_can_give_it():
    allowed = subprocess.run(["chrt", "--fifo", "1", "true"], capture_output=True).returncode == 0
    check = priority_check()
    assert check.verdict == (CheckStatus.OK if allowed else CheckStatus.WARNING)
    assert ("limits.conf" in check.advice) != allowed
    assert os.sched_getscheduler(0) == os.SCHED_OTHER


def test_who_may_keep_cores_awake_is_told_so(tmp_path):
    allowed = tmp_path / "cpu_dma_latency"
    allowed.touch()
    assert "keep them awake" in sleep_check(allowed).found
    not_there = sleep_check(tmp_path / "none")
    assert not_there.verdict == CheckStatus.OK
    assert f"who may write to {tmp_path / 'none'}" in not_there.found


@pytest.mark.skipif(shutil.which("chrt") is None, reason="needs chrt, of util-linux")
def test_who_may_change_a_thread_of_the_kernel_is_told_that_the_line_goes_first():
    thread = subprocess.run(["pgrep", "kworker/u"], capture_output=True, text=True).stdout.split()
    allowed = bool(thread) and subprocess.run(["chrt", "--other", "--pid", "0", thread[0]]).returncode == 0
    check = line_check()
    assert check.verdict == CheckStatus.OK
    assert ("let them go before" in check.found) == allowed
