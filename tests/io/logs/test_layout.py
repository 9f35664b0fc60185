from pathlib import Path

import numpy as np
import pytest
from mcap.records import Chunk
from mcap.stream_reader import StreamReader, get_chunk_data_stream

from twbal.core.episode import Episode, Outcome, Provenance
from twbal.io.logs import write_episode
from twbal.io.logs.layout import layout_of
from twbal.io.logs.rows import columns_of


def an_episode(steps: int, channels: tuple[str, ...], with_poses: bool = False) -> Episode:
    rng = np.random.default_rng(1)
    observations = rng.standard_normal((steps + 1, 7))
    observations[:, 0] = np.arange(steps + 1)
    states = rng.standard_normal((steps + 1, len(channels)))
    states[90:92] = 0.0
    source = Provenance("paper", "robot")
    commands = rng.standard_normal(steps)
    poses = rng.standard_normal((steps + 1, 4)) if with_poses else None
    return Episode(channels, 1.0, observations, states, commands, Outcome.COMPLETED, source, poses=poses)


def samples_of(path: Path, episode: Episode) -> bytes:
    """The messages of a log's second chunk: samples and nothing else."""
    write_episode(path, episode)
    with path.open("rb") as stream:
        _, chunk, *_ = [r for r in StreamReader(stream, emit_chunks=True).records if isinstance(r, Chunk)]
    return get_chunk_data_stream(chunk)[0].read(chunk.uncompressed_size)


@pytest.mark.parametrize("with_poses", [False, True])
@pytest.mark.parametrize("count", [0, 2, 20, 40])  # field numbers of one and of two bytes
def test_samples_are_unpacked_as_mcap_and_protobuf_wrote_them(tmp_path: Path, count: int, with_poses: bool) -> None:
    episode = an_episode(200, tuple(f"channel_{i}" for i in range(count)), with_poses)
    layout = layout_of(episode.channels, with_poses)
    data = samples_of(tmp_path / "e.mcap", episode)
    numbers, values = layout.unpack(b"before" + data + b"after", 6)
    assert len(numbers) == len(data) // layout.size > 5
    assert numbers.tolist() == list(range(numbers[0], numbers[-1] + 1))
    assert values.tobytes() == columns_of(episode)[numbers].tobytes()


def test_unpacking_stops_at_the_first_sample_that_differs_in_form(tmp_path: Path) -> None:
    episode = an_episode(200, ("tilt", "tilt_rate"))
    layout = layout_of(episode.channels)
    data = samples_of(tmp_path / "e.mcap", episode)[: 9 * layout.size]
    first, passed = layout.unpack(data, 0)[0][0], 0
    for place in range(layout.size):
        changed = bytearray(data)
        changed[4 * layout.size + place] ^= 1
        numbers, values = layout.unpack(bytes(changed), 0)
        assert len(numbers) in (4, 9)
        assert values[:4].tobytes() == columns_of(episode)[first : first + 4].tobytes()
        passed += len(numbers) == 9
    assert passed == 8 * values.shape[1] + 4 * 16  # bytes of the numbers, and of the four messages' two times
