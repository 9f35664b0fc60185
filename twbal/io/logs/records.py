"""The records of an MCAP file, one by one and checked, so that a file damaged anywhere is seen to be damaged.

Each record is read by mcap. Where it begins and ends is found here, and not by mcap's `StreamReader`, which reads on
beyond the end of a record whose inner lengths are wrong, passes over what it does not know, compares neither the
checksums of attachments nor that of the summary, and spends most of its time in message indexes, which nobody needs.
"""

import struct
import zlib
from collections.abc import Iterator
from io import BytesIO
from typing import NamedTuple, TypeVar

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, DataEnd, Footer, Metadata, Schema
from mcap.stream_reader import get_chunk_data_stream
from mcap.writer import MCAP0_MAGIC

MAGIC = MCAP0_MAGIC
_HEAD = struct.Struct("<BQ")  # opcode, length of what follows
_FOOTER_SIZE = _HEAD.size + 20
_LARGEST_CHUNK = 2**28  # bytes before compression; a damaged length must not fill the memory
_Parsed = TypeVar("_Parsed", Attachment, Channel, Chunk, DataEnd, Footer, Metadata, Schema)


class DamageError(Exception):
    """The bytes stop making sense here; what was found before is good. Does not leave this folder."""


class RecordSpan(NamedTuple):
    """One record: its kind, where it begins, and where its content lies."""

    opcode: int
    begin: int
    start: int
    stop: int


def span_at(data: bytes, position: int) -> RecordSpan:
    """The record that begins at `position`.

    Raises:
        DamageError: it reaches beyond the end.
    """
    start = position + _HEAD.size
    if start <= len(data):
        opcode, length = _HEAD.unpack_from(data, position)
        if length <= len(data) - start:
            return RecordSpan(opcode, position, start, start + length)
    raise DamageError(f"it ends in the middle of the record at byte {position}")


def spans(data: bytes, position: int) -> Iterator[RecordSpan]:
    """The records from `position` on; raises as `span_at`."""
    while position < len(data):
        yield (span := span_at(data, position))
        position = span.stop


def parse(kind: type[_Parsed], data: bytes, span: RecordSpan) -> _Parsed:
    """Read one record with mcap.

    Raises:
        DamageError: it cannot be read.
    """
    stream = ReadDataStream(BytesIO(data[span.start : span.stop]))
    try:
        record: _Parsed = kind.read(stream)
    except (McapError, struct.error, UnicodeDecodeError, OverflowError, MemoryError) as error:
        raise DamageError(f"the record at byte {span.start} cannot be read ({error})") from error
    return record


def attachment_at(data: bytes, span: RecordSpan) -> Attachment:
    """An attachment, checked against its checksum.

    Raises:
        DamageError: it cannot be read, or its checksum does not fit.
    """
    content, crc = data[span.start : span.stop - 4], data[max(span.start, span.stop - 4) : span.stop]
    _check(int.from_bytes(crc, "little"), content, f"the attachment at byte {span.start}")
    return parse(Attachment, data, span)


def unpacked(chunk: Chunk) -> bytes:
    """The records in a chunk, checked against its checksum.

    Raises:
        DamageError: it cannot be unpacked, or its checksum does not fit.
    """
    size = chunk.uncompressed_size
    try:
        # zstd would make room for what the frame says, not for what the chunk does.
        if size > _LARGEST_CHUNK or (
            chunk.compression == "zstd" and zstandard.frame_content_size(chunk.data) not in (size, -1)
        ):
            raise DamageError(f"a chunk cannot hold {size} bytes, as it says")
        stream, length = get_chunk_data_stream(chunk)
        records = stream.read(length)
    except (McapError, zstandard.ZstdError, RuntimeError, EOFError, MemoryError) as error:
        raise DamageError(f"a chunk cannot be unpacked ({error})") from error
    if len(records) != size:
        raise DamageError(f"a chunk holds {len(records)} bytes where it says {size}")
    _check(chunk.uncompressed_crc, records, "a chunk")
    return bytes(records)


def check_end(data: bytes, end: RecordSpan) -> None:
    """Check what follows the data: that it is all there, and that its two checksums fit.

    Args:
        data: the file.
        end: the record that ends the data.

    Raises:
        DamageError: something is missing or does not fit.
    """
    _check(parse(DataEnd, data, end).data_section_crc, data[: end.begin], "its data")
    footer_at = len(data) - len(MAGIC) - _FOOTER_SIZE
    found = span_at(data, max(footer_at, end.stop))
    if (found.opcode, found.stop) != (Opcode.FOOTER, len(data) - len(MAGIC)):
        raise DamageError("its footer is damaged")
    footer = parse(Footer, data, found)
    if (footer.summary_start or footer_at) != end.stop:
        raise DamageError("its footer points nowhere")
    _check(footer.summary_crc, data[end.stop : found.stop - 4], "its summary")


def _check(checksum: int, content: bytes, what: str) -> None:
    # A checksum of 0 says that the writer made none.
    if checksum not in (0, zlib.crc32(content)):
        raise DamageError(f"the checksum of {what} does not fit")
