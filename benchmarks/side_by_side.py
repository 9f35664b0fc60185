"""Several processes that share a list of jobs."""

import multiprocessing
from collections.abc import Callable, Iterable, Iterator
from multiprocessing.connection import Connection, wait
from multiprocessing.sharedctypes import Synchronized
from typing import Any

_FORK = multiprocessing.get_context("fork")
Work = Callable[[Iterable[int]], Iterator[Any]]
"""Does jobs, given by their numbers, and yields what came of each."""


def side_by_side(work: Work, count: int, workers: int) -> Iterator[Any]:
    """Do the jobs 0 to `count` - 1, each in one of `workers` processes, and yield what came of them as it comes.

    Raises:
        SystemExit: a worker ended before its work did.
    """
    following = _FORK.Value("l", 0)
    ends = [_FORK.Pipe(duplex=False) for _ in range(min(workers, count))]
    processes = [_FORK.Process(target=_work, args=(work, following, count, end)) for _, end in ends]
    for process in processes:
        process.start()
    for _, end in ends:
        end.close()
    open_ends = [end for end, _ in ends]
    while open_ends:
        for end in wait(open_ends):
            assert isinstance(end, Connection)
            try:
                yield end.recv()
            except EOFError:
                open_ends.remove(end)
    for process in processes:
        process.join()
    if any(process.exitcode for process in processes):
        raise SystemExit("A worker ended before its work did.")


def _work(work: Work, following: "Synchronized[int]", count: int, end: Connection) -> None:
    with end:
        for found in work(_numbers(following, count)):
            end.send(found)


def _numbers(following: "Synchronized[int]", count: int) -> Iterator[int]:
    """Each number below `count` that no other worker has taken."""
    while True:
        with following.get_lock():
            number = following.value
            following.value += 1
        if number >= count:
            return
        yield number
