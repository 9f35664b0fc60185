"""How bytes become frames on a noisy line: COBS between zero bytes, closed by a CRC-16.

On the wire a payload is `00 COBS(payload + crc) 00`. COBS (Cheshire and Baker, 1999) removes every zero byte, so a zero
can only be a border, and a receiver that starts in the middle, or meets noise, is back in step at the next one. The
leading zero keeps noise between two frames from spoiling the second.
"""

from cobs import cobs
from fastcrc import crc16

MAX_FRAME = 256
"""Longest run of bytes between two zeros; a longer one is noise."""


def wrap(payload: bytes) -> bytes:
    """The bytes to send for `payload`."""
    return b"\0" + bytes(cobs.encode(payload + crc16.ibm_3740(payload).to_bytes(2, "little"))) + b"\0"


def unwrap(run: bytes) -> bytes | None:
    """The payload in the bytes between two zeros, or None where they are not a frame."""
    try:
        plain = bytes(cobs.decode(run))
    except cobs.DecodeError:
        return None
    payload, crc = plain[:-2], plain[-2:]
    return payload if len(crc) == 2 and crc16.ibm_3740(payload) == int.from_bytes(crc, "little") else None


class Splitter:
    """Cuts a stream of bytes, in whatever pieces it comes, at its zeros.

    Attributes:
        overlong: runs dropped because they passed `MAX_FRAME`.
    """

    def __init__(self) -> None:
        self.overlong = 0
        self._rest = b""
        self._skipping = False

    def feed(self, data: bytes) -> list[bytes]:
        """The runs between zeros that `data` completes."""
        *done, rest = (self._rest + data).split(b"\0")
        if done and self._skipping:  # its first run began in what was dropped already
            done, self._skipping = done[1:], False
        if len(rest) > MAX_FRAME or self._skipping:
            self.overlong += not self._skipping
            rest, self._skipping = b"", True
        self._rest = rest
        self.overlong += sum(len(run) > MAX_FRAME for run in done)
        return [run for run in done if 0 < len(run) <= MAX_FRAME]
