"""How messages are laid out: from one definition follow their bytes, the firmware's C header and the specification.

A message is its type, its number and its fields in order, packed and little-endian. Each field's annotation says how it
travels, and what it means. Measured values travel as float32: it is what a microcontroller computes with, and its
resolution (1e-8 rad at a tilt of 10°, 1e-5 rad at 100 rad of wheel angle) is far below any sensor's noise.
"""

import struct
from dataclasses import dataclass
from enum import Enum
from math import nan
from typing import Annotated, Any, ClassVar, NamedTuple, Self, get_args, get_type_hints

from twbal.core.errors import printable

MAX_TEXT = 200
"""Longest text in a message [bytes of UTF-8]."""


class Wire(NamedTuple):
    """How a value travels.

    Attributes:
        code: of `struct`; empty for a text, which ends with the payload.
        c_type: in C.
    """

    code: str
    c_type: str


U8, U16, U32 = Wire("B", "uint8_t"), Wire("H", "uint16_t"), Wire("I", "uint32_t")
F32, TEXT = Wire("f", "float"), Wire("", "char")


class FieldLayout(NamedTuple):
    """A field of a message.

    Attributes:
        name: of the field.
        kind: its type in Python.
        wire: how it travels.
        meaning: unit and sense, for people.
    """

    name: str
    kind: type[Any]
    wire: Wire
    meaning: str


@dataclass(frozen=True)
class Message:
    """A message.

    Attributes:
        seq: its number.
        TYPE: its first byte.
        LAYOUT: its fields after that.
        PACKING: of all that has a fixed length.
        ENUMS: place and type of each field that is an enumeration.
    """

    seq: Annotated[int, U16, "number of the message"]

    TYPE: ClassVar[int]
    LAYOUT: ClassVar[tuple[FieldLayout, ...]]
    PACKING: ClassVar[struct.Struct]
    ENUMS: ClassVar[tuple[tuple[int, type[Enum]], ...]]

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        hints = get_type_hints(cls, include_extras=True)
        annotated = {name: get_args(hint) for name, hint in hints.items() if hasattr(hint, "__metadata__")}
        cls.LAYOUT = tuple(FieldLayout(name, *parts) for name, parts in annotated.items())
        cls.PACKING = struct.Struct("<B" + "".join(field.wire.code for field in cls.LAYOUT))
        cls.ENUMS = tuple((i, field.kind) for i, field in enumerate(cls.LAYOUT) if issubclass(field.kind, Enum))

    @classmethod
    def ends_with_text(cls) -> bool:
        """Whether the last field is a text, which ends with the payload."""
        return cls.LAYOUT[-1].wire is TEXT

    def encode(self) -> bytes:
        """The payload of a frame."""
        values = [self.TYPE, *(getattr(self, field.name) for field in self.LAYOUT)]
        text = text_bytes(values.pop()) if self.ends_with_text() else b""
        return self.PACKING.pack(*values) + text

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """The message in a payload.

        Raises:
            struct.error: the length is wrong.
            ValueError: a field cannot be read.
        """
        size = cls.PACKING.size if cls.ends_with_text() else len(payload)
        # Absent values become one NaN, so that messages of the same bytes are equal.
        values: list[Any] = [value if value == value else nan for value in cls.PACKING.unpack(payload[:size])[1:]]
        for place, kind in cls.ENUMS:
            values[place] = kind(values[place])
        if cls.ends_with_text():
            values.append(printable(payload[size:].decode()))
        return cls(*values)


def text_bytes(text: str) -> bytes:
    """`text` in UTF-8, cut between characters where it is too long."""
    return text.encode()[:MAX_TEXT].decode(errors="ignore").encode()
