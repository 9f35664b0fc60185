"""Which messages an episode log holds, and how the messages of one sample lie side by side in it.

All numbers of a message are always written, so a sample takes up the same number of bytes each time, and the samples of
a chunk are unpacked as one numpy array: decoding them one by one takes five times as long. The places of the numbers
are found out from what mcap and protobuf write.
"""

import re
import struct
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from mcap.data_stream import RecordBuilder
from mcap.records import Message
from numpy.typing import NDArray

from twbal.core.errors import DataError
from twbal.core.gaussian import Array
from twbal.core.heading import HeadingSample
from twbal.core.motion_profile import Motion
from twbal.core.plant import Pose
from twbal.io.logs.topics import Topic, unit_of

_MOST_CHANNELS = 256
_FIELD_NAME = re.compile(r"[a-z][a-z0-9_]*")


class _Template(NamedTuple):
    """Where things lie in the bytes of one sample, of K numbers and M messages.

    Attributes:
        same: (F,) the bytes that are the same in every sample.
        fixed: (F,) their places.
        sequences: (4 M,) places of the messages' sequences.
        numbers: (8 K,) places of the numbers.
    """

    same: NDArray[np.uint8]
    fixed: NDArray[np.intp]
    sequences: NDArray[np.intp]
    numbers: NDArray[np.intp]


@dataclass(frozen=True)
class SampleLayout:
    """The messages of one sample: IMU, wheels, state, true pose, the reference that was followed, the command given.

    Attributes:
        channels: names of the state channels.
        poses: whether each sample has a true pose.
        references: whether the robot followed a reference.
        headings: whether its heading was controlled.

    Raises:
        DataError: a channel's name cannot be the name of a field.
    """

    channels: tuple[str, ...]
    poses: bool = False
    references: bool = False
    headings: bool = False

    def __post_init__(self) -> None:
        bad = [name for name in self.channels if not _FIELD_NAME.fullmatch(name)]
        # As protobuf writes names in JSON: two fields must not be called the same there either.
        distinct = {"".join(word[:1].upper() + word[1:] for word in name.split("_")) for name in self.channels}
        if bad or len(distinct) != len(self.channels) or len(self.channels) > _MOST_CHANNELS:
            raise DataError(
                f"State channels {str(list(self.channels))[:200]} cannot be fields of a log: names must be distinct, "
                "also without their underscores, of lower-case letters, digits and underscores, beginning with a "
                f"letter, and {_MOST_CHANNELS} at most."
            )

    @cached_property
    def samples(self) -> tuple[Topic, ...]:
        """The topics with one message a sample, in the order in which they are written."""
        imu = ("time", "tilt", "tilt_rate", "acceleration", "yaw_rate")
        pose = (Topic(6, "/pose", Pose._fields, ("m", "m", "rad", "rad")),) if self.poses else ()
        # Ids count from 1 without a gap, as the writer gives them.
        reference = (Topic(6 + self.poses, "/reference", Motion._fields, ("m", "m/s", "m/s²")),) * self.references
        units = ("rad", "rad/s", "rad", "rad/s", "N·m")
        place = 6 + self.poses + self.references
        heading = (Topic(place, "/heading", HeadingSample._fields, units),) * self.headings
        return (
            Topic(1, "/imu", imu, ("s", "rad", "rad/s", "m/s²", "rad/s")),
            Topic(2, "/wheels", ("angle", "rate"), ("rad", "rad/s")),
            Topic(3, "/state", self.channels, tuple(unit_of(name) for name in self.channels)),
            *pose,
            *reference,
            *heading,
            Topic(4, "/command", ("torque",), ("N·m",)),
        )

    @cached_property
    def events(self) -> Topic:
        """The topic of what happened on the way."""
        return Topic(5, "/event", ("time",), ("s",), text=True)

    @property
    def topics(self) -> tuple[Topic, ...]:
        """All topics, in the order of their ids."""
        return tuple(sorted((*self.samples, self.events), key=lambda topic: topic.id))

    @cached_property
    def parts(self) -> tuple[tuple[Topic, slice], ...]:
        """The `samples` topics, each with the place of its fields among those of all of them side by side."""
        ends = np.cumsum([0] + [len(topic.fields) for topic in self.samples]).tolist()
        return tuple((topic, slice(*place)) for topic, place in zip(self.samples, pairwise(ends), strict=True))

    @cached_property
    def size(self) -> int:
        """Bytes of one sample's message records."""
        return len(self._records(b"\0"))

    @cached_property
    def _form(self) -> _Template:
        ones, twos = (np.frombuffer(self._records(byte), np.uint8) for byte in (b"\x01", b"\x02"))
        changing = ones != twos
        begins = np.flatnonzero(np.diff(changing, prepend=False) & changing)
        # Sequence, log time and publish time of each message lie together, and then its numbers, a tag before each.
        firsts = np.cumsum([0] + [1 + len(topic.fields) for topic in self.samples[:-1]])
        sequences, numbers = begins[firsts], np.delete(begins, firsts)
        return _Template(
            ones[~changing],
            np.flatnonzero(~changing),
            (sequences[:, None] + np.arange(4)).ravel(),
            (numbers[:, None] + np.arange(8)).ravel(),
        )

    def _records(self, byte: bytes) -> bytes:
        """The message records of one sample, with `byte` wherever one sample differs from the next."""
        builder = RecordBuilder()
        (number,), time, sequence = struct.unpack("<d", 8 * byte), int.from_bytes(8 * byte), int.from_bytes(4 * byte)
        for topic in self.samples:
            payload = topic.message_class(**dict.fromkeys(topic.fields, number)).SerializeToString()
            Message(topic.id, time, payload, time, sequence).write(builder)
        return bytes(builder.end())  # type: ignore[no-untyped-call]

    def unpack(self, data: bytes, start: int) -> tuple[NDArray[np.int64], Array]:
        """The samples that lie at `start` as they are written: as many as follow each other without anything between.

        Returns:
            Their indices (n,) and their values (n, K), the fields of all `samples` topics side by side; n may be 0.
        """
        form = self._form
        count = (len(data) - start) // self.size
        rows = np.frombuffer(data, np.uint8, count * self.size, start).reshape(count, self.size)
        sequences = rows.take(form.sequences, axis=1).view("<u4")
        whole = (rows.take(form.fixed, axis=1) == form.same).all(axis=1) & (sequences == sequences[:, :1]).all(axis=1)
        if not whole.all():
            count = int(np.argmin(whole))
        return sequences[:count, 0].astype(np.int64), rows[:count].take(form.numbers, axis=1).view("<f8")


@lru_cache(maxsize=32)
def layout_of(
    channels: tuple[str, ...], poses: bool = False, references: bool = False, headings: bool = False
) -> SampleLayout:
    """The layout for these state channels, with or without true poses, references and headings, made once."""
    return SampleLayout(channels, poses, references, headings)
