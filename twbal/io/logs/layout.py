"""Which messages an episode log holds, and how one sample of them lies in the file.

Every number of a message is a protobuf double, and all of them are always written, so the messages of one sample have a
fixed size: many samples are packed and unpacked as one numpy array, and the descriptors inside the file let every other
tool read them as ordinary protobuf. Encoding (`pack`) and decoding (`unpack`) stand side by side here.
"""

import re
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from mcap.records import Message
from numpy.typing import NDArray

from twbal.core.errors import DataError
from twbal.core.gaussian import Array
from twbal.io.logs.container import encode
from twbal.io.logs.topics import Topic, unit_of

_HEAD_SIZE = 31  # of a message record: u8 opcode, u64 length, u16 channel, u32 sequence, u64 log and publish time
_CHANGING = (("sequence", "<u4", 11), ("log_time", "<u8", 15), ("publish_time", "<u8", 23))  # and where they lie in it
_MOST_CHANNELS = 256
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
        if bad or len(set(self.channels)) != len(self.channels) or len(self.channels) > _MOST_CHANNELS:
            raise DataError(
                f"State channels {str(list(self.channels))[:200]} cannot be fields of a log: names must be distinct, "
                "of lower-case letters, digits and underscores, beginning with a letter, and "
                f"{_MOST_CHANNELS} at most."
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
    def definitions(self) -> bytes:
        """The schema and channel records of all topics."""
        return encode(*(topic.schema for topic in self.topics), *(topic.channel for topic in self.topics))

    @cached_property
    def template(self) -> bytes:
        """The message records of one sample, with zeros for all that changes from sample to sample."""
        payloads = [b"".join(_tag(number) + bytes(8) for number in topic.numbers) for topic in self.samples]
        return encode(
            *(
                Message(channel_id=topic.id, log_time=0, data=payload, publish_time=0, sequence=0)
                for topic, payload in zip(self.samples, payloads, strict=True)
            )
        )

    @cached_property
    def offsets(self) -> tuple[int, ...]:
        """Where in the template each topic's record begins."""
        sizes = [_HEAD_SIZE + sum(len(_tag(n)) + 8 for n in topic.numbers) for topic in self.samples]
        return tuple(sum(sizes[:i]) for i in range(len(sizes)))

    @cached_property
    def row(self) -> np.dtype[np.void]:
        """One sample as a numpy record: what changes from sample to sample, by its place in the template."""
        names, formats, places = [], [], []
        for topic, start in zip(self.samples, self.offsets, strict=True):
            for name, kind, place in _CHANGING:
                names.append(f"{topic.name}.{name}")
                formats.append(kind)
                places.append(start + place)
            place = start + _HEAD_SIZE
            for number in topic.numbers:
                place += len(_tag(number))
                names.append(f"{topic.name}#{number}")
                formats.append("<f8")
                places.append(place)
                place += 8
        return np.dtype({"names": names, "formats": formats, "offsets": places, "itemsize": len(self.template)})

    @cached_property
    def fields(self) -> tuple[str, ...]:
        """Names in `row` of all fields of all messages, in order."""
        return tuple(f"{topic.name}#{number}" for topic in self.samples for number in topic.numbers)

    @cached_property
    def fixed(self) -> NDArray[np.intp]:
        """Indices of the template's bytes that are the same in every sample."""
        ones = np.frombuffer(bytearray(b"\x01" * len(self.template)), dtype=self.row)
        for name in self.row.names or ():
            ones[name] = 0
        return np.flatnonzero(ones.view(np.uint8))

    def pack(self, first: int, log_times: NDArray[np.uint64], values: Array) -> bytes:
        """The message records of n consecutive samples.

        Args:
            first: index of the first of them within the episode.
            log_times: (n,) [ns].
            values: (n, K), the fields of all `samples` topics side by side.
        """
        data = bytearray(self.template * len(values))
        rows = np.frombuffer(data, dtype=self.row)
        for topic in self.samples:
            rows[f"{topic.name}.sequence"] = np.arange(first, first + len(values))
            rows[f"{topic.name}.log_time"] = rows[f"{topic.name}.publish_time"] = log_times
        for column, name in enumerate(self.fields):
            rows[name] = values[:, column]
        return bytes(data)

    def unpack(self, data: bytes, start: int) -> tuple[NDArray[np.int64], Array]:
        """The samples that lie at `start` as `pack` puts them: as many as follow each other without anything between.

        Returns:
            Their indices (n,) and their values (n, K); n may be 0.
        """
        size = len(self.template)
        count = (len(data) - start) // size
        rows = np.frombuffer(data, self.row, count, start)
        same = np.frombuffer(self.template, np.uint8)[self.fixed]
        whole = (rows.view(np.uint8).reshape(count, size)[:, self.fixed] == same).all(axis=1)
        sequence = rows[f"{self.samples[0].name}.sequence"].astype(np.int64)
        for topic in self.samples[1:]:
            whole &= rows[f"{topic.name}.sequence"] == sequence
        if not whole.all():
            count = int(np.argmin(whole))
        values = np.empty((count, len(self.fields)))
        for column, name in enumerate(self.fields):
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
