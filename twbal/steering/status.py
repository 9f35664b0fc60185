"""What a person who steers is shown: one line, over and over."""

import os
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from math import degrees

from twbal.core.channels import Channels
from twbal.steering.limits import SteeringLimits
from twbal.steering.steered import Moment

EVERY = 0.2
"""Time between two lines [s]."""
_CLEARED = "\r{}\x1b[K"  # from the line's beginning, and nothing of the last one behind it (ECMA-48)


class StatusLine:
    """Writes a line some five times a second.

    Args:
        limits: whose shares are asked for.
        wheel_radius: of the data sheet [m].
        write: takes the text.
        now: clock [s].
    """

    def __init__(
        self,
        limits: SteeringLimits,
        wheel_radius: float,
        write: Callable[[str], None],
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self._limits, self._channels = limits, Channels(("speed",), wheel_radius)
        self._write, self._now = write, now
        self._start: float | None = None  # of the path [m]
        self._last = -EVERY  # on the clock [s]

    def show(self, moment: Moment) -> None:
        """Write the line, if the last one is some time ago."""
        path = float(self._channels.path(moment.seen))
        self._start = path if self._start is None else self._start
        if (now := self._now()) - self._last >= EVERY:
            self._last = now
            self._write(_CLEARED.format(self.line(moment, path - self._start)))

    def line(self, moment: Moment, place: float) -> str:
        """The text: speeds in m/s, the turn in °/s, the robot's place [m], heading and tilt."""
        asked, heading = moment.asked, moment.heading
        speed = float(self._channels.measured_values(moment.seen)["speed"])
        turn = "" if heading is None else f" turn {degrees(asked.turn * self._limits.turning.speed):+z4.0f}°/s"
        looks = "" if heading is None else f" | heading {degrees(heading.estimate):+z5.0f}°"
        return (
            f"{moment.seen.time:6.1f} s | asked {asked.speed * self._limits.driving.speed:+z.2f} m/s{turn} | "
            f"reference {moment.reference.speed:+z.2f} | robot {speed:+z.2f} | place {place:+z.2f} m{looks} | "
            f"tilt {degrees(moment.seen.tilt):+z.1f}°"
        )


class Display:
    """Standard output where it is a terminal; what it has no room for at once is left out, so that nobody waits."""

    def __init__(self) -> None:
        self._terminal: int | None = None
        with suppress(AttributeError, OSError, ValueError):  # there is no standard output, or no terminal
            path = os.ttyname(sys.stdout.fileno())
            self._terminal = os.open(path, os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY)

    def write(self, text: str) -> None:
        """Show a text as far as there is room for it."""
        if self._terminal is not None:
            with suppress(OSError):  # no room, or nobody there
                os.write(self._terminal, self._cut(text).encode())

    def close(self) -> None:
        """End the line."""
        self.write("\n")
        if self._terminal is not None:
            os.close(self._terminal)
            self._terminal = None

    def _cut(self, text: str) -> str:
        """No longer than the terminal is wide, or the next line would not overwrite it."""
        assert self._terminal is not None
        width = os.get_terminal_size(self._terminal).columns
        head, mark, _ = text.partition("\x1b")
        return f"{head[:width]}\x1b[K" if mark and width > 0 else text
