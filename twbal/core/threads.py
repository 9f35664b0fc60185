"""How many threads compute: one in numeric libraries, unless the person says otherwise, and one a core for whole tasks.

The matrices here are small: more threads within a library wait for each other (a fit took ten times as long beside
another busy process), and sums in another order on every machine would give other hashes. Tasks that know nothing of
each other, each computed by one thread, come out the same on any number of cores.
"""

import os
import sys
from collections.abc import Callable, Iterable, Mapping
from contextlib import ContextDecorator, ExitStack
from functools import cache, wraps
from threading import Lock, RLock
from typing import ParamSpec, TypeVar, cast

Task = TypeVar("Task")
Found = TypeVar("Found")
Asked = ParamSpec("Asked")

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def default_to_one_thread() -> None:
    """One thread where the environment sets no number; to be called before anything numeric is loaded."""
    for name in THREADS:
        os.environ.setdefault(name, "1")


class OneThread(ContextDecorator):
    """Within it numeric libraries compute by one thread, also those that were loaded before this library.

    They read the environment as they are loaded, so what `default_to_one_thread` sets comes too late for them. Where
    the person gave another number in the environment, that number stays. It may be entered again within itself and by
    several threads, as a decorator too: the numbers of before are put back when the last one leaves.
    """

    def __init__(self) -> None:
        self._lock, self._inside, self._limits = Lock(), 0, ExitStack()

    def __enter__(self) -> None:
        with self._lock:
            if self._inside == 0:
                self._limits = _limits_to_one()
            self._inside += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._inside -= 1
            if self._inside == 0:
                self._limits.close()


def _limits_to_one() -> ExitStack:
    """One thread in the libraries that are loaded, until what is returned is closed."""
    # Here, as a module of `import twbal` must be loaded fast.
    from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

    openmp, openblas, mkl = (1 if os.environ.get(name) == "1" else None for name in THREADS)
    limits = ExitStack()
    numbers = {"openmp": openmp, "blas": openblas, "libmkl_rt": mkl, "mkl_rt": mkl}  # by names of threadpoolctl
    limits.enter_context(threadpool_limits(numbers))
    torch = sys.modules.get("torch")
    if torch is not None and openmp:
        limits.callback(torch.set_num_threads, torch.get_num_threads())
        torch.set_num_threads(1)
    return limits


one_thread = OneThread()
"""The one of this process: a function that computes is decorated by it."""


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
    from concurrent.futures import ThreadPoolExecutor  # here, as a module of `import twbal` must be loaded fast

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
