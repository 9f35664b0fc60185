"""Priority is looked up as the system has it, in this process and by `chrt`; garbage by what Python says of it."""

import gc
import os
import shutil
import subprocess
import sys
import weakref

import pytest
from test_serial_plant import REAL_TIME, drive, linked

from twbal.link.real_time import PRIORITY, punctual, real_time_priority, uncollected

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
