"""A robot that waits for its host, driven as fast as a person's clock goes."""

import time
from collections.abc import Callable

_LATE = 0.1  # s; what is later than this is not caught up with


class Pace:
    """Waits until a drive's time has come.

    Args:
        rate: seconds of the drive in a second of the person.
        now: clock [s].
        sleep: waits so many seconds.
    """

    def __init__(
        self, rate: float, now: Callable[[], float] = time.monotonic, sleep: Callable[[float], None] = time.sleep
    ) -> None:
        self._rate, self._now, self._sleep = rate, now, sleep
        self._start: float | None = None  # of the drive, on the clock [s]

    def wait(self, time: float) -> None:
        """Return when a time since the drive began [s] has come."""
        now = self._now()
        if self._start is None:
            self._start = now
        left = self._start + time / self._rate - now
        if left > 0:
            self._sleep(left)
        elif left < -_LATE:
            self._start -= left
