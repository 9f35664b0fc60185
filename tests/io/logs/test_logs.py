import struct
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.reader import NonSeekingReader, make_reader
from mcap.records import Chunk, Message, MessageIndex
from mcap.stream_reader import StreamReader, get_chunk_data_stream
from mcap.writer import CompressionType, Writer
from zstandard import ZstdError

from twbal.core.channels import Channels
from twbal.core.episode import Episode, Event, Outcome, Provenance
from twbal.core.errors import DataError, LogError
from twbal.core.plant import Observation
from twbal.io.logs import read_episode, read_episodes, recover_episode, write_episode
from twbal.io.logs.metadata import checksum

CHANNELS = ("tilt", "tilt_rate", "speed", "command_1", "command_2")
CONFIG = "robot: paper\nnote: 20 N·m\n"


def an_episode(
    steps: int, channels: tuple[str, ...] = CHANNELS, events: tuple[Event, ...] = (), seed: int = 0
) -> Episode:
    rng = np.random.default_rng(seed)
    observations = rng.standard_normal((steps + 1, 7))
    observations[:, 0] = 0.02 * np.arange(steps + 1) + 0.001 * rng.random(steps + 1)
    return Episode(
        channels=channels,
        control_period=0.1 + 0.2,
        observations=observations,
        states=rng.standard_normal((steps + 1, len(channels))),
        commands=rng.standard_normal(steps),
        outcome=Outcome.TILT_LIMIT,
        provenance=Provenance("paper", "robot", "a1b2", "c3d4", seed=2**70, trial=7, config=CONFIG),
        events=events,
    )


def assert_same(found: Episode, expected: Episode, samples: int | None = None) -> None:
    samples = len(expected) + 1 if samples is None else samples
    assert found.observations.tobytes() == expected.observations[:samples].tobytes()
    assert found.states.tobytes() == expected.states[:samples].tobytes()
    assert found.commands.tobytes() == expected.commands[: samples - 1].tobytes()
    assert (found.channels, found.control_period) == (expected.channels, expected.control_period)
    if samples == len(expected) + 1:
        assert (found.outcome, found.events) == (expected.outcome, expected.events)


@pytest.fixture(scope="module")
def episode() -> Episode:
    return an_episode(150, events=(Event(2.0, "second"), Event(0.5, "first, ü"), Event(9.0, "after the end")))


