"""Whatever lies in an .mcap file: a valid episode comes out of it, or one of twbal's errors."""

import tempfile
import zlib
from io import BytesIO
from pathlib import Path

import numpy as np
import zstandard
from fuzzing import fuzzed, mutated, ours_only
from hypothesis import strategies as st
from mcap.data_stream import RecordBuilder
from mcap.records import Chunk, DataEnd, Footer, Header, Metadata
from mcap.stream_reader import StreamReader, get_chunk_data_stream
from mcap.writer import MCAP0_MAGIC as MAGIC

from twbal.core.episode import Episode, Event, Outcome, Provenance
from twbal.io.logs import read_episode, recover_episode, write_episode
from twbal.io.logs.metadata import METADATA_NAME, checksum, metadata_of

CHANNELS = ("tilt", "speed")


def an_episode(steps):
    rng = np.random.default_rng(0)
    observations = rng.standard_normal((steps + 1, 7))
    observations[:, 0] = 0.02 * np.arange(steps + 1)
    return Episode(
        channels=CHANNELS,
        control_period=0.02,
        observations=observations,
        states=rng.standard_normal((steps + 1, 2)),
        commands=rng.standard_normal(steps),
        outcome=Outcome.COMPLETED,
        provenance=Provenance("paper", "robot", config="robot: paper\n"),
        events=(Event(0.1, "a"),),
        poses=rng.standard_normal((steps + 1, 4)),
    )


EPISODE = an_episode(40)
with tempfile.TemporaryDirectory() as folder:
    write_episode(Path(folder) / "whole.mcap", EPISODE)
    WHOLE = (Path(folder) / "whole.mcap").read_bytes()
[CHUNK] = [r for r in StreamReader(BytesIO(WHOLE), emit_chunks=True).records if isinstance(r, Chunk)]
RECORDS = get_chunk_data_stream(CHUNK)[0].read(CHUNK.uncompressed_size)
ENTRIES = metadata_of(EPISODE)


def read_all(path):
    for episode in (ours_only(read_episode, path), getattr(ours_only(recover_episode, path), "episode", None)):
        if episode is not None:
            assert np.isfinite(episode.observations).all()
            assert len(episode.states) == len(episode) + 1
            assert episode.poses is None or episode.poses.shape == (len(episode) + 1, 4)


def sound(path, entries, records):
    """A file whose checksums all fit, whatever is in it."""
    builder = RecordBuilder()
    metadata = Metadata(METADATA_NAME, {**entries, "checksum": checksum(entries)})
    chunk = Chunk("zstd", zstandard.compress(records), 0, 0, zlib.crc32(records), len(records))
    for record in (Header("", "twbal"), metadata, chunk):
        record.write(builder)
    data = MAGIC + builder.end()
    DataEnd(zlib.crc32(data)).write(builder)
    Footer(0, 0, 0).write(builder)
    path.write_bytes(data + builder.end() + MAGIC)


@fuzzed(data=st.binary(max_size=300).map(lambda more: MAGIC + more) | st.binary(max_size=300))
def test_random_bytes(path, data):
    path.write_bytes(data)
    read_all(path)


@fuzzed(data=mutated(WHOLE))
def test_a_whole_file_with_bytes_changed(path, data):
    path.write_bytes(data)
    read_all(path)


@fuzzed(records=mutated(RECORDS))
def test_records_changed_under_checksums_that_fit(path, records):
    sound(path, ENTRIES, records)
    read_all(path)


texts = st.one_of(
    st.text(max_size=12),
    st.sampled_from(
        ["nan", "inf", "-1", "0", "1e400", "9" * 5000, "tilt:nan", "/pose", "a_b,a__b", "clear,time", "٣", ","]
    ),
    st.integers().map(str),
    st.integers(0, 3000).map(lambda n: ",".join(f"c{k}" for k in range(n))),
)


@fuzzed(
    changes=st.dictionaries(st.sampled_from([*sorted(ENTRIES), "estimated"]), texts, min_size=1, max_size=3),
    gone=st.sets(st.sampled_from(sorted(ENTRIES)), max_size=1),
)
def test_any_description_under_a_checksum_that_fits(path, changes, gone):
    entries = {name: text for name, text in {**ENTRIES, **changes}.items() if name not in gone}
    sound(path, entries, RECORDS)
    read_all(path)


def test_the_file_that_is_changed_is_whole(tmp_path):
    sound(tmp_path / "file", ENTRIES, RECORDS)
    assert len(read_episode(tmp_path / "file")) == 40
