"""Work in copies of a process. Each test has a process of its own: one that tests run in has threads."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from twbal.core.threads import cores

pytestmark = pytest.mark.skipif(
    not Path("/proc/self/task").is_dir() or cores() < 2, reason="copies are made on Linux, on several cores"
)

HEAD = """
import os, sys, threading, time
from pathlib import Path
from twbal.core.copies import begun_ahead, beside, is_copy, may_be_copied, original_process, shared
folder = Path(sys.argv[1])

def note(name):
    (folder / name).write_text(f"{os.getpid()} {original_process()} {is_copy()}")
"""


def started(body: str, folder: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", HEAD + body, str(folder)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def printed(body: str, folder: Path) -> str:
    process = started(body, folder)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 0, err
    assert err == ""
    return out


def is_gone(pid: int) -> bool:
    """Within some seconds."""
    deadline = time.monotonic() + 20.0
    while time.monotonic() < deadline:
        try:
            state = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
        except FileNotFoundError:
            return True
        if state == "Z":
            return True
        time.sleep(0.02)
    return False


def waited_for(file: Path) -> str:
    deadline = time.monotonic() + 30.0
    while not (file.exists() and file.read_text()):
        assert time.monotonic() < deadline
        time.sleep(0.02)
    return file.read_text()


def test_a_copy_works_beside_the_body_and_is_waited_for(tmp_path):
    body = """
def work():
    print("nobody reads this", flush=True)
    while not (folder / "begun").exists():  # which the body makes: they run at the same time
        time.sleep(0.01)
    time.sleep(0.3)
    note("work")
    raise ValueError("nor this")

with begun_ahead(work):
    (folder / "begun").touch()
print(os.getpid(), original_process(), is_copy(), (folder / "work").read_text(), sep="|")
"""
    own, original, copied, work = printed(body, tmp_path).strip().split("|")
    assert original == own
    assert copied == "False"
    copy, origin, is_copy = work.split()
    assert copy != own
    assert (origin, is_copy) == (own, "True")


def test_a_copy_of_a_copy_knows_the_first_process(tmp_path):
    body = """
def inner():
    note("inner")

def outer():
    note("outer")
    with begun_ahead(inner):
        pass

with begun_ahead(outer):
    pass
print(os.getpid())
"""
    own = printed(body, tmp_path).strip()
    outer, inner = ((tmp_path / name).read_text().split() for name in ("outer", "inner"))
    assert outer[1] == inner[1] == own
    assert len({own, outer[0], inner[0]}) == 3


def test_beside_another_thread_nothing_is_copied(tmp_path):
    body = """
end = threading.Event()
thread = threading.Thread(target=end.wait)
thread.start()
print(may_be_copied())
with begun_ahead(lambda: note("work")):
    pass
print((folder / "work").exists())
print(beside(os.getpid, os.getpid) == (os.getpid(), os.getpid()))
end.set()
thread.join()
for _ in range(1000):  # the system needs a moment to take it off its list
    if may_be_copied():
        break
    time.sleep(0.01)
print(may_be_copied())
"""
    assert printed(body, tmp_path).split() == ["False", "False", "True", "True"]


def test_a_copy_ends_with_a_body_that_fails(tmp_path):
    body = """
def work():
    note("work")
    time.sleep(600)

try:
    with begun_ahead(work):
        while not (folder / "work").exists():
            time.sleep(0.01)
        raise ValueError("the body's")
except ValueError as error:
    print(error)
"""
    assert printed(body, tmp_path).strip() == "the body's"
    assert is_gone(int((tmp_path / "work").read_text().split()[0]))


FOR_EVER = """
def work():
    note("work")
    time.sleep(600)

with begun_ahead(work):
    print("ready", flush=True)
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_copy_ends_with_its_process_however_that_ends(tmp_path, number):
    process = started(FOR_EVER, tmp_path)
    copy = int(waited_for(tmp_path / "work").split()[0])
    assert Path(f"/proc/{copy}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    os.kill(process.pid, number)
    process.communicate(timeout=60)
    assert process.returncode != 0
    assert is_gone(copy)


def test_ctrl_c_reaches_the_process_alone(tmp_path):
    """A terminal sends it to the copy, too, which waits for its end."""
    body = """
def work():
    note("work")
    while not (folder / "heard").exists():
        time.sleep(0.01)
    note("went_on")

with begun_ahead(work):
    pass
"""
    process = started(body, tmp_path)
    os.kill(int(waited_for(tmp_path / "work").split()[0]), signal.SIGINT)
    (tmp_path / "heard").touch()
    process.communicate(timeout=60)
    assert process.returncode == 0
    assert (tmp_path / "went_on").exists()


def test_where_the_system_has_no_process_left_all_is_done_here(tmp_path):
    body = """
def refuse():
    raise BlockingIOError("Resource temporarily unavailable")

os.fork = refuse
with begun_ahead(lambda: note("work")):
    print((folder / "work").exists())
print(shared([os.getpid] * 2) == [os.getpid()] * 2)
"""
    assert printed(body, tmp_path).split() == ["False", "True"]


def test_what_is_told_to_be_ignored_is_ignored_by_a_copy_too(tmp_path):
    body = """
import signal
signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as nohup does
handlers = lambda: [signal.getsignal(number) for number in (signal.SIGHUP, signal.SIGINT, signal.SIGTERM)]
print(beside(lambda: None, lambda: [str(each) for each in map(int, handlers())])[1])
"""
    assert printed(body, tmp_path).strip() == str(
        [str(int(each)) for each in (signal.SIG_IGN, signal.SIG_IGN, signal.SIG_DFL)]
    )


def test_results_come_back_in_order(tmp_path):
    body = """
tasks = [lambda i=i: (i, is_copy(), "x" * 300_000) for i in range(5)]
print([(i, copied, len(text)) for i, copied, text in shared(tasks)])
print(shared([]), shared([lambda: 1]))
"""
    first, second = printed(body, tmp_path).splitlines()
    assert eval(first) == [(i, i % 2 == 1, 300_000) for i in range(5)]
    assert second == "[] [1]"


def test_what_a_copy_does_not_bring_is_done_here(tmp_path):
    body = """
def only_here():
    if is_copy():
        os._exit(3)
    return "here"

print(beside(lambda: 1, only_here))
try:
    beside(lambda: 1, lambda: 1 / 0)
except ZeroDivisionError as error:
    print(error)
print(beside(lambda: 1, lambda: (lambda: 2))[1]())  # which cannot be pickled
"""
    assert printed(body, tmp_path).splitlines() == ["(1, 'here')", "division by zero", "2"]
