"""Priority is looked up as the system has it, in this process and by `chrt`; garbage by what Python says of it.

That cores stay awake is looked up in the system's own file: read, it tells the shortest time that anybody asks for.
"""

import gc
import os
import shutil
import struct
import subprocess
import sys
import weakref

import pytest
from test_serial_plant import REAL_TIME, drive, linked

from twbal.link.real_time import PRIORITY, WAKE_UP, cores_awake, punctual, real_time_priority, uncollected

ALONE = "import os\nfrom twbal.link.real_time import real_time_priority as p\nwith p() as has: print(has, {shown})"
allowed = pytest.mark.skipif(os.geteuid() != 0, reason="real-time priority is root's, unless somebody allowed it")


class Ring:
    def __init__(self):
        self.itself = self


def has_priority(number):
    said = subprocess.run(["chrt", "--pid", str(number)], capture_output=True, text=True, check=True).stdout
    return "SCHED_FIFO" in said and said.rstrip().endswith(f" {PRIORITY}")


def test_no_garbage_is_collected_in_the_body_and_all_of_it_afterwards():
    ring = weakref.ref(Ring())
    with uncollected():
        assert ring() is None  # what was there is gone before
        assert not gc.isenabled()
        ring = weakref.ref(Ring())
        assert ring() is not None
    assert gc.isenabled() and gc.get_freeze_count() == 0
    gc.collect()
    assert ring() is None


def test_who_collects_no_garbage_anyway_goes_on_so():
    gc.disable()
    try:
        with uncollected():
            pass
        assert not gc.isenabled()
    finally:
        gc.enable()


@allowed
def test_the_thread_goes_before_others_in_the_body_only_and_its_children_do_not():
    with real_time_priority() as has_it:
        assert has_it and has_priority(os.getpid())
        shown = [sys.executable, "-c", "import os; print(os.sched_getscheduler(0))"]
        assert subprocess.run(shown, capture_output=True, text=True).stdout.strip() == str(os.SCHED_OTHER)
    assert not has_priority(os.getpid())
    assert os.sched_getscheduler(0) == os.SCHED_OTHER


@allowed
@pytest.mark.parametrize(
    ("before", "shown", "said"),
    [
        (["setpriv", "--bounding-set=-sys_nice", "--inh-caps=-sys_nice"], "os.sched_getscheduler(0)", "False 0"),
        (["chrt", "--fifo", "7"], "os.sched_getparam(0).sched_priority", "True 7"),
    ],
    ids=["not allowed", "has it"],
)
def test_who_may_not_or_need_not_stays_as_it_is(before, shown, said):
    if shutil.which(before[0]) is None:
        pytest.skip(f"needs {before[0]}")
    command = [*before, sys.executable, "-c", ALONE.format(shown=shown)]
    assert subprocess.run(command, capture_output=True, text=True).stdout.strip() == said


def longest_wake_up():
    """That the system allows its cores [µs]."""
    with WAKE_UP.open("rb") as told:
        return struct.unpack("i", told.read(4))[0]


@pytest.mark.skipif(not os.access(WAKE_UP, os.R_OK | os.W_OK), reason=f"needs {WAKE_UP}")
def test_cores_stay_awake_in_the_body_only():
    before = longest_wake_up()
    with cores_awake() as they_do:
        assert they_do and longest_wake_up() == 0
    assert longest_wake_up() == before


def test_where_cores_cannot_be_kept_awake_the_body_runs_all_the_same(monkeypatch, tmp_path):
    monkeypatch.setattr("twbal.link.real_time.WAKE_UP", tmp_path / "none")
    with cores_awake() as they_do:
        assert not they_do


def test_both_end_where_the_body_fails():
    scheduler = os.sched_getscheduler(0)
    with pytest.raises(ValueError, match="this"), punctual():
        raise ValueError("this")
    assert gc.isenabled() and os.sched_getscheduler(0) == scheduler


@pytest.mark.parametrize("steps", [30, 90])
def test_a_rollout_leaves_no_more_to_collect_the_longer_it_lasts(steps):
    plant, _, _ = linked(REAL_TIME, us_per_read=1000)
    with uncollected():
        episode = drive(plant, steps=steps)
        left = gc.collect()
    assert len(episode) == steps
    assert left < 10
