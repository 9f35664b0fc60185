"""Work in a copy of this process, beside the process itself: another core for what Python's lock keeps on one.

A copy (`fork`) has all that is loaded and compiled, and begins at once. It is made only while this process has one
thread: the locks of other threads would stay locked in a copy for ever. Where none can be made, all is done here.
"""

import ctypes
import os
import pickle
import signal
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from typing import NoReturn, TypeVar

from twbal.core.threads import cores

Here = TypeVar("Here")
There = TypeVar("There")

_THREADS = Path("/proc/self/task")  # one folder for each thread, those of libraries too
_ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_NICE = 5  # what is begun ahead gets a quarter of a core that another process wants, too
_SIGNAL_AT_PARENTS_END = 1  # PR_SET_PDEATHSIG of prctl(2)

_original: list[int] = []  # in a copy: the process that it is a copy of


def original_process() -> int:
    """Number of this process, or of the one that it is a copy of, or a copy of a copy."""
    return _original[0] if _original else os.getpid()


def is_copy() -> bool:
    """Whether this process is a copy."""
    return bool(_original)


def may_be_copied() -> bool:
    """Whether this process may make a copy of itself, and has a core for it: on Linux, with a single thread."""
    return _THREADS.is_dir() and len(os.listdir(_THREADS)) == 1 and cores() > 1


def end_with(parent: int) -> None:
    """Let this process be killed when its parent ends: nobody would tell it that there is no more work."""
    if sys.platform == "linux":  # others know no such signal
        ctypes.CDLL(None).prctl(_SIGNAL_AT_PARENTS_END, signal.SIGKILL)
    if os.getppid() != parent:  # it has ended already
        os._exit(1)


@contextmanager
def begun_ahead(work: Callable[[], object]) -> Iterator[None]:
    """Let a copy of this process do some work while the body runs; it counts by the files that it leaves.

    Nothing is promised: who needs the work does it again afterwards, and finds done what the copy did. What the copy
    prints goes nowhere, its errors neither, as they will come again. It ends with the body where that fails, and with
    this process. Without a copy nothing is done.

    Args:
        work: may be ended at any instant.
    """

    def gently() -> None:
        os.nice(_NICE)
        work()

    with _copy_at(gently) if may_be_copied() else nullcontext():
        yield


def beside(here: Callable[[], Here], there: Callable[[], There]) -> tuple[Here, There]:
    """What comes of two pieces of work, the second done by a copy of this process where there can be one.

    Args:
        here: done by this process.
        there: what comes of it must be picklable. It is done here where the copy fails.
    """
    if not may_be_copied():
        return here(), there()
    source, sink = os.pipe()

    def sent() -> None:
        with os.fdopen(sink, "wb") as stream:
            pickle.dump(there(), stream)

    with os.fdopen(source, "rb") as stream, _copy_at(sent):
        os.close(sink)
        found = here()
        data = stream.read()
    try:
        made: There = pickle.loads(data)
    except (EOFError, pickle.UnpicklingError):
        made = there()
    return found, made


def shared(tasks: Sequence[Callable[[], Here]]) -> list[Here]:
    """What comes of each task, in order; every other one is done by a copy of this process, as `there` of `beside`."""
    even, odd = beside(lambda: [task() for task in tasks[::2]], lambda: [task() for task in tasks[1::2]])
    return [(odd if i % 2 else even)[i // 2] for i in range(len(tasks))]


@contextmanager
def _copy_at(work: Callable[[], object]) -> Iterator[None]:
    """A copy that does some work beside the body, which is waited for; it is ended where the body or the wait fails.

    Where the system has no process left, there is none.
    """
    for stream in (sys.stdout, sys.stderr):
        stream.flush()  # or the copy would have the same words to say
    parent = os.getpid()
    unheard = signal.pthread_sigmask(signal.SIG_BLOCK, _ENDING)  # none may lead a copy out of here
    try:
        copy = os.fork()
    except OSError:
        signal.pthread_sigmask(signal.SIG_SETMASK, unheard)
        yield
        return
    if copy == 0:
        _work_and_end(work, parent, unheard)
    try:
        signal.pthread_sigmask(signal.SIG_SETMASK, unheard)
        yield
        os.waitpid(copy, 0)
    except BaseException:
        with suppress(ProcessLookupError, ChildProcessError):  # it was waited for already
            os.kill(copy, signal.SIGKILL)
            os.waitpid(copy, 0)
        raise


def _work_and_end(work: Callable[[], object], parent: int, unheard: Iterable[int]) -> NoReturn:
    """The life of a copy: what this process began is not for it to clean up, so it ends without."""
    try:
        _original.append(parent)
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process, which ends its copy
        for number in _ENDING[1:]:
            if signal.getsignal(number) is not signal.SIG_IGN:  # as by nohup
                signal.signal(number, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_SETMASK, unheard)
        end_with(parent)
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        work()
    finally:
        os._exit(0)
