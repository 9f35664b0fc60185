"""From bytes to messages and back, of both versions of the protocol."""

import struct

from twbal.link.frame import Splitter, unwrap, wrap
from twbal.link.message import Message
from twbal.link.protocol import OWN, SHARED, VERSION, Hello, Welcome
from twbal.link.version_1 import OWN_1, VERSION_1, Welcome1

_KNOWN = {None: (*SHARED, *OWN, *OWN_1), VERSION_1: (*SHARED, *OWN_1), VERSION: (*SHARED, *OWN)}


def to_wire(message: Message) -> bytes:
    """The frame of a message."""
    return wrap(message.encode())


class Decoder:
    """Turns bytes into messages; what is not a message is counted and dropped, never an error.

    Args:
        version: whose messages are known; None: those of all versions.

    Attributes:
        unreadable: what was wrong with the last frame whose CRC is right and which is no message all the same; empty
            where there was none. Noise makes no such frame; other firmware does.
    """

    def __init__(self, version: int | None = None) -> None:
        self.unreadable = ""
        self._kinds = {kind.TYPE: kind for kind in _KNOWN[version]}
        self._splitter = Splitter()
        self._undecodable = 0

    @property
    def bad_frames(self) -> int:
        """Frames dropped so far: a wrong CRC, an unknown type, a wrong length."""
        return self._undecodable + self._splitter.overlong

    def feed(self, data: bytes) -> list[Message]:
        """The messages that `data` completes, in order; `data` may end anywhere."""
        messages = [self._decode(run) for run in self._splitter.feed(data)]
        return [m for m in messages if m is not None]

    def _decode(self, run: bytes) -> Message | None:
        payload = unwrap(run)
        kind = self._kinds.get(payload[0]) if payload else None
        if payload and kind is None:
            self.unreadable = f"a message of the unknown type 0x{payload[0]:02x}"
        if payload and kind is not None:
            try:
                return _welcome(payload) if kind is Welcome else kind.decode(payload)
            except (struct.error, ValueError) as error:  # wrong length; unknown clock, or text that is not UTF-8
                self.unreadable = f"a {kind.__name__} of {len(payload)} bytes ({error})"
        self._undecodable += 1
        return None


def _welcome(payload: bytes) -> Message:
    """A Welcome of the version that it says; of an unknown one no more than that."""
    _, seq, version = Hello.PACKING.unpack_from(payload)  # laid out as its first fields, in every version
    if version == VERSION_1:
        return Welcome1.decode(payload)
    return Welcome.decode(payload) if version == VERSION else Welcome(seq, version)
