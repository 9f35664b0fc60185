"""What can be found in the bytes of an episode log, whether it is whole or not."""

import struct
from collections import defaultdict
from contextlib import suppress
from functools import cached_property

import numpy as np
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.message import DecodeError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Metadata, Schema
from numpy.typing import NDArray

from twbal.core.episode import Event
from twbal.core.errors import LogError
from twbal.core.gaussian import Array
from twbal.io.logs.layout import SampleLayout, layout_of
from twbal.io.logs.metadata import CONFIG_NAME, METADATA_NAME, Description, description_of
from twbal.io.logs.records import (
    MAGIC,
    DamageError,
    RecordSpan,
    attachment_at,
    check_end,
    parse,
    span_at,
    spans,
    unpacked,
)
from twbal.io.logs.topics import Topic

_MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time
_UNFOLDED = 2**28  # bytes in all chunks that are read in any case
_MOST_TIMES = 200  # a log's size: samples shrink to a half or a fifth, and a file that shrinks more holds no samples


class Contents:
    """What was found in the bytes of a log, up to the first place where they stop making sense.

    Attributes:
        description: what the metadata record says; None where there is none.
        config: the configuration's text.
        topics: names of all topics that were met.
        damage: what is wrong with the bytes; empty where nothing is.

    Raises:
        LogError: the log is of another schema version, or its messages are not an episode's; the message names no file.
    """

    def __init__(self, data: bytes) -> None:
        self.description: Description | None = None
        self.config = ""
        self.topics: list[str] = []
        self.damage = ""
        self._layout: SampleLayout | None = None
        self._has_chunks = False
        self._unfolded = 0
        self._schemas: dict[int, Schema] = {}
        self._known: dict[int, Topic] = {}
        self._pieces: dict[str, list[tuple[NDArray[np.int64], Array]]] = defaultdict(list)
        self._events: dict[int, Event] = {}
        try:
            self.description = find_description(data)
            if self.description is not None:
                found = self.description
                self._layout = layout_of(found.channels, found.poses, found.references, found.headings)
            self._walk(data, len(MAGIC))
        except DamageError as damage:
            self.damage = str(damage)

    @property
    def events(self) -> tuple[Event, ...]:
        """The events in the order in which the episode had them."""
        return tuple(self._events[number] for number in sorted(self._events))

    @cached_property
    def columns(self) -> dict[str, Array]:
        """Of each sample topic the fields of its messages, (n, F), from sample 0 to the first that is missing."""
        assert self._layout is not None
        columns = {}
        for topic in self._layout.samples:
            nothing = (np.empty(0, np.int64), np.empty((0, len(topic.fields))))
            numbers, values = zip(nothing, *self._pieces[topic.name], strict=True)
            columns[topic.name] = _from_zero(np.concatenate(numbers), np.concatenate(values))
        return columns

    def _walk(self, data: bytes, position: int, is_chunk: bool = False) -> None:
        while position < len(data):
            span = span_at(data, position)
            position = span.stop
            if span.opcode == Opcode.MESSAGE:
                if self._has_chunks and not is_chunk:
                    # No checksum of its own guards it: more likely another kind of record whose first byte changed.
                    raise DamageError(f"a message lies outside the chunks, at byte {span.start}")
                position = self._take_messages(data, span)
            elif span.opcode == Opcode.SCHEMA:
                schema = parse(Schema, data, span)
                self._schemas[schema.id] = schema
            elif span.opcode == Opcode.CHANNEL:
                self._take_channel(parse(Channel, data, span))
            elif is_chunk:
                continue
            elif span.opcode == Opcode.CHUNK:
                self._take_chunk(data, span)
            elif span.opcode == Opcode.ATTACHMENT:
                self._take_attachment(data, span)
            elif span.opcode == Opcode.DATA_END:
                return check_end(data, span)
        if not is_chunk:
            raise DamageError("the end of its data is missing")

    def _take_chunk(self, data: bytes, span: RecordSpan) -> None:
        self._has_chunks = True
        records = unpacked(parse(Chunk, data, span))
        self._unfolded += len(records)
        if self._unfolded > max(_UNFOLDED, _MOST_TIMES * len(data)):
            raise DamageError(f"its chunks hold more than {_MOST_TIMES} times its {len(data)} bytes")
        self._walk(records, 0, is_chunk=True)

    def _take_channel(self, channel: Channel) -> None:
        if channel.topic not in self.topics:
            self.topics.append(channel.topic)
        for topic in self._layout.topics if self._layout else ():
            if topic.name == channel.topic:
                _check_type(topic, channel, self._schemas.get(channel.schema_id))
                self._known[channel.id] = topic

    def _take_attachment(self, data: bytes, span: RecordSpan) -> None:
        try:
            attachment = attachment_at(data, span)
            if attachment.name == CONFIG_NAME:
                self.config = attachment.data.decode()
        except (DamageError, UnicodeDecodeError) as damage:
            self.damage = str(damage)  # the samples can be good all the same

    def _take_messages(self, data: bytes, span: RecordSpan) -> int:
        """Read the message at `span`, or all samples that begin there; return where reading goes on."""
        if span.stop - span.start < _MESSAGE.size:
            raise DamageError(f"the message at byte {span.start} is too short")
        channel, number, _, _ = _MESSAGE.unpack_from(data, span.start)
        topic = self._known.get(channel)
        if topic is None or self._layout is None:
            return span.stop
        if topic is self._layout.samples[0] and all(self._known.get(t.id) is t for t in self._layout.samples):
            numbers, values = self._layout.unpack(data, span.begin)
            if len(numbers):
                for sampled, part in self._layout.parts:
                    self._pieces[sampled.name].append((numbers, values[:, part]))
                return span.begin + len(numbers) * self._layout.size
        self._take_message(topic, number, data[span.start + _MESSAGE.size : span.stop])
        return span.stop

    def _take_message(self, topic: Topic, number: int, payload: bytes) -> None:
        try:
            message = topic.decode(payload)
        except DecodeError as error:
            raise DamageError(f"message {number} on {topic.name} cannot be decoded ({error})") from error
        if topic.text:
            self._events[number] = Event(message.time, message.text)
        else:
            values = np.array([[getattr(message, name) for name in topic.fields]], np.float64)
            self._pieces[topic.name].append((np.array([number]), values))


