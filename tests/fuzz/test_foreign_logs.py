"""Whatever lies in a log that others made: columns, a proposed mapping, or one of twbal's errors; never a warning."""

import io
import json
import os

import numpy as np
import pytest
from foreign_logs import columns, text
from fuzzing import fuzzed, mutated, ours_only
from hypothesis import strategies as st

from twbal.core.errors import LogError
from twbal.io.importers.arrays import read_arrays
from twbal.io.importers.guess import guess
from twbal.io.importers.text_files import read_text

pytestmark = pytest.mark.filterwarnings("error")
ROWS = columns(12)
TEXTS = [
    text(ROWS),
    text(ROWS, ";", decimal=","),
    text(ROWS, "\t"),
    "% time (s), tilt (deg)\n" + text(ROWS, " ", names=()),
]
NUMBERS = ["", "nan", "inf", "0", "1", "-2.5", "1,5", "1e400", "0x10"]
NAMES = ["time", "pitch", "duty", "enc_left", "enc_right", "voltage", "torque_left"]
FIELDS = st.sampled_from([*NUMBERS, *NAMES, "x", '"', "#", "%"])
LINES = st.lists(st.lists(FIELDS, max_size=6), max_size=8)


def parted(delimiter, lines):
    return "\n".join(delimiter.join(fields) for fields in lines).encode()


def array_file(save, *arguments, **named):
    stream = io.BytesIO()
    save(stream, *arguments, **named)
    return stream.getvalue()


ARRAYS = {
    ".npy": array_file(np.save, ROWS),
    ".npz": array_file(np.savez_compressed, time=ROWS[:, 0], tilt=ROWS[:, 1]),
    ".json": json.dumps({"time": ROWS[:, 0].tolist(), "tilt": ROWS[:, 1].tolist()}).encode(),
    ".jsonl": "\n".join(json.dumps({"time": row[0], "tilt": row[1]}) for row in ROWS.tolist()).encode(),
}


def read(path, reader):
    ours_only(guess, path)
    ours_only(reader, path, [1, 2])
    ours_only(reader, path, ["time", "tilt"])


@fuzzed(data=st.sampled_from([whole.encode() for whole in TEXTS]).flatmap(mutated) | st.binary(max_size=200))
def test_texts_with_bytes_changed(path, data):
    path.write_bytes(data)
    read(path, read_text)


@fuzzed(data=st.builds(parted, st.sampled_from([",", ";", "\t", " "]), LINES))
def test_texts_of_any_fields(path, data):
    path.write_bytes(data)
    read(path, read_text)


@fuzzed(file=st.sampled_from(sorted(ARRAYS)).flatmap(lambda end: st.tuples(st.just(end), mutated(ARRAYS[end]))))
def test_arrays_with_bytes_changed(path, file):
    ending, data = file
    path.with_suffix(ending).write_bytes(data)
    read(path.with_suffix(ending), read_arrays)


@pytest.mark.parametrize("ending", [".csv", *ARRAYS])
def test_a_pipe_is_refused_and_not_waited_for(ending, tmp_path):
    path = tmp_path / f"log{ending}"
    os.mkfifo(path)
    with pytest.raises(LogError, match="it is a pipe"):
        guess(path)


def test_the_files_that_are_changed_are_whole(tmp_path):
    for k, whole in enumerate(TEXTS):
        (tmp_path / f"{k}.csv").write_text(whole)
        assert read_text(tmp_path / f"{k}.csv", [1, 2]).values == pytest.approx(ROWS[:, :2], abs=1e-8)
        assert guess(tmp_path / f"{k}.csv").table
    for ending, data in ARRAYS.items():
        (tmp_path / f"log{ending}").write_bytes(data)
        assert read_arrays(tmp_path / f"log{ending}", [1, 2]).values.tolist() == ROWS[:, :2].tolist()
