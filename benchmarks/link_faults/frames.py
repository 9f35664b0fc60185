"""Frames as the judge reads them: written from docs/protocol.md, and not with twbal's own decoder."""

import struct
from binascii import crc_hqx
from typing import NamedTuple

HELLO, STOP, ARM, COMMAND, POSE, TELEMETRY = 0x01, 0x04, 0x05, 0x06, 0x84, 0x85
ARMED = 1
LONGEST = 256  # of a run between two zeros [bytes]
_TELEMETRY = struct.Struct("<BHHIB12fIHH")
_NUMBERED = struct.Struct("<BH")
_COMMAND = struct.Struct("<BHff")


class Said(NamedTuple):
    """What a robot's telemetry says, as far as the judge looks at it.

    Attributes:
        seq: of the host's message that was taken last.
        period: control periods since arming, modulo 2¹⁶.
        time_us: robot's clock, modulo 2³² [µs].
        status: bits of the motors' state.
        command_us: robot's clock when it took the last command, modulo 2³² [µs].
        dropped: frames that the robot dropped, modulo 2¹⁶.
    """

    seq: int
    period: int
    time_us: int
    status: int
    command_us: int
    dropped: int

    @property
    def is_armed(self) -> bool:
        """Whether the motors may be on."""
        return bool(self.status & ARMED)


class Cutter:
    """Cuts a stream at its zeros.

    Attributes:
        broken: runs that were no frame: too long, not COBS, or with another CRC.
    """

    def __init__(self) -> None:
        self.broken = 0
        self._rest = b""

    def feed(self, data: bytes) -> list[bytes]:
        """Payloads of the frames that `data` completes."""
        *done, self._rest = (self._rest + data).split(b"\0")
        payloads = [payload_of(run) for run in done if run]
        self.broken += payloads.count(None)
        return [payload for payload in payloads if payload is not None]


def payload_of(run: bytes) -> bytes | None:
    """What a frame carries; None where it is none."""
    plain = bytearray()
    at = 0
    while at < len(run) <= LONGEST:
        code = run[at]
        if at + code > len(run):
            return None
        plain += run[at + 1 : at + code]
        at += code
        if code < 0xFF and at < len(run):
            plain.append(0)
    payload, crc = bytes(plain[:-2]), bytes(plain[-2:])
    return payload if len(plain) > 2 and crc_hqx(payload, 0xFFFF) == int.from_bytes(crc, "little") else None


def framed(payload: bytes) -> bytes:
    """The frame of a payload of less than 250 bytes."""
    rest = payload + crc_hqx(payload, 0xFFFF).to_bytes(2, "little")
    return b"\0" + b"".join(bytes([len(part) + 1]) + part for part in rest.split(b"\0")) + b"\0"


def number_in(payload: bytes) -> int | None:
    """The number of a message; None where it is too short to have one."""
    return int(_NUMBERED.unpack_from(payload)[1]) if len(payload) >= _NUMBERED.size else None


def said_in(payload: bytes) -> Said | None:
    """The telemetry in a payload; None where it holds something else."""
    if len(payload) != _TELEMETRY.size or payload[0] != TELEMETRY:
        return None
    _, seq, period, time_us, status, *_, command_us, _, dropped = _TELEMETRY.unpack(payload)
    return Said(seq, period, time_us, status, command_us, dropped)


def total_in(payload: bytes) -> float | None:
    """The sum of a Command; None where the payload holds something else."""
    if len(payload) != _COMMAND.size or payload[0] != COMMAND:
        return None
    return float(_COMMAND.unpack(payload)[2])


def with_clock(payload: bytes, time_us: int) -> bytes:
    """Telemetry that says another time [µs]."""
    return payload[:5] + (time_us % 2**32).to_bytes(4, "little") + payload[9:]
