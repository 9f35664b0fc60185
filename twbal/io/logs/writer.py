"""An episode into an MCAP file."""

import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np
from mcap.writer import Writer
from numpy.typing import NDArray

from twbal.core.episode import Episode
from twbal.core.errors import DataError
from twbal.core.files import replacing
from twbal.core.gaussian import Array
from twbal.io.logs.layout import SampleLayout, layout_of
from twbal.io.logs.metadata import CONFIG_NAME, METADATA_NAME, metadata_of
from twbal.io.logs.rows import columns_of

_CHUNK_BYTES = 16 * 1024  # before compression; whole chunks are what a damaged file loses
_LONG = 10_000  # samples from which on chunks are larger
_LONG_CHUNK_BYTES = 64 * 1024


def write_episode(
    path: Path, episode: Episode, progress: Callable[[Sequence[int]], Iterable[int]] = lambda chunks: chunks
) -> None:
    """Write `episode` to `path`, wholly or not at all; the same episode gives the same bytes.

    Args:
        path: of the file.
        episode: to write.
        progress: is given the chunks that will be written, and yields them one by one; a million samples take half
            a minute.

    Raises:
        DataError: the file cannot be written, a channel's name cannot be a field's, or a time cannot be a log time.
    """
    optional = (episode.poses, episode.references, episode.headings)
    layout = layout_of(episode.channels, *(values is not None for values in optional))
    values = columns_of(episode)
    times = _log_times(episode.observations[:, 0], "sample")
    event_times = _log_times(np.array([event.time for event in episode.events]), "event")
    rows = -(-(_LONG_CHUNK_BYTES if len(times) >= _LONG else _CHUNK_BYTES) // layout.size)
    # An event lies in the chunk of the last sample before it.
    event_chunks = np.maximum(np.searchsorted(times, event_times, side="right") - 1, 0) // rows
    with replacing(path) as stream:
        # mcap_protobuf's own writer knows neither units of channels nor checksums of the data.
        writer = Writer(stream, chunk_size=sys.maxsize, enable_data_crcs=True)  # a chunk ends where it is flushed
        writer.start(library="twbal")
        writer.add_metadata(METADATA_NAME, metadata_of(episode))
        if episode.provenance.config:
            writer.add_attachment(0, 0, CONFIG_NAME, "application/yaml", episode.provenance.config.encode())
        _register(writer, layout)
        for first in progress(range(0, len(times), rows)):
            part = slice(first, first + rows)
            _add_samples(writer, layout, first, times[part], values[part])
            for index in np.flatnonzero(event_chunks == first // rows).tolist():
                time, event = int(event_times[index]), episode.events[index]
                payload = layout.events.message_class(time=event.time, text=event.text).SerializeToString()
                writer.add_message(layout.events.id, time, payload, time, index)
            writer.flush()  # type: ignore[no-untyped-call]
        writer.finish()  # type: ignore[no-untyped-call]


def _register(writer: Writer, layout: SampleLayout) -> None:
    """Write the schemas and channels; they get the ids of their topics, which count from 1."""
    for topic in layout.topics:
        writer.register_schema(topic.schema.name, topic.schema.encoding, topic.schema.data)
    for topic in layout.topics:
        units = dict(zip(topic.fields, topic.units, strict=True))
        writer.register_channel(topic.name, "protobuf", topic.id, units)


def _add_samples(writer: Writer, layout: SampleLayout, first: int, times: NDArray[np.uint64], values: Array) -> None:
    """Write the messages of samples `first`, `first` + 1, ...; no command follows the last observation: it is NaN."""
    kinds = [(topic, topic.message_class, part) for topic, part in layout.parts]
    for number, (time, row) in enumerate(zip(times.tolist(), values.tolist(), strict=True), first):
        for topic, message, part in kinds if row[-1] == row[-1] else kinds[:-1]:
            payload = message(**dict(zip(topic.fields, row[part], strict=True))).SerializeToString()
            writer.add_message(topic.id, time, payload, time, number)


def _log_times(times: Array, what: str) -> NDArray[np.uint64]:
    """Log times [ns] for times of the robot's clock [s]; what lies before its zero is logged at 0."""
    ns = np.rint(np.maximum(times, 0.0) * 1e9)
    bad = np.flatnonzero(~(np.isfinite(times) & (ns < 2.0**63)))
    if len(bad):
        raise DataError(f"Time {times[bad[0]]} s of {what} {bad[0]} cannot be a log time; it must be under 2⁶³ ns.")
    return ns.astype(np.uint64)
