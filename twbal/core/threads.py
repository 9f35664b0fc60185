"""How many threads compute: one in numeric libraries, unless the person says otherwise, and one a core for whole tasks.

The matrices here are small: more threads within a library wait for each other (a fit took ten times as long beside
another busy process), and sums in another order on every machine would give other hashes. Tasks that know nothing of
each other, each computed by one thread, come out the same on any number of cores.
"""

import os
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import cache, wraps
from threading import RLock
from typing import ParamSpec, TypeVar, cast

Task = TypeVar("Task")
Found = TypeVar("Found")
Asked = ParamSpec("Asked")

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def default_to_one_thread() -> None:
    """One thread where the environment sets no number; to be called before anything numeric is loaded."""
    for name in THREADS:
        os.environ.setdefault(name, "1")


def cores() -> int:
    """Cores that this process may compute on."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def in_threads(work: Callable[[Task], Found], tasks: Iterable[Task], threads: int | None = None) -> list[Found]:
    """What comes of each task, in order, several at a time as far as they run free of Python's lock.

    Args:
        work: what is done with a task; it must not depend on other tasks.
        tasks: any number.
        threads: how many tasks at a time; None: one a core.
    """
    with ThreadPoolExecutor(threads or cores()) as pool:
        return list(pool.map(work, tasks))


def made_once(make: Callable[Asked, Found]) -> Callable[Asked, Found]:
    """The decorated function, called once for each set of arguments, which must be hashable.

    Of threads that ask for the same at the same time, `functools.cache` lets each make its own. Classes for which
    kernels are compiled must be one and the same: a kernel is compiled anew for each.
    """
    cached, lock = cast(Callable[Asked, Found], cache(make)), RLock()

    @wraps(make)
    def ask(*args: Asked.args, **named: Asked.kwargs) -> Found:
        with lock:
            return cached(*args, **named)

    return ask


def asked_threads() -> Mapping[str, str]:
    """The numbers of threads in this process, for processes elsewhere to have the same."""
    return {name: os.environ[name] for name in THREADS if name in os.environ}
