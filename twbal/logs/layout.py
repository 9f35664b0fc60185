"""Which messages an episode log holds, and how one sample of them lies in the file.

Every number of a message is a protobuf double, and all of them are always written, so the messages of one sample have a
fixed size: many samples are packed and unpacked as one numpy array, and the descriptors inside the file let every other
tool read them as ordinary protobuf. Encoding (`pack`) and decoding (`unpack`) stand side by side here.
"""

import re
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from mcap.data_stream import RecordBuilder
from mcap.records import Message
from numpy.typing import NDArray

from twbal.errors import DataError
from twbal.gaussian import Array
from twbal.logs.topics import Topic, unit_of

_FIELD_NAME = re.compile(r"[a-z][a-z0-9_]*")


@dataclass(frozen=True)
class Layout:
    """The messages of one sample: what the IMU saw, what the wheels did, the state made of it, the command given.

    Attributes:
        channels: names of the state channels.

    Raises:
        DataError: a channel's name cannot be the name of a field.
    """

    channels: tuple[str, ...]

    def __post_init__(self) -> None:
        bad = [name for name in self.channels if not _FIELD_NAME.fullmatch(name)]
        if bad or len(set(self.channels)) != len(self.channels):
            raise DataError(
                f"State channels {list(self.channels)} cannot be fields of a log: names must be distinct and of "
                "lower-case letters, digits and underscores, beginning with a letter."
            )

    @cached_property
    def samples(self) -> tuple[Topic, ...]:
        """The topics with one message a sample, in the order in which they are written."""
        imu = ("time", "tilt", "tilt_rate", "acceleration", "yaw_rate")
        return (
            Topic(1, "/imu", imu, ("s", "rad", "rad/s", "m/s²", "rad/s")),
            Topic(2, "/wheels", ("angle", "rate"), ("rad", "rad/s")),
            Topic(3, "/state", self.channels, tuple(unit_of(name) for name in self.channels)),
            Topic(4, "/command", ("torque",), ("N·m",)),
        )

    @cached_property
    def events(self) -> Topic:
        """The topic of what happened on the way."""
        return Topic(5, "/event", ("time",), ("s",), text=True)

    @property
    def topics(self) -> tuple[Topic, ...]:
        """All topics."""
        return (*self.samples, self.events)

    @cached_property
    def template(self) -> bytes:
        """The message records of one sample, with zeros for all that changes from sample to sample."""
        builder = RecordBuilder()
        for topic in self.samples:
            payload = b"".join(_tag(number) + bytes(8) for number in range(1, len(topic.fields) + 1))
            Message(channel_id=topic.id, log_time=0, data=payload, publish_time=0, sequence=0).write(builder)
        template: bytes = builder.end()  # type: ignore[no-untyped-call]
        return template

    @cached_property
    def offsets(self) -> tuple[int, ...]:
        """Where in the template each topic's record begins."""
        sizes = [31 + sum(len(_tag(n)) + 8 for n in range(1, len(topic.fields) + 1)) for topic in self.samples]
        return tuple(int(offset) for offset in np.cumsum([0, *sizes[:-1]]))

    @cached_property
    def row(self) -> np.dtype[np.void]:
        """What changes from sample to sample, by its place in the template."""
        names, formats, places = [], [], []
        for topic, start in zip(self.samples, self.offsets, strict=True):
            head = (("sequence", "<u4", 11), ("log_time", "<u8", 15), ("publish_time", "<u8", 23))
            place = start + 31
            for name, kind, shift in head:
                names.append(f"{topic.name}.{name}")
                formats.append(kind)
                places.append(start + shift)
            for number in range(1, len(topic.fields) + 1):
                place += len(_tag(number))
                names.append(f"{topic.name}#{number}")
                formats.append("<f8")
                places.append(place)
                place += 8
        return np.dtype({"names": names, "formats": formats, "offsets": places, "itemsize": len(self.template)})

    @cached_property
    def fixed(self) -> NDArray[np.intp]:
        """Indices of the template's bytes that are the same in every sample."""
        is_fixed = np.ones(len(self.template), dtype=bool)
        for name in self.row.names or ():
            kind, place = (self.row.fields or {})[name][:2]
            is_fixed[place : place + kind.itemsize] = False
        return np.flatnonzero(is_fixed)

    def pack(self, first: int, log_times: NDArray[np.uint64], values: Array) -> bytes:
        """The message records of n consecutive samples.

        Args:
            first: index of the first of them within the episode.
            log_times: (n,) [ns].
            values: (n, K), the fields of all `samples` topics side by side.
        """
        blank = np.frombuffer(self.template * len(values), dtype=np.uint8)
        rows = blank.copy().view(self.row)
        sequence = np.arange(first, first + len(values))
        column = 0
        for topic in self.samples:
            rows[f"{topic.name}.sequence"] = sequence
            rows[f"{topic.name}.log_time"] = rows[f"{topic.name}.publish_time"] = log_times
            for number in range(1, len(topic.fields) + 1):
                rows[f"{topic.name}#{number}"] = values[:, column]
                column += 1
        return rows.tobytes()

    def unpack(self, data: bytes, start: int) -> tuple[NDArray[np.int64], Array]:
        """The samples that lie at `start` as `pack` puts them: as many as follow each other without anything between.

        Returns:
            Their indices (n,) and their values (n, K); n may be 0.
        """
        count = (len(data) - start) // len(self.template)
        rows = np.frombuffer(data, self.row, count, start)
        fixed = np.frombuffer(self.template, np.uint8)[self.fixed]
        known = (rows.view(np.uint8).reshape(count, rows.itemsize)[:, self.fixed] == fixed).all(axis=1)
        sequence = rows[f"{self.samples[0].name}.sequence"].astype(np.int64)
        for topic in self.samples[1:]:
            known &= rows[f"{topic.name}.sequence"] == sequence
        count = count if known.all() else int(np.argmin(known))
        names = [f"{topic.name}#{n}" for topic in self.samples for n in range(1, len(topic.fields) + 1)]
        values = np.empty((count, len(names)))
        for column, name in enumerate(names):
            values[:, column] = rows[name][:count]
        return sequence[:count], values


@lru_cache(maxsize=32)
def layout_of(channels: tuple[str, ...]) -> Layout:
    """The layout for these state channels, made once."""
    return Layout(channels)


def _tag(number: int) -> bytes:
    """Protobuf's tag of a double: field number and wire type 1, as a varint."""
    value = number << 3 | 1
    return bytes([value]) if value < 128 else bytes([value & 127 | 128, value >> 7])
