"""A gamepad, or what was recorded of one."""

import os
import stat
from pathlib import Path
from typing import Self

from twbal.core.errors import ConfigError
from twbal.steering.joystick import EVENT, JoystickDecoder, JoystickEvent, Layout, Pad
from twbal.steering.request import Key, Sticks
from twbal.steering.source import Source

_READ = 64 * EVENT.size  # bytes at once
_INPUT = 13  # major number of Linux' devices for input
_RECORD = "Record with cat /dev/input/js0 > <file>."


class Gamepad(Source):
    """A joystick device of Linux (or a pipe of its events), while it is a context. Once it is unplugged, it is lost.

    Args:
        path: of the device.
        layout: of its axes and buttons.

    Raises:
        ConfigError: it cannot be opened, or is neither a device for input nor a pipe.
    """

    def __init__(self, path: Path, layout: Layout) -> None:
        self.name = f"gamepad {path}"
        self._decoder, self._pad = JoystickDecoder(), Pad(layout)
        try:
            self._device = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        except OSError as error:
            raise ConfigError(
                f"Cannot open the gamepad {path}: {error.strerror}. Joysticks that are there: {_joysticks()}. Is it "
                "plugged in, and may you read it (on Linux: the group input)?"
            ) from error
        if not _is_input(os.fstat(self._device)):
            os.close(self._device)
            raise ConfigError(f"{path} is no joystick. Joysticks that are there: {_joysticks()}.")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        os.close(self._device)

    def read(self, time: float) -> list[Key | Sticks]:
        """What its sticks and buttons ask for; see `Source.read`."""
        events = self._decoder.feed(self._bytes(self._device, _READ))
        return [asked for event in events if (asked := self._pad.take(event)) is not None]


class RecordedGamepad(Source):
    """Events of a gamepad from a file, each as long after the first as it was; lost after the last.

    Args:
        path: of the file.
        layout: of axes and buttons.

    Raises:
        ConfigError: there are none in it, or what is in it can be none.
    """

    def __init__(self, path: Path, layout: Layout) -> None:
        self.name, self._pad = f"recording {path}", Pad(layout)
        self._events: list[JoystickEvent] = JoystickDecoder().feed(path.read_bytes())
        if not self._events:
            raise ConfigError(f"{path} has no event of a joystick in it (8 bytes each). {_RECORD}")
        for number, (before, event) in enumerate(zip(self._events[:1] + self._events, self._events, strict=False), 1):
            if not event.can_be or event.time < before.time:
                raise ConfigError(
                    f"{path} is no recording of a joystick: its event {number} would be of type {event.kind} with "
                    f"value {event.value} at {event.time} ms, after one at {before.time} ms. {_RECORD}"
                )
        self._first, self._next = self._events[0].time, 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        pass

    def read(self, time: float) -> list[Key | Sticks]:
        """What they ask for by this time; see `Source.read`."""
        found = []
        if self.lost:
            return []
        while self._next < len(self._events) and 1e-3 * (self._events[self._next].time - self._first) <= time:
            asked = self._pad.take(self._events[self._next])
            found += [] if asked is None else [asked]
            self._next += 1
        self.lost = self._next == len(self._events)
        return found


def gamepad(path: Path, layout: Layout) -> Gamepad | RecordedGamepad:
    """The device, or the recording where it is an ordinary file; raises ConfigError where there is neither."""
    if path.is_file() and stat.S_ISREG(path.stat().st_mode):
        return RecordedGamepad(path, layout)
    return Gamepad(path, layout)


def _is_input(status: os.stat_result) -> bool:
    """Whether what was opened is a device for input or a pipe."""
    is_device = stat.S_ISCHR(status.st_mode) and os.major(status.st_rdev) == _INPUT
    return is_device or stat.S_ISFIFO(status.st_mode)


def _joysticks() -> str:
    return ", ".join(map(str, sorted(Path("/dev/input").glob("js*")))) or "none"
