"""JSON lines against the JSON of the same columns."""

import json

import numpy as np
import pytest
from foreign_logs import NAMES, columns

from twbal.core.errors import LogError
from twbal.io.importers.arrays import named_arrays

ROWS = columns(60)
LINES = [json.dumps({**dict(zip(NAMES, row, strict=True)), "mode": "run"}) for row in ROWS.tolist()]


@pytest.mark.parametrize("ending", [".jsonl", ".ndjson"])
def test_one_object_a_line_is_the_same_table_as_lists(ending, tmp_path):
    lines, lists = tmp_path / f"log{ending}", tmp_path / "log.json"
    lines.write_text("\n".join(LINES) + "\n")
    lists.write_text(json.dumps(dict(zip(NAMES, ROWS.T.tolist(), strict=True))))
    one, other = named_arrays(lines), named_arrays(lists)
    assert list(one) == list(other) == list(NAMES)
    assert all(np.array_equal(one[name], other[name]) for name in NAMES)


def test_a_last_line_that_is_cut_off_is_left_out(tmp_path):
    path = tmp_path / "log.jsonl"
    path.write_text("\n".join([*LINES[:20], LINES[20][:30]]))
    assert named_arrays(path)["time"] == pytest.approx(ROWS[:20, 0])


@pytest.mark.parametrize(("line", "said"), [("{", "cannot be read as JSON"), ("[1]", "no object"), ("{}", "no object")])
def test_another_bad_line_is_refused_by_its_number(line, said, tmp_path):
    path = tmp_path / "log.jsonl"
    path.write_text("\n".join([*LINES[:3], line, *LINES[3:]]))
    with pytest.raises(LogError, match=f"Line 4 of .*{said}"):
        named_arrays(path)


@pytest.mark.parametrize("empty", [None, ""])
def test_an_empty_entry_is_not_a_number_and_its_column_stays(empty, tmp_path):
    path = tmp_path / "log.jsonl"
    path.write_text("\n".join([*LINES, json.dumps({**json.loads(LINES[0]), "command": empty})]))
    command = named_arrays(path)["command"]
    assert command[:-1] == pytest.approx(ROWS[:, -1])
    assert np.isnan(command[-1])


def nested(row):
    """A row in which the tilt and its rate lie in an object of their own, and one of them in a deeper one."""
    plain = dict(zip(NAMES, row, strict=True))
    inner = {"pitch": plain.pop("tilt"), "gyro": {"y": plain.pop("tilt_rate")}}
    return {**plain, "imu": inner, "note": {"text": "run"}}


@pytest.mark.parametrize("form", ["rows", "lines", "lists"])
def test_objects_in_objects_are_columns_with_both_names(form, tmp_path):
    rows = [nested(row) for row in ROWS.tolist()]
    path = tmp_path / ("log.jsonl" if form == "lines" else "log.json")
    if form == "lists":
        plain = dict(zip(NAMES, ROWS.T.tolist(), strict=True))
        whole = {**plain, "imu": {"pitch": plain.pop("tilt"), "gyro": {"y": plain.pop("tilt_rate")}}}
        path.write_text(json.dumps(whole))
    else:
        path.write_text("\n".join(map(json.dumps, rows)) if form == "lines" else json.dumps(rows))
    found = named_arrays(path)
    assert found["imu.pitch"] == pytest.approx(ROWS[:, list(NAMES).index("tilt")])
    assert found["imu.gyro.y"] == pytest.approx(ROWS[:, list(NAMES).index("tilt_rate")])
    assert not any(name.startswith("note") for name in found)


def test_an_object_that_is_null_is_a_row_without_its_numbers(tmp_path):
    rows = [nested(row) for row in ROWS.tolist()]
    rows[7]["imu"] = None
    path = tmp_path / "log.jsonl"
    path.write_text("\n".join(map(json.dumps, rows)))
    found = named_arrays(path)
    assert np.flatnonzero(np.isnan(found["imu.pitch"])).tolist() == [7]
    assert np.flatnonzero(np.isnan(found["imu.gyro.y"])).tolist() == [7]


def test_an_object_with_other_names_is_refused_by_its_row(tmp_path):
    rows = [nested(row) for row in ROWS.tolist()]
    del rows[7]["imu"]["pitch"]
    path = tmp_path / "log.json"
    path.write_text(json.dumps(rows))
    with pytest.raises(LogError, match="Row 8 has the names of imu gyro; expected are those of the first row: pitch"):
        named_arrays(path)


def test_times_of_day_are_seconds_from_the_first(tmp_path):
    stamps = [f"2024-05-03T12:34:{50 + time:06.3f}Z" for time in ROWS[:, 0]]
    (tmp_path / "log.json").write_text(json.dumps({"stamp": [*stamps[:-1], None], "tilt": ROWS[:, 1].tolist()}))
    read = named_arrays(tmp_path / "log.json")["stamp"]
    assert read[:-1] == pytest.approx(ROWS[:-1, 0]) and np.isnan(read[-1])
    stamped = np.array([stamp[:-1] for stamp in stamps], dtype="datetime64[us]")
    np.savez(tmp_path / "log.npz", stamp=stamped, tilt=ROWS[:, 1])
    assert named_arrays(tmp_path / "log.npz")["stamp"] == pytest.approx(ROWS[:, 0])


def test_words_are_no_times_of_day(tmp_path):
    (tmp_path / "log.json").write_text(json.dumps({"mode": ["12:34:50", "idle"], "tilt": [0.1, 0.2]}))
    assert list(named_arrays(tmp_path / "log.json")) == ["tilt"]
