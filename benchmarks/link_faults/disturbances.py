"""What faults do to the bytes on the line, from the instant at which they begin."""

from collections.abc import Callable
from random import Random

from benchmarks.link_faults.frames import HELLO, STOP, TELEMETRY, Cutter, framed, with_clock

Way = Callable[[bytes], bytes]
"""What bytes become on their way; called for each piece of them."""


def as_it_came(data: bytes) -> bytes:
    """No fault."""
    return data


def lost(data: bytes) -> bytes:
    """Silence."""
    return b""


def dropped(share: float, rng: Random) -> Way:
    """A share of the bytes is lost."""
    return lambda data: bytes(byte for byte in data if rng.random() >= share)


def doubled(share: float, rng: Random) -> Way:
    """A share of the bytes comes twice."""
    return lambda data: b"".join(bytes([byte]) * (1 + (rng.random() < share)) for byte in data)


def corrupted(share: float, rng: Random) -> Way:
    """A share of the bytes becomes another one."""
    return lambda data: bytes(byte ^ rng.randrange(1, 256) if rng.random() < share else byte for byte in data)


def swapped(share: float, rng: Random) -> Way:
    """A share of the bytes comes after the next one."""

    def way(data: bytes) -> bytes:
        made, at = bytearray(data), 0
        while at + 1 < len(made):
            if rng.random() < share:
                made[at : at + 2] = made[at + 1], made[at]
                at += 1
            at += 1
        return bytes(made)

    return way


class Frames:
    """Whole frames, of which a share meets something.

    Args:
        share: of them.
        rng: chooses them.
        fate: what becomes of such a frame: "dropped", "doubled" or "swapped" with the next one.
    """

    def __init__(self, share: float, rng: Random, fate: str) -> None:
        self._share, self._rng, self._fate = share, rng, fate
        self._cutter, self._held = Cutter(), b""

    def __call__(self, data: bytes) -> bytes:
        """What arrives when `data` is sent."""
        return b"".join(self._arrives(framed(payload)) for payload in self._cutter.feed(data))

    def _arrives(self, frame: bytes) -> bytes:
        if self._held:
            frame, self._held = frame + self._held, b""
            return frame
        if self._rng.random() >= self._share:
            return frame
        if self._fate == "swapped":
            self._held = frame
            return b""
        return frame + frame if self._fate == "doubled" else b""


class OtherClock:
    """Telemetry whose clock is wrong from one on.

    Args:
        clock: what the robot's clock says becomes, given that at the beginning [µs].
    """

    def __init__(self, clock: Callable[[int, int], int]) -> None:
        self._clock, self._cutter = clock, Cutter()
        self._begin: int | None = None

    def __call__(self, data: bytes) -> bytes:
        """What arrives when `data` is sent."""
        return b"".join(framed(self._told(payload)) for payload in self._cutter.feed(data))

    def _told(self, payload: bytes) -> bytes:
        if payload[0] != TELEMETRY:
            return payload
        period, now = int.from_bytes(payload[3:5], "little"), int.from_bytes(payload[5:9], "little")
        self._begin = now if self._begin is None or not period else self._begin
        return with_clock(payload, self._clock(self._begin, now))


class WithoutStop:
    """The line to the robot from the first Stop on.

    Args:
        count: how many messages from then on are lost.
    """

    def __init__(self, count: int) -> None:
        self._left, self._cutter, self._stopping = count, Cutter(), False

    def __call__(self, data: bytes) -> bytes:
        """What arrives when `data` is sent."""
        return b"".join(framed(payload) for payload in self._cutter.feed(data) if self._arrives(payload))

    def _arrives(self, payload: bytes) -> bool:
        self._stopping = self._stopping or payload[0] == STOP
        if not self._stopping or payload[0] not in (STOP, HELLO) or self._left <= 0:
            return True
        self._left -= 1
        return False
