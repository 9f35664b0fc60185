"""From the events of a Linux joystick to sticks and buttons.

An event has 8 bytes, in the machine's own order: time u32 [ms], value s16, type u8 (1 a button, 2 an axis; 0x80
besides: it tells how all stands) and number u8 (Linux, joystick-api.rst). Linux tells how all stands when the device is
opened, and again where events were lost, as the host was too late for its queue (drivers/input/joydev.c).
"""

import struct
from dataclasses import dataclass
from typing import NamedTuple

from twbal.steering.request import Key, Sticks

EVENT = struct.Struct("=IhBB")
_BUTTON, _AXIS, _STATE = 1, 2, 0x80
_FULL = 32767  # value of an axis at its end
DEAD_ZONE = 0.1
"""Share of a stick's way around its middle that asks for nothing."""


class JoystickEvent(NamedTuple):
    """What a device says.

    Attributes:
        time: on its clock [ms].
        value: of the axis, ±32767; of the button, 1 pressed.
        kind: type byte.
        number: of the axis or button.
    """

    time: int
    value: int
    kind: int
    number: int

    @property
    def can_be(self) -> bool:
        """Whether a device can say that."""
        kind = self.kind & ~_STATE
        return kind == _AXIS or (kind == _BUTTON and self.value in (0, 1))


@dataclass(frozen=True)
class Layout:
    """Which axes and buttons do what; those of pads that Linux names by its own convention.

    Attributes:
        speed_axis: forward is its negative end.
        turn_axis: left is its negative end.
        rest_button: brings the robot to rest.
        stop_button: switches its motors off.
        end_button: brings it to rest, and ends.
    """

    speed_axis: int
    turn_axis: int
    rest_button: int
    stop_button: int
    end_button: int

    def key(self, button: int) -> Key | None:
        """What a button asks for; None where nothing."""
        return {self.rest_button: Key.REST, self.stop_button: Key.STOP, self.end_button: Key.END}.get(button)


class JoystickDecoder:
    """Makes events of bytes, also where they come apart."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> list[JoystickEvent]:
        """The events that are complete."""
        data = self._rest + data
        whole = len(data) - len(data) % EVENT.size
        self._rest = data[whole:]
        return [JoystickEvent(*fields) for fields in EVENT.iter_unpack(data[:whole])]


class Pad:
    """Follows the events of a device; what stood so when it was opened counts once it is moved.

    Args:
        layout: of its axes and buttons.
    """

    def __init__(self, layout: Layout) -> None:
        self._layout = layout
        self._sticks = Sticks(0.0, 0.0)
        self._was_moved = False

    def take(self, event: JoystickEvent) -> Key | Sticks | None:
        """What an event asks for; `Key.KEEP` where it only shows that the device is there; None before it is moved."""
        kind = event.kind & ~_STATE
        self._was_moved = self._was_moved or kind == event.kind
        if not self._was_moved:
            return None
        if kind == _BUTTON:
            return (self._layout.key(event.number) if event.value else None) or Key.KEEP
        if kind != _AXIS or event.number not in (self._layout.speed_axis, self._layout.turn_axis):
            return Key.KEEP
        share = -_share(event.value)
        if event.number == self._layout.speed_axis:
            self._sticks = self._sticks._replace(speed=share)
        else:
            self._sticks = self._sticks._replace(turn=share)
        return self._sticks


def _share(value: int) -> float:
    """Of the way from the dead zone to the end, -1 to 1."""
    way = min(abs(value) / _FULL, 1.0)
    size = max(way - DEAD_ZONE, 0.0) / (1.0 - DEAD_ZONE)
    return size if value > 0 else -size
