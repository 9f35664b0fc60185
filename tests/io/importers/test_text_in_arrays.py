"""Numbers that stand as text in JSON, NumPy and Parquet: they are numbers; words are named, and not passed over."""

import json
from datetime import date
from decimal import Decimal

import numpy as np
import pytest
from foreign_logs import NAMES, columns

from twbal.core.errors import LogError
from twbal.io.importers.all_columns import passed_over
from twbal.io.importers.arrays import named_arrays, read_arrays
from twbal.io.importers.entries import entries_of
from twbal.io.importers.guess import guess

ROWS = columns(200)
TILT = ROWS[:, NAMES.index("tilt")]


def with_tilt(tilt, **more):
    """The columns by name, with another tilt."""
    return {**dict(zip(NAMES, ROWS.T.tolist(), strict=True)), "tilt": tilt, **more}


@pytest.fixture
def log(tmp_path):
    def write(named, ending=".json"):
        path = tmp_path / f"log{ending}"
        if ending == ".json":
            path.write_text(json.dumps(named))
        elif ending == ".jsonl":
            rows = zip(*named.values(), strict=True)
            path.write_text("\n".join(json.dumps(dict(zip(named, row, strict=True))) for row in rows))
        elif ending == ".npz":
            np.savez(path, **{name: np.array(values) for name, values in named.items()})
        else:
            pyarrow = pytest.importorskip("pyarrow")
            from pyarrow import parquet

            parquet.write_table(pyarrow.table(named), path)
        return path

    return write


@pytest.mark.parametrize("word", ["NaN", "Infinity", "-Infinity", "nan", "N/A", "null", ""])
@pytest.mark.parametrize("ending", [".json", ".jsonl"])
def test_a_word_for_a_missing_number_leaves_the_column_as_it_is(word, ending, log):
    found = named_arrays(log(with_tilt([*TILT[:-1].tolist(), word]), ending))["tilt"]
    assert found[:-1] == pytest.approx(TILT[:-1]) and not np.isfinite(found[-1])


def test_a_missing_number_that_is_first_is_no_text(log):
    found = named_arrays(log(with_tilt(["NaN", None, *TILT[2:].tolist()])))["tilt"]
    assert np.isnan(found[:2]).all() and found[2:] == pytest.approx(TILT[2:])


@pytest.mark.parametrize("ending", [".json", ".jsonl", ".npz", ".parquet"])
def test_numbers_that_are_all_texts_are_numbers(ending, log):
    """As JSON of protobuf writes whole numbers of 64 bits, and exports of spreadsheets write all."""
    stamps = 1714739695_000_000 + 10_000 * np.arange(len(ROWS))
    path = log(with_tilt([f"{value:.9f}" for value in TILT], stamp=[str(stamp) for stamp in stamps]), ending)
    found = named_arrays(path)
    assert found["stamp"].tolist() == stamps.tolist() and found["tilt"] == pytest.approx(TILT, abs=1e-9)
    assert read_arrays(path, ["stamp", "tilt"]).values[:, 0].tolist() == stamps.tolist()
    assert passed_over(path) == []


def test_texts_within_rows_that_are_lists_are_numbers(log, tmp_path):
    rows = ROWS.tolist()
    rows[7][1], rows[9][2] = "NaN", None
    (tmp_path / "rows.json").write_text(json.dumps(rows))
    found = named_arrays(tmp_path / "rows.json")
    assert list(found) == [f"column:{k}" for k in range(1, 9)]
    assert np.flatnonzero(np.isnan(found["column:2"])).tolist() == [7]
    assert np.flatnonzero(np.isnan(found["column:3"])).tolist() == [9]


def test_an_entry_that_is_no_number_now_and_then_is_taken_as_missing_and_said(log):
    tilt = TILT.tolist()
    tilt[50] = "0.1.2"
    read = read_arrays(log(with_tilt(tilt)), ["time", "tilt"])
    assert np.flatnonzero(np.isnan(read.values[:, 1])).tolist() == [50]
    assert read.notes == ("'0.1.2' in entry 51 of tilt is taken as missing",)
    tilt[60] = "x"
    read = read_arrays(log(with_tilt(tilt)), ["time", "tilt"])
    assert read.notes == ("'0.1.2' in entry 51 of tilt and 1 more entry that is no number are taken as missing",)
    assert read_arrays(log(with_tilt(tilt)), ["time"]).notes == ()  # of columns that the mapping takes


@pytest.mark.parametrize("ending", [".json", ".npz", ".parquet"])
def test_a_column_of_words_that_is_asked_for_is_named_with_its_first_word(ending, log):
    tilt = [f"{value:.9f}" for value in TILT]
    tilt[4::5] = ["abc"] * len(tilt[4::5])
    with pytest.raises(LogError, match=r"column 'tilt' of .*log.* is there, but entry 5 is 'abc', no number"):
        read_arrays(log(with_tilt(tilt), ending), ["time", "tilt"])


@pytest.mark.parametrize("ending", [".json", ".npz", ".parquet"])
def test_a_column_of_words_is_listed_as_passed_over(ending, log):
    found = guess(log(with_tilt(TILT.tolist(), mode=["idle"] * 3 + ["run"] * (len(ROWS) - 3)), ending))
    (said,) = [line for line in found.table if "passed over" in line]
    assert said.split()[:2] == ["-", "mode"] and "its entries are no numbers, such as 'idle'" in said


def test_control_characters_of_words_reach_no_terminal(log):
    path = log(with_tilt(["\x1b]0;owned\x07"] * len(ROWS)))
    with pytest.raises(LogError) as error:
        read_arrays(path, ["tilt"])
    assert str(error.value).isprintable() and all(line.isprintable() for line in passed_over(path))


def test_hexadecimal_numbers_and_digits_with_underscores_are_text(log):
    path = log(with_tilt(["0x1f"] * len(ROWS), acceleration=["1_000"] * len(ROWS)))
    assert {"tilt", "acceleration"}.isdisjoint(named_arrays(path))


def test_a_whole_number_beyond_all_others_is_infinite(log):
    found = named_arrays(log(with_tilt([10**400, -(10**400), "1e400", *TILT[3:].tolist()])))["tilt"]
    assert found[:3].tolist() == [np.inf, -np.inf, np.inf]


def test_a_file_of_words_alone_says_so(log):
    with pytest.raises(LogError, match=r"has no vector or matrix of numbers: .*'mode'.*'idle'"):
        named_arrays(log({"mode": ["idle", "run"]}))


def test_objects_as_parquet_gives_them_are_numbers():
    """Texts with a null, decimal numbers, and texts of bytes as NumPy has them."""
    read = [entries_of(np.array(items)) for items in ([Decimal("0.5"), None], ["0.5", None], [b"0.5", b"nan"])]
    for each in read:
        assert each.numbers[0] == 0.5 and np.isnan(each.numbers[1]) and not each.odd
    days = entries_of(np.array([date(2024, 5, 3), date(2024, 5, 4)], dtype=object))
    assert days.is_text and days.word == "'2024-05-03'"


def test_true_and_false_stay_numbers(log):
    found = named_arrays(log(with_tilt([True, False] * 100)))
    assert found["tilt"].tolist() == [1.0, 0.0] * 100