@pytest.fixture(scope="module")
def data(episode: Episode, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("log") / "whole.mcap"
    write_episode(path, episode)
    return path.read_bytes()


# Round trip


@pytest.mark.parametrize("steps", [0, 1, 66, 67, 68, 69, 135, 136, 500])  # a chunk holds 68 samples
def test_an_episode_comes_back_bit_by_bit(tmp_path: Path, steps: int) -> None:
    original = an_episode(steps, events=(Event(0.3, "a"), Event(-1.0, "b")) if steps else ())
    write_episode(tmp_path / "e.mcap", original)
    found = read_episode(tmp_path / "e.mcap")
    assert_same(found, original)
    assert found.provenance == original.provenance


@pytest.mark.parametrize("channels", [(), ("tilt",), tuple(f"channel_{i}" for i in range(40))])
def test_any_number_of_channels_comes_back(tmp_path: Path, channels: tuple[str, ...]) -> None:
    original = an_episode(90, channels)
    write_episode(tmp_path / "e.mcap", original)
    assert_same(read_episode(tmp_path / "e.mcap"), original)


def test_the_odd_numbers_of_float64_come_back(tmp_path: Path) -> None:
    original = an_episode(3)
    states = original.states.copy()
    states[0] = [-0.0, 0.0, 5e-324, np.finfo(float).max, -np.finfo(float).tiny]
    original = replace(original, states=states)
    write_episode(tmp_path / "e.mcap", original)
    assert_same(read_episode(tmp_path / "e.mcap"), original)


def test_times_before_zero_come_back(tmp_path: Path) -> None:
    original = an_episode(3)
    observations = original.observations.copy()
    observations[:, 0] -= 1.0
    original = replace(original, observations=observations)
    write_episode(tmp_path / "e.mcap", original)
    assert_same(read_episode(tmp_path / "e.mcap"), original)


def test_the_same_episode_gives_the_same_bytes_under_any_name(tmp_path: Path, episode: Episode, data: bytes) -> None:
    write_episode(tmp_path / "another name.mcap", episode)
    assert (tmp_path / "another name.mcap").read_bytes() == data


def test_an_episode_without_configuration_has_no_attachment(tmp_path: Path) -> None:
    original = replace(an_episode(2), provenance=Provenance("paper", "simulation"))
    write_episode(tmp_path / "e.mcap", original)
    assert read_episode(tmp_path / "e.mcap").provenance == original.provenance
    assert not list(make_reader(BytesIO((tmp_path / "e.mcap").read_bytes())).iter_attachments())


def test_a_log_of_the_first_schema_version_stays_readable() -> None:
    found = read_episode(Path(__file__).parent / "schema1.mcap")
    assert_same(found, an_episode(70, events=(Event(0.5, "a"), Event(0.25, "b"))))
    assert found.provenance == an_episode(0).provenance


# True poses


def with_poses(original: Episode) -> Episode:
    """The same episode, of a robot that is watched; at two instants nothing told its pose."""
    poses = np.random.default_rng(9).standard_normal((len(original) + 1, 4))
    poses[[0, 3]] = np.nan
    return replace(original, poses=poses)


@pytest.mark.parametrize("steps", [3, 40, 500])
def test_poses_come_back_bit_by_bit(tmp_path: Path, steps: int) -> None:
    original = with_poses(an_episode(steps, events=(Event(0.02, "a"),)))
    write_episode(tmp_path / "e.mcap", original)
    found = read_episode(tmp_path / "e.mcap")
    assert_same(found, original)
    assert found.poses is not None and original.poses is not None
    np.testing.assert_array_equal(found.poses, original.poses)


def test_a_log_without_poses_has_no_topic_for_them(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "e.mcap").write_bytes(data)
    assert read_episode(tmp_path / "e.mcap").poses is None
    summary = make_reader(BytesIO(data)).get_summary()
    assert summary is not None and {c.topic for c in summary.channels.values()} == {
        "/imu",
        "/wheels",
        "/state",
        "/command",
        "/event",
    }
    assert "poses" not in next(make_reader(BytesIO(data)).iter_metadata()).metadata


def test_a_generic_reader_finds_the_poses_with_their_units(tmp_path: Path) -> None:
    original = with_poses(an_episode(40))
    write_episode(tmp_path / "e.mcap", original)
    data = (tmp_path / "e.mcap").read_bytes()
    assert original.poses is not None
    seen = {n: (m.x, m.y, m.heading, m.tilt) for topic, n, _, m in decoded(data) if topic == "/pose"}  # type: ignore[attr-defined]
    np.testing.assert_array_equal([seen[n] for n in range(41)], original.poses)
    summary = make_reader(BytesIO(data)).get_summary()
    assert summary is not None
    units = {c.topic: c.metadata for c in summary.channels.values()}["/pose"]
    assert units == {"x": "m", "y": "m", "heading": "rad", "tilt": "rad"}


def test_a_cut_log_gives_back_the_poses_of_its_complete_samples(tmp_path: Path) -> None:
    original = with_poses(an_episode(500))
    write_episode(tmp_path / "e.mcap", original)
    data = (tmp_path / "e.mcap").read_bytes()
    (tmp_path / "e.mcap").write_bytes(data[: len(data) // 2])
    recovered = recover_episode(tmp_path / "e.mcap")
    samples = len(recovered.episode) + 1
    assert 40 < samples == 501 - recovered.lost_samples
    assert original.poses is not None and recovered.episode.poses is not None
    np.testing.assert_array_equal(recovered.episode.poses, original.poses[:samples])


# References


def with_references(original: Episode) -> Episode:
    return replace(original, references=np.random.default_rng(8).standard_normal((len(original) + 1, 3)))


@pytest.mark.parametrize("watched", [False, True])
def test_references_come_back_bit_by_bit_beside_poses_and_without(tmp_path: Path, watched: bool) -> None:
    original = with_references(with_poses(an_episode(500)) if watched else an_episode(500))
    write_episode(tmp_path / "e.mcap", original)
    found = read_episode(tmp_path / "e.mcap")
    assert found.references is not None and original.references is not None
    np.testing.assert_array_equal(found.references, original.references)
    np.testing.assert_array_equal(found.states, original.states)
    assert (found.poses is None) is not watched
    (metadata,) = make_reader(BytesIO((tmp_path / "e.mcap").read_bytes())).iter_metadata()
    assert (metadata.metadata["schema_version"], metadata.metadata["references"]) == ("3", "/reference")


def test_a_log_without_references_is_as_earlier_versions_wrote_it(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "e.mcap").write_bytes(data)
    assert read_episode(tmp_path / "e.mcap").references is None
    (metadata,) = make_reader(BytesIO(data)).iter_metadata()
    assert metadata.metadata["schema_version"] == "1" and "references" not in metadata.metadata


def test_a_cut_log_gives_back_the_references_of_its_complete_samples(tmp_path: Path) -> None:
    original = with_references(an_episode(500))
    write_episode(tmp_path / "e.mcap", original)
    data = (tmp_path / "e.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[: len(data) * 2 // 3])
    recovered = recover_episode(tmp_path / "cut.mcap")
    samples = len(recovered.episode) + 1
    assert 0 < samples < 501 and original.references is not None and recovered.episode.references is not None
    np.testing.assert_array_equal(recovered.episode.references, original.references[:samples])


@pytest.mark.parametrize("watched", [False, True])
@pytest.mark.parametrize("referred", [False, True])
def test_headings_come_back_bit_by_bit_beside_what_else_there_is(tmp_path: Path, watched: bool, referred: bool) -> None:
    original = with_poses(an_episode(500)) if watched else an_episode(500)
    original = with_references(original) if referred else original
    original = replace(original, headings=np.random.default_rng(9).standard_normal((len(original) + 1, 5)))
    write_episode(tmp_path / "e.mcap", original)
    found = read_episode(tmp_path / "e.mcap")
    assert found.headings is not None and original.headings is not None
    np.testing.assert_array_equal(found.headings, original.headings)
    np.testing.assert_array_equal(found.commands, original.commands)
    assert (found.poses is None, found.references is None) == (not watched, not referred)
    (metadata,) = make_reader(BytesIO((tmp_path / "e.mcap").read_bytes())).iter_metadata()
    assert (metadata.metadata["schema_version"], metadata.metadata["headings"]) == ("4", "/heading")


def test_poses_that_another_tool_took_out_are_missed(tmp_path: Path) -> None:
    write_episode(tmp_path / "e.mcap", with_poses(an_episode(40)))
    data = (tmp_path / "e.mcap").read_bytes()
    (tmp_path / "e.mcap").write_bytes(rewritten(data, change=lambda topic, _, p: None if topic == "/pose" else p))
    with pytest.raises(LogError, match=r"has no topic '/pose'; it has: /command, /imu, /state, /wheels"):
        read_episode(tmp_path / "e.mcap")
    (tmp_path / "e.mcap").write_bytes(rewritten(data, change=lambda t, n, p: None if (t, n) == ("/pose", 9) else p))
    with pytest.raises(LogError, match="41 messages on /pose, and 9 follow"):
        read_episode(tmp_path / "e.mcap")


# Other readers


def decoded(data: bytes) -> list[tuple[str, int, int, object]]:
    """All messages by mcap's reader and the descriptors inside the file, with nothing of twbal."""
    classes = {}
    messages = []
    for schema, channel, message in make_reader(BytesIO(data), validate_crcs=True).iter_messages():
        assert schema is not None
        if schema.id not in classes:
            pool = descriptor_pool.DescriptorPool()
            for file in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file:
                pool.Add(file)
            classes[schema.id] = message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name))
        messages.append(
            (channel.topic, message.sequence, message.log_time, classes[schema.id].FromString(message.data))
        )
    return messages


def test_a_generic_reader_finds_every_number_under_its_name(data: bytes, episode: Episode) -> None:
    count: Counter[str] = Counter()
    for topic, number, time, message in decoded(data):
        count[topic] += 1
        seen = Observation(*episode.observations[number]) if topic != "/event" else None
        if topic == "/imu":
            names = ("time", "tilt", "tilt_rate", "acceleration", "yaw_rate")
            assert [getattr(message, n) for n in names] == [getattr(seen, n) for n in names]
        elif topic == "/wheels":
            assert (message.angle, message.rate) == (seen.wheel_angle, seen.wheel_rate)
        elif topic == "/state":
            assert [getattr(message, name) for name in CHANNELS] == episode.states[number].tolist()
        elif topic == "/command":
            assert message.torque == episode.commands[number]
        else:
            assert Event(message.time, message.text) == episode.events[number]
        clock = seen.time if seen else episode.events[number].time
        assert time == round(clock * 1e9)
    assert count == {"/imu": 151, "/wheels": 151, "/state": 151, "/command": 150, "/event": 3}


def test_the_summary_agrees_with_the_data(data: bytes) -> None:
    summary = make_reader(BytesIO(data)).get_summary()
    assert summary is not None and summary.statistics is not None
    assert summary.statistics.message_count == len(list(NonSeekingReader(BytesIO(data)).iter_messages())) == 606
    assert summary.statistics.chunk_count == len(summary.chunk_indexes) == 3
    assert summary.statistics.message_end_time == 9_000_000_000
    assert {c.topic: c.metadata for c in summary.channels.values()}["/state"]["tilt_rate"] == "rad/s"
    assert len([*StreamReader(BytesIO(data), validate_crcs=True).records]) > 606


def test_the_message_indexes_point_at_the_messages(data: bytes) -> None:
    chunk, checked = b"", 0
    for record in StreamReader(BytesIO(data), emit_chunks=True).records:
        if isinstance(record, Chunk):
            stream, size = get_chunk_data_stream(record, validate_crc=True)
            chunk = stream.read(size)
        if isinstance(record, MessageIndex):
            for time, offset in record.records:
                assert struct.unpack_from("<B8xH4xQ", chunk, offset) == (5, record.channel_id, time)
                checked += 1
    assert checked == 606


def test_metadata_and_configuration_can_be_read_by_other_tools(data: bytes) -> None:
    reader = make_reader(BytesIO(data))
    [record] = reader.iter_metadata()
    assert record.name == "twbal.episode"
    expected = {"robot": "paper", "outcome": "tilt_limit", "units": "rad,rad/s,m/s,N·m,N·m", "samples": "151"}
    assert expected.items() <= record.metadata.items()
    [attachment] = reader.iter_attachments()
    assert (attachment.name, attachment.data.decode()) == ("config.yaml", CONFIG)


def test_every_state_channel_has_its_unit(tmp_path: Path) -> None:
    channels = Channels(("tilt", "speed", "command_1", "position", "position_integral"), 0.1, 0.02)
    states = np.zeros((5, len(channels.names)))
    write_episode(tmp_path / "e.mcap", replace(an_episode(4), channels=channels.names, states=states))
    reader = make_reader(BytesIO((tmp_path / "e.mcap").read_bytes()))
    [record] = reader.iter_metadata()
    assert tuple(record.metadata["units"].split(",")) == channels.units == ("rad", "m/s", "N·m", "m", "m·s")
    summary = reader.get_summary()
    assert summary is not None
    of_state = {channel.topic: channel.metadata for channel in summary.channels.values()}["/state"]
    assert of_state == dict(zip(channels.names, channels.units, strict=True))


def rewritten(
    data: bytes,
    entries: Mapping[str, str] | None = None,
    change: Callable[[str, int, bytes], bytes | None] = lambda topic, number, payload: payload,
    **options: Any,
) -> bytes:
    """The same log as another tool may write it anew: other ids, order of topics and chunks, no checksum of the data.

    `entries` takes the place of metadata; `change` gives the payload of each message, or None to leave it out.
    """
    source, out = make_reader(BytesIO(data)), BytesIO()
    writer = Writer(out, chunk_size=4000, **options)
    writer.start()
    ids: dict[str, int] = {}
    messages = list(source.iter_messages(log_time_order=False))
    for schema, channel, message in sorted(messages, key=lambda found: found[1].topic):
        assert schema is not None
        payload = change(channel.topic, message.sequence, message.data)
        if payload is None:
            continue
        if channel.topic not in ids:
            own = writer.register_schema(schema.name, schema.encoding, schema.data)
            ids[channel.topic] = writer.register_channel(channel.topic, channel.message_encoding, own)
        id = ids[channel.topic]
        writer.add_message(id, message.log_time, payload, message.publish_time, message.sequence)
    for attachment in source.iter_attachments():
        writer.add_attachment(0, 0, attachment.name, attachment.media_type, attachment.data)
    for record in source.iter_metadata():
        changed = {**record.metadata, **(entries or {})}
        writer.add_metadata(record.name, {**changed, "checksum": checksum(changed)})
    writer.finish()
    return out.getvalue()


@pytest.mark.parametrize("compression", list(CompressionType))
def test_a_log_that_another_tool_wrote_anew_gives_the_same_episode(
    tmp_path: Path, data: bytes, episode: Episode, compression: CompressionType
) -> None:
    (tmp_path / "e.mcap").write_bytes(rewritten(data, compression=compression))
    assert_same(read_episode(tmp_path / "e.mcap"), episode)


def test_a_log_without_chunks_gives_the_same_episode(tmp_path: Path, data: bytes, episode: Episode) -> None:
    (tmp_path / "e.mcap").write_bytes(rewritten(data, use_chunking=False))
    found = read_episode(tmp_path / "e.mcap")
    assert_same(found, episode)
    assert found.provenance == episode.provenance


# Damage


def complete_samples(data: bytes) -> int:
    """Samples in the complete chunks at the beginning of a cut file, by mcap's reader."""
    count: Counter[int] = Counter()
    with suppress(McapError, struct.error, ZstdError, ValueError):
        for record in StreamReader(BytesIO(data)).records:
            if isinstance(record, Message):
                count[record.channel_id] += 1
    return count[1]


def test_a_log_cut_anywhere_is_refused_and_recovered_up_to_its_last_complete_chunk(
    tmp_path: Path, data: bytes, episode: Episode
) -> None:
    path = tmp_path / "cut.mcap"
    seen = set()
    for length in sorted({*range(0, 600), *range(0, len(data), 97), *range(len(data) - 300, len(data))}):
        path.write_bytes(data[:length])
        with pytest.raises(LogError, match="is cut: ") as refused:
            read_episode(path)
        expected = complete_samples(data[:length])
        seen.add(expected)
        assert str(path) in str(refused.value)
        if expected:
            assert f"{expected} of its 151 samples are complete" in str(refused.value)
            recovered = recover_episode(path)
            assert recovered.lost_samples == 151 - expected
            assert recovered.damage
            assert_same(recovered.episode, episode, expected)
        else:
            with pytest.raises(LogError, match=str(path)):
                recover_episode(path)
    assert seen == {0, 68, 136, 151}


def test_an_episode_that_lost_samples_counts_as_stopped_and_says_so(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "cut.mcap").write_bytes(data[: len(data) // 2])
    episode = recover_episode(tmp_path / "cut.mcap").episode
    assert episode.outcome is Outcome.STOPPED
    assert "83 of 151 samples lost, outcome was tilt_limit" in episode.events[-1].text
    assert episode.provenance.config == CONFIG


def test_recovering_a_whole_log_changes_nothing(tmp_path: Path, data: bytes, episode: Episode) -> None:
    (tmp_path / "e.mcap").write_bytes(data)
    recovered = recover_episode(tmp_path / "e.mcap")
    assert recovered[1:] == (0, "")
    assert_same(recovered.episode, episode)


@pytest.mark.parametrize("kind", ["bit", "byte", "zeros", "insert", "drop", "swap"])
def test_damage_anywhere_is_refused_and_nothing_wrong_is_recovered(
    tmp_path: Path, data: bytes, episode: Episode, kind: str
) -> None:
    rng = np.random.default_rng(len(kind) + ord(kind[0]))
    path = tmp_path / "damaged.mcap"
    for trial in range(250):
        # The first and last kilobyte hold most of the structure.
        place = (
            int(rng.integers(len(data))) if trial % 2 else int(rng.choice([rng.integers(1500), -rng.integers(1, 900)]))
        )
        place %= len(data)
        damaged = bytearray(data)
        if kind == "bit":
            damaged[place] ^= 1 << int(rng.integers(8))
        elif kind == "byte":
            damaged[place] = int(rng.integers(256))
        elif kind == "zeros":
            damaged[place : place + 16] = bytes(16)
        elif kind == "insert":
            damaged[place:place] = rng.bytes(int(rng.integers(1, 5)))
        elif kind == "drop":
            del damaged[place : place + int(rng.integers(1, 40))]
        else:
            damaged[place : place + 32] = data[place : place + 32][::-1]
        if bytes(damaged) == data:
            continue
        path.write_bytes(bytes(damaged))
        with pytest.raises(LogError, match=str(path)):
            read_episode(path)
        try:
            recovered = recover_episode(path)
        except LogError:
            continue
        assert_same(recovered.episode, episode, len(recovered.episode) + 1)
        assert recovered.lost_samples == 150 - len(recovered.episode)


def test_a_record_that_turns_into_a_message_adds_nothing(tmp_path: Path, data: bytes, episode: Episode) -> None:
    position, changed = 8, 0
    while data[position] != Opcode.DATA_END:
        if data[position] == Opcode.MESSAGE_INDEX:
            damaged = bytearray(data)
            damaged[position] = Opcode.MESSAGE
            (tmp_path / "e.mcap").write_bytes(bytes(damaged))
            recovered = recover_episode(tmp_path / "e.mcap")
            assert set(recovered.episode.events[: -1 if recovered.lost_samples else None]) <= set(episode.events)
            assert_same(recovered.episode, episode, len(recovered.episode) + 1)
            changed += 1
        position += 9 + int.from_bytes(data[position + 1 : position + 9], "little")
    assert changed > 12


def test_a_damaged_log_says_so(tmp_path: Path, data: bytes) -> None:
    damaged = bytearray(data)
    damaged[len(data) // 2] ^= 1
    (tmp_path / "e.mcap").write_bytes(bytes(damaged))
    with pytest.raises(LogError, match=r"is damaged: the checksum of a chunk.*68 of its 151 samples.*twbal repair"):
        read_episode(tmp_path / "e.mcap")


# Other files


def foreign(topic: str, schema: str) -> bytes:
    out = BytesIO()
    writer = Writer(out)
    writer.start()
    channel = writer.register_channel(topic, "json", writer.register_schema(schema, "jsonschema", b"{}"))
    writer.add_message(channel, 1, b'{"tilt": 1}', 1)
    writer.finish()
    return out.getvalue()


def test_a_foreign_mcap_is_refused_with_the_topics_it_has(tmp_path: Path) -> None:
    (tmp_path / "f.mcap").write_bytes(foreign("/camera", "Image"))
    with pytest.raises(LogError, match=r"f.mcap is an MCAP file, but not an episode log of twbal.*topics: /camera"):
        read_episode(tmp_path / "f.mcap")
    with pytest.raises(LogError, match="topics: /camera"):
        recover_episode(tmp_path / "f.mcap")


def test_a_log_of_another_schema_version_is_refused(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "e.mcap").write_bytes(rewritten(data, {"schema_version": "5"}))
    with pytest.raises(
        LogError, match=r"e.mcap is an episode log of schema version 5; this twbal reads versions up to 4"
    ):
        read_episode(tmp_path / "e.mcap")


@pytest.mark.parametrize(
    ("entries", "message"),
    [
        ({"samples": "x"}, "cannot be right.*'x'"),
        ({"outcome": "flew away"}, "cannot be right.*flew away"),
        ({"samples": "152"}, "should have 152 messages on /imu, and 151"),
        ({"events": "4"}, "should have 4 events and has 3"),
        ({"control_period": "-1"}, "control period must be positive"),
        ({"poses": "/pose"}, "has no topic '/pose'"),
        ({"poses": "yes"}, "cannot be right.*'yes'"),
        ({"channels": "tilt"}, "another type on topic '/state'"),
    ],
)
def test_metadata_that_do_not_fit_the_data_are_refused(
    tmp_path: Path, data: bytes, entries: dict[str, str], message: str
) -> None:
    (tmp_path / "e.mcap").write_bytes(rewritten(data, entries))
    with pytest.raises(LogError, match=rf"{tmp_path / 'e.mcap'}.*{message}"):
        read_episode(tmp_path / "e.mcap")


def test_a_number_that_is_not_finite_is_refused_with_file_and_sample(tmp_path: Path, data: bytes) -> None:
    def spoil(topic: str, number: int, payload: bytes) -> bytes:
        return b"\x09" + struct.pack("<d", float("nan")) + payload[9:] if (topic, number) == ("/state", 17) else payload

    (tmp_path / "e.mcap").write_bytes(rewritten(data, change=spoil))
    with pytest.raises(LogError, match=r"e.mcap.*Sample 17 of the episode's states is not a finite number"):
        read_episode(tmp_path / "e.mcap")


def test_a_log_without_one_of_its_topics_is_refused_with_those_it_has(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "e.mcap").write_bytes(rewritten(data, change=lambda topic, _, p: None if topic == "/imu" else p))
    with pytest.raises(LogError, match=r"has no topic '/imu'; it has: /command, /event, /state, /wheels"):
        read_episode(tmp_path / "e.mcap")


def test_a_message_missing_in_the_middle_is_refused_and_the_samples_before_it_recovered(
    tmp_path: Path, data: bytes, episode: Episode
) -> None:
    path = tmp_path / "e.mcap"
    path.write_bytes(rewritten(data, change=lambda topic, n, p: None if (topic, n) == ("/wheels", 40) else p))
    with pytest.raises(LogError, match="151 messages on /wheels, and 40 follow"):
        read_episode(path)
    recovered = recover_episode(path)
    assert recovered.lost_samples == 111
    assert_same(recovered.episode, episode, 40)


def test_a_payload_that_is_no_protobuf_is_refused(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "e.mcap").write_bytes(rewritten(data, change=lambda topic, n, p: b"\xff" if n == 40 else p))
    with pytest.raises(LogError, match="message 40 on /command cannot be decoded"):
        read_episode(tmp_path / "e.mcap")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is cut"),
        (b"\x89MCAP", "is cut"),
        (b"tilt,tilt_rate\n", "is not an MCAP file"),
        (b"\x89MCAP0\r\n", "is cut"),
        (b"\x89MCAP0\r\n" * 20, "is damaged"),
    ],
)
def test_what_is_no_log_is_refused(tmp_path: Path, content: bytes, message: str) -> None:
    (tmp_path / "e.mcap").write_bytes(content)
    for read in (read_episode, recover_episode):
        with pytest.raises(LogError, match=rf"{tmp_path / 'e.mcap'} {message}"):
            read(tmp_path / "e.mcap")


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=f"There is no log {tmp_path / 'e.mcap'}"):
        read_episode(tmp_path / "e.mcap")
    with pytest.raises(LogError, match=f"Cannot read log {tmp_path}"):
        read_episode(tmp_path)


def test_what_cannot_be_logged_is_refused_before_a_file_is_made(tmp_path: Path) -> None:
    for bad, message in (
        (an_episode(2, ("tilt rate",)), "cannot be fields of a log"),
        (an_episode(2, ("tilt", "tilt")), "must be distinct"),
        (an_episode(2, ("tilt_a", "tilt__a")), "must be distinct, also without their underscores"),
        (an_episode(2, events=(Event(float("nan"), "?"),)), "Time nan s of event 0"),
    ):
        with pytest.raises(DataError, match=message):
            write_episode(tmp_path / "e.mcap", bad)
    assert not list(tmp_path.iterdir())


# Folders


def test_a_folder_of_logs_is_read_in_the_order_of_names(tmp_path: Path) -> None:
    for name, steps in (("2.mcap", 2), ("10.mcap", 10), ("1.mcap", 1)):
        write_episode(tmp_path / name, an_episode(steps))
    (tmp_path / ".3.mcap.77.partial").write_bytes(b"")
    assert [len(episode) for episode in read_episodes(tmp_path)] == [1, 10, 2]
    assert [len(episode) for episode in read_episodes([tmp_path / "2.mcap", tmp_path / "1.mcap"])] == [1, 2]
    assert [len(episode) for episode in read_episodes(tmp_path / "10.mcap")] == [10]


def test_a_folder_without_logs_says_what_it_holds(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=f"There is no folder {tmp_path / 'gone'}"):
        read_episodes(tmp_path / "gone")
    with pytest.raises(LogError, match="it holds: nothing"):
        read_episodes(tmp_path)
    (tmp_path / "episodes").mkdir()
    (tmp_path / "model.pt").touch()
    with pytest.raises(LogError, match=r"has no episode logs \(\*.mcap\); it holds: episodes/, model.pt"):
        read_episodes(tmp_path)
    with pytest.raises(LogError, match="No episode logs were given"):
        read_episodes([])
