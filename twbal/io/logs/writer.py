"""An episode into an MCAP file."""

from pathlib import Path

import numpy as np
from mcap.records import Message
from numpy.typing import NDArray

from twbal.core.episode import Episode, Event
from twbal.core.errors import DataError
from twbal.core.files import replacing
from twbal.core.gaussian import Array
from twbal.io.logs.container import McapFile, MessageTimes, encode
from twbal.io.logs.layout import Layout, layout_of
from twbal.io.logs.metadata import CONFIG_NAME, METADATA_NAME, metadata_of
from twbal.io.logs.rows import columns_of
from twbal.io.logs.topics import Topic

_CHUNK_BYTES = 16 * 1024  # before compression; whole chunks are what a damaged file loses
_LONG = 10_000  # samples from which on a log is written in less time: in larger chunks, by a faster compression
_LONG_CHUNK_BYTES, _LEVEL, _LONG_LEVEL = 64 * 1024, 3, 1


def write_episode(path: Path, episode: Episode) -> None:
    """Write `episode` to `path`, wholly or not at all; the same episode gives the same bytes.

    Raises:
        DataError: the file cannot be written, a channel's name cannot be a field's, or a time cannot be a log time.
    """
    layout = layout_of(episode.channels)
    values = columns_of(episode)
    times = _log_times(episode.observations[:, 0], "sample")
    event_times = _log_times(np.array([event.time for event in episode.events]), "event")
    long = len(times) >= _LONG
    rows = -(-(_LONG_CHUNK_BYTES if long else _CHUNK_BYTES) // len(layout.template))
    # An event lies in the chunk of the last sample before it.
    event_chunks = np.maximum(np.searchsorted(times, event_times, side="right") - 1, 0) // rows
    with replacing(path) as stream:
        file = McapFile(stream, _LONG_LEVEL if long else _LEVEL)
        file.add_metadata(METADATA_NAME, metadata_of(episode))
        if episode.provenance.config:
            file.add_attachment(CONFIG_NAME, "application/yaml", episode.provenance.config.encode())
        for number, first in enumerate(range(0, len(times), rows)):
            part = slice(first, first + rows)
            chunk = _Chunk(layout.definitions if number == 0 else b"")
            chunk.add_samples(layout, first, times[part], values[part], ends_episode=part.stop >= len(times))
            for index in np.flatnonzero(event_chunks == number):
                chunk.add_event(layout.events, int(index), int(event_times[index]), episode.events[index])
            file.add_chunk(chunk.records, chunk.index)
        file.finish([topic.schema for topic in layout.topics], [topic.channel for topic in layout.topics])


class _Chunk:
    """A chunk in the making: `records` and the `index` of its messages."""

    def __init__(self, definitions: bytes) -> None:
        self.records = definitions
        self.index: dict[int, MessageTimes] = {}

    def add_samples(
        self, layout: Layout, first: int, times: NDArray[np.uint64], values: Array, ends_episode: bool
    ) -> None:
        size = len(layout.template)
        starts = np.arange(len(times), dtype=np.uint64) * np.uint64(size) + np.uint64(len(self.records))
        for topic, offset in zip(layout.samples, layout.offsets, strict=True):
            count = len(times) - (ends_episode and topic is layout.samples[-1])
            if count:
                self.index[topic.id] = MessageTimes(times[:count], starts[:count] + np.uint64(offset))
        data = layout.pack(first, times, values)
        # No command follows the last observation, and the command lies last in a sample.
        self.records += data[: layout.offsets[-1] - size] if ends_episode else data

    def add_event(self, topic: Topic, sequence: int, time: int, event: Event) -> None:
        known = self.index.get(topic.id, MessageTimes(np.zeros(0, np.uint64), np.zeros(0, np.uint64)))
        offset = len(self.records)
        self.index[topic.id] = MessageTimes(
            *(np.append(a, np.uint64(b)) for a, b in zip(known, (time, offset), strict=True))
        )
        payload = topic.message_class(time=event.time, text=event.text).SerializeToString(deterministic=True)
        self.records += encode(
            Message(channel_id=topic.id, log_time=time, data=payload, publish_time=time, sequence=sequence)
        )


def _log_times(times: Array, what: str) -> NDArray[np.uint64]:
    """Log times [ns] for times of the robot's clock [s]; what lies before its zero is logged at 0."""
    ns = np.rint(np.maximum(times, 0.0) * 1e9)
    bad = np.flatnonzero(~(np.isfinite(times) & (ns < 2.0**63)))
    if len(bad):
        raise DataError(f"Time {times[bad[0]]} s of {what} {bad[0]} cannot be a log time; it must be under 2⁶³ ns.")
    return ns.astype(np.uint64)
