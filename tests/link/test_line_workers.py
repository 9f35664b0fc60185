"""The priority of the kernel's threads is looked up by `chrt`, as `pgrep` finds them."""

import os
import shutil
import signal
import subprocess
import sys
import time

import pytest

from twbal.link.line_workers import line_workers_first, may_raise

HOLD = (
    "import time\nfrom twbal.link.line_workers import line_workers_first\n"
    "with line_workers_first() as they_do:\n    print(they_do, flush=True)\n    time.sleep(60)"
)
UNPRIVILEGED = ["setpriv", "--bounding-set=-sys_nice", "--inh-caps=-sys_nice"]
needed = [tool for tool in ("pgrep", "chrt", "setpriv") if shutil.which(tool) is None]
pytestmark = [
    pytest.mark.skipif(bool(needed), reason=f"needs {', '.join(needed)}"),
    pytest.mark.skipif(not may_raise(), reason="the priority of the kernel's threads is root's, where they are seen"),
]


def priorities():
    """Of each thread that there is, as `chrt` tells it."""
    numbers = subprocess.run(["pgrep", "kworker/u"], capture_output=True, text=True).stdout.split()
    told = (subprocess.run(["chrt", "--pid", n], capture_output=True, text=True).stdout for n in numbers)
    return [text.split()[-1] if "SCHED_FIFO" in text else "ordinary" for text in told if text]


def wait_for(wanted):
    until = time.monotonic() + 20.0
    while set(priorities()) != wanted and time.monotonic() < until:
        time.sleep(0.05)
    return set(priorities())


@pytest.fixture(autouse=True)
def before():
    assert wait_for({"ordinary"}) == {"ordinary"}


def test_they_go_before_ordinary_programs_in_the_body_only():
    with line_workers_first() as they_do:
        assert they_do
        assert "1" in priorities()
        assert wait_for({"1"}) == {"1"}  # those that Linux added since, too
    assert "1" not in priorities()


def test_all_is_put_back_where_the_body_fails():
    with pytest.raises(ValueError, match="this"), line_workers_first():
        raise ValueError("this")
    assert "1" not in priorities()


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGINT, signal.SIGTERM])
def test_all_is_put_back_where_the_command_is_ended(end):
    held = subprocess.Popen([sys.executable, "-c", HOLD], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    assert held.stdout.readline().strip() == "True"
    assert "1" in priorities()
    os.kill(held.pid, end)
    held.communicate()
    assert wait_for({"ordinary"}) == {"ordinary"}


def test_who_may_not_drives_all_the_same():
    held = subprocess.Popen([*UNPRIVILEGED, sys.executable, "-c", HOLD], stdout=subprocess.PIPE, text=True)
    assert held.stdout.readline().strip() == "False"
    assert "1" not in priorities()
    held.kill()
    held.communicate()
