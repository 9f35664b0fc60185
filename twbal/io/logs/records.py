"""The records of an MCAP file, one by one and checked, so that a file damaged anywhere is seen to be damaged."""

import struct
import zlib
from io import BytesIO
from typing import NamedTuple, TypeVar

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Footer, Metadata, Schema
from mcap.stream_reader import get_chunk_data_stream

from twbal.io.logs.container import MAGIC

HEAD = struct.Struct("<BQ")  # opcode, length of what follows
_LARGEST_CHUNK = 2**28  # bytes before compression; a damaged length must not fill the memory
_ZSTD = zstandard.ZstdDecompressor()
_FOOTER_SIZE = HEAD.size + 20
_DATA_END_SIZE = HEAD.size + 4
_Parsed = TypeVar("_Parsed", Attachment, Channel, Chunk, Footer, Metadata, Schema)


class DamageError(Exception):
    """The bytes stop making sense here; what was found before is good. Does not leave this folder."""


class Span(NamedTuple):
    """One record: its kind, and where its content lies."""

    opcode: int
    start: int
    stop: int


def span_at(data: bytes, position: int) -> Span:
    """The record whose head lies at `position`.

    Raises:
        DamageError: it reaches beyond the end.
    """
    start = position + HEAD.size
    if start <= len(data):
        opcode, length = HEAD.unpack_from(data, position)
        if length <= len(data) - start:
            return Span(opcode, start, start + length)
    raise DamageError(f"it ends in the middle of the record at byte {position}")


def parse(kind: type[_Parsed], data: bytes, span: Span) -> _Parsed:
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


def attachment_at(data: bytes, span: Span) -> Attachment:
    """An attachment, checked against its checksum.

    Raises:
        DamageError: it cannot be read, or its checksum does not fit.
    """
    content, crc = data[span.start : span.stop - 4], data[max(span.start, span.stop - 4) : span.stop]
    if int.from_bytes(crc, "little") not in (0, zlib.crc32(content)):
        raise DamageError(f"the checksum of the attachment at byte {span.start} does not fit")
    return parse(Attachment, data, span)


def unpacked(chunk: Chunk) -> bytes:
    """The records in a chunk, checked against its checksum.

    Raises:
        DamageError: it cannot be unpacked, or its checksum does not fit.
    """
    if chunk.uncompressed_size > _LARGEST_CHUNK:
        raise DamageError(f"a chunk says that it holds {chunk.uncompressed_size} bytes")
    try:
        records = _decompress(chunk)
    except (McapError, zstandard.ZstdError, RuntimeError, EOFError, MemoryError) as error:
        raise DamageError(f"a chunk cannot be unpacked ({error})") from error
    # A checksum of 0 says that the writer made none.
    if len(records) != chunk.uncompressed_size or chunk.uncompressed_crc not in (0, zlib.crc32(records)):
        raise DamageError("the checksum of a chunk does not fit")
    return records


def _decompress(chunk: Chunk) -> bytes:
    if chunk.compression == "zstd":
        # One decompressor for all chunks: a new one for each, as in mcap, takes twice the time.
        if zstandard.frame_content_size(chunk.data) not in (chunk.uncompressed_size, -1):
            raise DamageError("a chunk has another length than it says")
        return _ZSTD.decompress(chunk.data, max_output_size=chunk.uncompressed_size)
    stream, length = get_chunk_data_stream(chunk)
    return bytes(stream.read(length))


def check_ends(data: bytes) -> None:
    """Check that a file is whole: its end is there, and its two checksums fit.

    Raises:
        DamageError: they do not.
    """
    footer_at = len(data) - len(MAGIC) - _FOOTER_SIZE
    if not data.endswith(MAGIC) or footer_at < len(MAGIC) + _DATA_END_SIZE:
        raise DamageError(f"it ends after {len(data)} bytes without the mark that ends an MCAP file")
    span = span_at(data, footer_at)
    if (span.opcode, span.stop) != (Opcode.FOOTER, len(data) - len(MAGIC)):
        raise DamageError("its footer is damaged")
    footer = parse(Footer, data, span)
    summary_at = footer.summary_start or footer_at
    if not len(MAGIC) + _DATA_END_SIZE <= summary_at <= footer_at:
        raise DamageError("its footer points nowhere")
    if footer.summary_crc not in (0, zlib.crc32(data[summary_at : footer_at + _FOOTER_SIZE - 4])):
        raise DamageError("the checksum of its summary does not fit")
    end_at = summary_at - _DATA_END_SIZE
    opcode, length = HEAD.unpack_from(data, end_at)
    crc = int.from_bytes(data[summary_at - 4 : summary_at], "little")
    if (opcode, length) != (Opcode.DATA_END, 4) or crc not in (0, zlib.crc32(memoryview(data)[:end_at])):
        raise DamageError("the checksum of its data does not fit")
