"""MCAP files out of chunks that are ready-made.

mcap's own writer takes one message at a time; this one takes a chunk's worth of records at once, which is what makes
long logs quick to write. The small records are encoded by mcap. The format: https://mcap.dev/spec.
"""

import zlib
from collections.abc import Iterable, Mapping
from typing import BinaryIO, NamedTuple, Protocol

import numpy as np
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from numpy.typing import NDArray

MAGIC = b"\x89MCAP0\r\n"


class Record(Protocol):
    """Anything of mcap that can write itself."""

    def write(self, stream: RecordBuilder) -> None:
        """Append the encoded record to `stream`."""


class MessageTimes(NamedTuple):
    """Where the messages of one channel lie in a chunk.

    Attributes:
        log_times: (n,) [ns].
        offsets: (n,) from the chunk's first byte, before compression.
    """

    log_times: NDArray[np.uint64]
    offsets: NDArray[np.uint64]


class McapFile:
    """An MCAP file being written: metadata, attachments and chunks in any order, then `finish`.

    Args:
        stream: to write to.
        level: of zstandard's compression.
    """

    def __init__(self, stream: BinaryIO, level: int = 3) -> None:
        self._stream = stream
        self._crc = 0
        self._length = 0
        self._metadata: list[MetadataIndex] = []
        self._attachments: list[AttachmentIndex] = []
        self._chunks: list[ChunkIndex] = []
        self._counts: dict[int, int] = {}
        self._compressor = zstandard.ZstdCompressor(level=level)
        self._put(MAGIC + encode(Header(profile="", library="twbal")))

    def add_metadata(self, name: str, entries: dict[str, str]) -> None:
        """Write a metadata record."""
        data = encode(Metadata(name=name, metadata=entries))
        self._metadata.append(MetadataIndex(offset=self._length, length=len(data), name=name))
        self._put(data)

    def add_attachment(self, name: str, media_type: str, content: bytes) -> None:
        """Write an attachment."""
        attachment = Attachment(create_time=0, log_time=0, name=name, media_type=media_type, data=content)
        data = encode(attachment)
        self._attachments.append(
            AttachmentIndex(
                offset=self._length,
                length=len(data),
                log_time=0,
                create_time=0,
                data_size=len(content),
                name=name,
                media_type=media_type,
            )
        )
        self._put(data)

    def add_chunk(self, records: bytes, index: Mapping[int, MessageTimes]) -> None:
        """Write a chunk, compressed, and its message indexes.

        Args:
            records: encoded schemas, channels and messages.
            index: where the messages of each channel lie in `records`, by channel id.
        """
        times = np.concatenate([entry.log_times for entry in index.values()])
        span = {"message_start_time": int(times.min()), "message_end_time": int(times.max())}
        compressed = self._compressor.compress(records)
        chunk = encode(
            Chunk(
                compression="zstd",
                data=compressed,
                uncompressed_crc=zlib.crc32(records),
                uncompressed_size=len(records),
                **span,
            )
        )
        start = self._length
        self._put(chunk)
        places = {}
        for channel, entry in index.items():
            places[channel] = self._length
            self._counts[channel] = self._counts.get(channel, 0) + len(entry.log_times)
            self._put(_message_index(channel, entry))
        self._chunks.append(
            ChunkIndex(
                chunk_length=len(chunk),
                chunk_start_offset=start,
                compression="zstd",
                compressed_size=len(compressed),
                message_index_length=self._length - start - len(chunk),
                message_index_offsets=places,
                uncompressed_size=len(records),
                **span,
            )
        )

    def finish(self, schemas: list[Schema], channels: list[Channel]) -> None:
        """Write the summary and the end of the file."""
        self._put(encode(DataEnd(self._crc)))
        start = self._length
        statistics = Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(channels),
            channel_message_counts=self._counts,
            chunk_count=len(self._chunks),
            message_count=sum(self._counts.values()),
            message_end_time=max(chunk.message_end_time for chunk in self._chunks),
            message_start_time=min(chunk.message_start_time for chunk in self._chunks),
            metadata_count=len(self._metadata),
            schema_count=len(schemas),
        )
        groups: list[tuple[Opcode, Iterable[Record]]] = [
            (Opcode.SCHEMA, schemas),
            (Opcode.CHANNEL, channels),
            (Opcode.STATISTICS, [statistics]),
            (Opcode.CHUNK_INDEX, self._chunks),
            (Opcode.ATTACHMENT_INDEX, self._attachments),
            (Opcode.METADATA_INDEX, self._metadata),
        ]
        summary, offsets = b"", b""
        for opcode, group in groups:
            data = encode(*group)
            if data:
                offsets += encode(SummaryOffset(int(opcode), start + len(summary), len(data)))
            summary += data
        footer = Footer(summary_start=start, summary_offset_start=start + len(summary), summary_crc=0)
        footer.summary_crc = zlib.crc32(summary + offsets + encode(footer)[:-4])
        self._put(summary + offsets + encode(footer) + MAGIC)

    def _put(self, data: bytes) -> None:
        self._stream.write(data)
        self._crc = zlib.crc32(data, self._crc)
        self._length += len(data)


def encode(*records: Record) -> bytes:
    """The bytes of these records."""
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    data: bytes = builder.end()  # type: ignore[no-untyped-call]
    return data


def _message_index(channel: int, entry: MessageTimes) -> bytes:
    # As mcap.records.MessageIndex writes it, but in one go: it is the bulk of a log's small records.
    body = np.stack([entry.log_times, entry.offsets], axis=1).astype("<u8").tobytes()
    head = channel.to_bytes(2, "little") + len(body).to_bytes(4, "little")
    return bytes([Opcode.MESSAGE_INDEX]) + (len(head) + len(body)).to_bytes(8, "little") + head + body
