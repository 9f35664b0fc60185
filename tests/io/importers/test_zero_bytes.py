"""Zero bytes in a text: a tail of them, a few among the text, UTF-16 without its mark, and files that are no text."""

import numpy as np
import pytest
from foreign_logs import NAMES, columns, text

from twbal.core.errors import LogError
from twbal.io.importers.all_columns import all_columns
from twbal.io.importers.text_files import read_text

ROWS = columns(400)
WANTED = ["time", "tilt", "command"]
PLACES = [NAMES.index(name) for name in WANTED]
WHOLE = text(ROWS).encode()


@pytest.fixture
def log(tmp_path):
    def write(content):
        path = tmp_path / "log.csv"
        path.write_bytes(content)
        return path

    return write


@pytest.mark.parametrize("count", [1, 500, 100_000])
def test_a_tail_of_zero_bytes_is_left_out_and_said(count, log):
    """As of a file that an SD card's driver had made longer before the power went."""
    path = log(WHOLE + bytes(count))
    read = read_text(path, WANTED)
    assert read.values == pytest.approx(ROWS[:, PLACES], abs=1e-8)
    (note,) = read.notes
    assert note.startswith(f"its last {count} bytes are" if count > 1 else "its last byte is")
    assert [column.name for column in all_columns(path)] == list(NAMES)


def test_a_line_that_a_tail_of_zero_bytes_cuts_is_left_out(log):
    read = read_text(log(WHOLE[:-40] + bytes(4096)), WANTED)
    assert read.values == pytest.approx(ROWS[:-1, PLACES], abs=1e-8)
    assert any("cut off" in note for note in read.notes)


def test_zero_bytes_at_line_ends_are_left_out_and_all_rows_stay(log):
    """As of a program that writes the end of a C string, too; once in four lines here."""
    lines = WHOLE.splitlines(keepends=True)
    lines[1::4] = [line + b"\0" for line in lines[1::4]]
    read = read_text(log(b"".join(lines)), WANTED)
    assert read.values == pytest.approx(ROWS[:, PLACES], abs=1e-8)
    assert read.notes == ("100 zero bytes among its text: left out",)


@pytest.mark.parametrize(("at", "count"), [(0, 1), (3, 8), (8, 16), (20, 60), (40, 200)])
def test_a_line_in_which_zero_bytes_stand_is_no_row_of_other_numbers(at, count, log):
    place = WHOLE.index(b"\n", 10_000) + 1 + at
    torn = WHOLE[:place] + bytes(count) + WHOLE[place + count :]
    read = read_text(log(torn), WANTED)
    good = np.isfinite(read.values).all(axis=1)
    assert len(ROWS) - 6 <= good.sum() <= len(ROWS) - 1
    by_row = dict(zip(ROWS[:, 0].round(6), ROWS[:, PLACES], strict=True))
    for row in read.values[good]:
        assert row == pytest.approx(by_row[row[0].round(6)], abs=1e-8)
    assert f"{count} zero byte" in " ".join(read.notes)


def test_zero_bytes_before_the_header_or_behind_it_leave_its_names(log):
    """As of a serial line that begins, and of a header that is written with the end of its string."""
    header, _, rows = WHOLE.partition(b"\n")
    for begin in (b"\0\0" + header + b"\n", header + b"\0\n", header + b"\n\0"):
        assert [column.name for column in all_columns(log(begin + rows))] == list(NAMES)
        assert len(read_text(log(begin + rows), WANTED).values) == len(ROWS)


def test_zero_bytes_beyond_the_first_64_kilobytes_are_seen_too(log):
    many = text(columns(3000)).encode()
    read = read_text(log(many[:100_000] + bytes(3) + many[100_003:]), WANTED)
    assert any("3 zero bytes among its text: left out" in note for note in read.notes)
    assert np.isfinite(read.values).all(axis=1).sum() >= 2998


@pytest.mark.parametrize("order", ["utf-16-le", "utf-16-be"])
@pytest.mark.parametrize("tail", [0, 1000])
def test_text_in_utf_16_without_its_mark_is_read_and_said(order, tail, log):
    content = text(ROWS, "\t").replace("\n", "\r\n").encode(order) + bytes(tail)
    read = read_text(log(content), WANTED)
    assert read.values == pytest.approx(ROWS[:, PLACES], abs=1e-8)
    assert "every second byte is zero: read as text in UTF-16 without its byte-order mark" in read.notes


def test_a_unit_beyond_ascii_in_utf_16_is_read(log):
    names = ("time [s]", "tilt [°]", "torque [N·m]")
    path = log(text(ROWS[:, PLACES], names=names).encode("utf-16-le"))
    assert [column.name for column in all_columns(path)] == list(names)


def test_utf_16_that_breaks_off_is_an_error(log):
    content = text(ROWS).encode("utf-16-le")
    broken = content[:2000] + b"\x00\xd8" + content[2000:]  # half of a pair of surrogates
    with pytest.raises(LogError, match="seems to be text in UTF-16-LE, and breaks off or is none"):
        read_text(log(broken), WANTED)


@pytest.mark.parametrize("share", [0.05, 0.5])
def test_many_zero_bytes_are_no_text(share, log):
    data = np.frombuffer(WHOLE, np.uint8).copy()
    data[np.random.default_rng(0).random(len(data)) < share] = 0
    data[-1] = ord("\n")
    with pytest.raises(LogError, match=r"is no text file \(\d+ of its \d+ bytes are zero\)"):
        read_text(log(data.tobytes()), WANTED)


def test_numbers_of_a_program_are_no_text_whatever_their_zero_bytes(log):
    with pytest.raises(LogError, match="is no text file"):
        read_text(log(np.arange(4000.0).tobytes()), WANTED)
    with pytest.raises(LogError, match="is no text file"):
        read_text(log(np.arange(4000, dtype="<u2").tobytes()), WANTED)


def test_a_file_of_zero_bytes_alone_was_never_written(log):
    with pytest.raises(LogError, match="has nothing in it but 5000 zero bytes"):
        read_text(log(bytes(5000)), WANTED)