def find_description(data: bytes) -> Description | None:
    """What the metadata record in the bytes of a log says; None where there is none.

    Raises:
        DamageError: the bytes before it make no sense.
        LogError: the log is of another schema version; the message names no file.
    """
    for span in spans(data, len(MAGIC)):
        if span.opcode == Opcode.METADATA:
            record = parse(Metadata, data, span)
            if record.name == METADATA_NAME:
                return description_of(record.metadata)
        if span.opcode == Opcode.DATA_END:
            return None
    return None


def _check_type(topic: Topic, channel: Channel, schema: Schema | None) -> None:
    if schema is not None and channel.message_encoding == schema.encoding == "protobuf":
        with suppress(DecodeError):  # parsed, as another version of protobuf may write the same in other bytes
            if FileDescriptorSet.FromString(schema.data) == topic.descriptor:
                return
    found = f"{schema.name!r} ({schema.encoding})" if schema else "no schema"
    raise LogError(
        f"has messages of another type on topic {topic.name!r}: found {found}, expected {topic.message_name!r} with "
        f"the doubles {', '.join(topic.fields) or '(none)'}"
    )


def _from_zero(numbers: NDArray[np.int64], values: Array) -> Array:
    """The rows numbered 0, 1, 2, ... up to the first number that is missing or there twice."""
    if (numbers == np.arange(len(numbers))).all():
        return values
    order = np.argsort(numbers, kind="stable")
    misplaced = np.flatnonzero(numbers[order] != np.arange(len(numbers)))
    return values[order[: misplaced[0]] if len(misplaced) else order]
