"""Text files of columns: what is handled is said, and all else is one error with a line number."""

import os

import numpy as np
import pytest
from foreign_logs import NAMES, columns, text

from twbal.core.errors import LogError
from twbal.io.importers.all_columns import all_columns
from twbal.io.importers.formats import formats
from twbal.io.importers.text_files import read_text

ROWS = columns(60)
WANTED = ["time", "tilt", "command"]
PLACES = [NAMES.index(name) for name in WANTED]


@pytest.fixture
def log(tmp_path):
    def write(content):
        path = tmp_path / "log.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


@pytest.mark.parametrize("delimiter", [",", ";", "\t", "  "])
@pytest.mark.parametrize("comment", ["", "# made by hand\n", "% one\n\n%% two\n"])
@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
def test_columns_are_read_whatever_parts_them(delimiter, comment, newline, log):
    content = (comment + text(ROWS, delimiter)).replace("\n", newline)
    read = read_text(log(content), WANTED)
    assert read.values == pytest.approx(ROWS[:, PLACES], abs=1e-8)
    assert read.lines[0] == comment.count("\n") + 2
    assert read.notes == ()


@pytest.mark.parametrize("order", ["utf-16-le", "utf-16-be"])
def test_text_in_utf_16_is_read_as_it_is(order, log):
    """As Excel and PowerShell write it, with a byte-order mark."""
    content = ("\ufeff" + text(ROWS, "\t").replace("\n", "\r\n")).encode(order)
    assert read_text(log(content), WANTED).values == pytest.approx(ROWS[:, PLACES], abs=1e-8)
    with pytest.raises(LogError, match="begins as text in UTF-16, and breaks off"):
        read_text(log(content[:-1]), WANTED)


@pytest.mark.parametrize("delimiter", [";", "\t", " "])
def test_decimal_commas_are_read_and_said(delimiter, log):
    read = read_text(log(text(ROWS, delimiter, decimal=",")), WANTED)
    assert read.values == pytest.approx(ROWS[:, PLACES], abs=1e-8)
    assert any("decimal commas" in note for note in read.notes)


def test_a_name_that_two_columns_have_is_refused_with_their_numbers(log):
    names = ("time", "tilt", *NAMES[2:-1], "tilt")
    path = log(text(ROWS, names=names))
    with pytest.raises(LogError, match=r"has 2 columns named 'tilt', numbers 2 and 8; .*Map it by its number"):
        read_text(path, ["time", "tilt"])
    assert read_text(path, ["time", 8]).values == pytest.approx(ROWS[:, [0, 7]], abs=1e-8)
    with pytest.raises(LogError, match="2 columns named 'tilt'"):
        read_text(log(text(ROWS, names=None)), ["tilt"], names)


def test_decimal_commas_in_quotation_marks_need_no_other_delimiter(log):
    rows = [",".join(f'"{x:.9g}"'.replace(".", ",") for x in row) for row in ROWS]
    read = read_text(log("\n".join([",".join(NAMES), *rows]) + "\n"), WANTED)
    np.testing.assert_allclose(read.values, ROWS[:, PLACES], rtol=1e-8)


def test_columns_without_a_header_go_by_number_or_by_the_mappings_names(log):
    path = log(text(ROWS, names=None))
    assert read_text(path, [1, 2, 8]).values == pytest.approx(ROWS[:, PLACES], abs=1e-8)
    assert read_text(path, WANTED, NAMES).values == pytest.approx(ROWS[:, PLACES], abs=1e-8)


def test_other_columns_may_hold_text_and_hexadecimal_numbers(log):
    lines = text(ROWS).splitlines()
    marked = [f"{line},{'flags' if i == 0 else hex(i)},walk" for i, line in enumerate(lines)]
    marked[0] = lines[0] + ",flags,mode"
    assert read_text(log("\n".join(marked)), WANTED).values == pytest.approx(ROWS[:, PLACES], abs=1e-8)


def test_a_last_line_that_is_cut_off_is_left_out_and_said(log):
    read = read_text(log(text(ROWS)[:-40]), WANTED)
    assert len(read.values) == len(ROWS) - 1
    assert any("cut off" in note for note in read.notes)


def ends_with(last, column="wheel_angle", scale=100.0):
    """Rows whose last column is long numbers but for the last one, with no newline at the end."""
    k = NAMES.index(column)
    order = [*(j for j in range(len(NAMES)) if j != k), k]
    values = ROWS[:, order] + 1e-3 * np.sin(np.arange(60))[:, None]
    content = text(values * ([1.0] * 7 + [scale]), names=[NAMES[j] for j in order])
    return content.rpartition(",")[0] + "," + last


@pytest.mark.parametrize("last", ["1", "-1.8", "-", "1.8e", "1.83e-"])
def test_a_last_number_that_is_cut_off_is_left_out_and_said(last, log):
    read = read_text(log(ends_with(last, scale=1e4)), WANTED)
    assert len(read.values) == len(ROWS) - 1
    assert read.notes == ("its last line (61) is cut off and left out",)


@pytest.mark.parametrize("last", ["184.9", "185", "184.856789", "1000.12345"])
def test_a_last_number_without_a_newline_is_kept_if_it_is_near_the_others_or_long(last, log):
    whole = text(ROWS)[:-1]
    assert len(read_text(log(whole), WANTED).values) == len(ROWS)
    assert len(read_text(log(ends_with(last)), WANTED).values) == len(ROWS)


def test_a_short_last_number_before_a_newline_is_kept(log):
    assert len(read_text(log(ends_with("1", scale=1e4) + "\n"), WANTED).values) == len(ROWS)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1"])
def test_headers_in_utf_8_and_latin_1_are_read_as_they_are(encoding, log):
    names = ("time [s]", "tilt [°]", "torque [N·m]")
    path = log(text(ROWS[:, PLACES], names=names).encode(encoding))
    assert read_text(path, names).values == pytest.approx(ROWS[:, PLACES], abs=1e-8)
    assert [column.meaning.unit for column in all_columns(path)] == ["s", "°", "N·m"]


def with_second_row(second):
    header, *rows = text(ROWS[:, PLACES], names=WANTED).splitlines()
    return "\n".join([header, second, *rows]) + "\n"


@pytest.mark.parametrize("second", ["ms,deg,N m", "[ms],[deg],[N m]", "(ms),(deg),(N m)"])
def test_a_row_of_units_below_the_header_tells_the_units_and_is_no_sample(second, log):
    path = log("# by hand\n" + with_second_row(second))
    read = read_text(path, WANTED)
    assert read.values == pytest.approx(ROWS[:, PLACES], abs=1e-8)
    assert read.lines[0] == 4
    assert any("row of units" in note for note in read.notes)
    assert [(column.name, column.meaning.unit) for column in all_columns(path)] == [
        ("time", "ms"),
        ("tilt", "deg"),
        ("command", "N·m"),
    ]


def test_units_may_be_missing_and_a_first_row_of_text_and_empty_fields_is_a_sample(log):
    assert len(read_text(log(with_second_row("s,,N·m")), WANTED).values) == len(ROWS)
    path = log("mode,tilt,command\nidle,,\n" + "run,0.1,0.2\n" * 5)
    assert len(read_text(path, ["tilt", "command"]).values) == 6


def test_of_two_lines_of_text_the_error_says_which_to_remove(log):
    wrong = "float,float,float"
    with pytest.raises(LogError, match=rf"two lines of text before its numbers.* Begin '{wrong}' with # or remove"):
        read_text(log(with_second_row(wrong)), WANTED)


BOOT = "rst:0x1 (POWERON_RESET),boot:0x13 (SPI_FAST_FLASH_BOOT)\nMPU6050 connected\n\nReady.\n"


@pytest.mark.parametrize("before", ["My robot\n", BOOT, "0.03,0.01\n"])
@pytest.mark.parametrize("delimiter", [",", ";", "\t", " "])
def test_text_before_the_columns_begin_is_left_out_and_said(before, delimiter, log):
    """Boot messages and titles, and a line whose beginning the recording missed."""
    path = log(before.replace(",", delimiter) + text(ROWS, delimiter))
    read = read_text(path, WANTED)
    assert read.values == pytest.approx(ROWS[:, PLACES], abs=1e-8)
    assert read.lines[0] == before.count("\n") + 2
    assert any("before its columns begin: left out" in note for note in read.notes)
    assert [column.name for column in all_columns(path)] == list(NAMES)


@pytest.mark.parametrize("before", ["Log of May\n", "0.01,0.1\n"])
def test_text_before_columns_without_a_header_is_left_out(before, log):
    path = log(before + text(ROWS, names=None))
    assert read_text(path, [1, 2, 8]).values == pytest.approx(ROWS[:, PLACES], abs=1e-8)


def test_names_above_a_row_of_units_that_do_not_fit_are_not_taken_for_a_title(log):
    path = log("time [s] tilt wheel\ns rad rad\n" + text(ROWS[:, :3], " ", names=None))
    with pytest.raises(LogError, match=r"two lines of text|names 4 columns"):
        read_text(path, ["time"])


def test_the_stamps_of_a_serial_monitor_are_not_read(log):
    content = "\n".join(f"12:34:{k % 60:02d}.789 -> {line}" for k, line in enumerate(text(ROWS).splitlines()))
    assert read_text(log(content + "\n"), WANTED).values == pytest.approx(ROWS[:, PLACES], abs=1e-8)


LONG = columns(400)


@pytest.mark.parametrize("between", [",", "\t", "  ", ", "])
@pytest.mark.parametrize("sign", [":", "=", ": "])
@pytest.mark.parametrize("before", ["", "Ready.\n"])
def test_numbers_with_their_names_before_them_are_columns_of_these_names(between, sign, before, log):
    """As the serial plotter of Arduino wants it."""
    lines = [between.join(f"{n}{sign}{x:.9g}" for n, x in zip(NAMES, row, strict=True)) for row in LONG]
    lines[100] = lines[100][:30]
    path = log(before + "\n".join(lines) + "\n")
    read = read_text(path, WANTED)
    assert read.values == pytest.approx(np.delete(LONG[:, PLACES], 100, axis=0), abs=1e-8)
    assert read.lines[0] == 1 + bool(before)
    assert [column.name for column in all_columns(path)] == list(NAMES)


@pytest.mark.parametrize("stamp", ["12:34:56.789 > ", "[12:34:56.789] ", "[2024-05-03 12:34:56] ", "12:34:56:789 > "])
def test_the_stamps_of_other_terminals_are_not_read_either(stamp, log):
    lines = [stamp + line for line in text(ROWS).splitlines()]
    assert read_text(log("\n".join(lines) + "\n"), WANTED).values == pytest.approx(ROWS[:, PLACES], abs=1e-8)


@pytest.mark.parametrize("brackets", ["[]", "()"])
def test_lists_and_tuples_as_python_prints_them_are_rows(brackets, log):
    lines = [f"{brackets[0]}{', '.join(f'{x:.9g}' for x in row)}{brackets[1]}" for row in ROWS]
    read = read_text(log("\n".join(lines) + "\n"), [k + 1 for k in PLACES])
    assert read.values == pytest.approx(ROWS[:, PLACES], abs=1e-8)


@pytest.mark.parametrize("word", ["ypr\t{}", "$IMU,{}", "{},*5A"])
def test_a_word_that_all_rows_have_is_no_name_and_the_first_row_no_header(word, log):
    """As a program writes it before or behind its numbers; a row that is like the first one is no header again."""
    between = "\t" if "\t" in word else ","
    rows = np.vstack([ROWS, ROWS[:1]])
    lines = [word.format(between.join(f"{x:.9g}" for x in row)) for row in rows]
    first = 1 if word.startswith("{") else 2
    read = read_text(log("\n".join(lines) + "\n"), [first + 1, first + 2])
    assert read.values == pytest.approx(rows[:, 1:3], abs=1e-8)


def test_units_behind_numbers_that_have_names_are_read(log):
    lines = [f"t={1e3 * t:.0f}ms pitch={np.degrees(tilt):.7f}deg | u={u:.6f}" for t, tilt, u in ROWS[:, [0, 1, 7]]]
    columns = all_columns(log("\n".join(lines) + "\n"))
    assert [column.name for column in columns] == ["t [ms]", "pitch [deg]", "u"]
    assert [column.meaning.unit for column in columns] == ["ms", "deg", ""]
    assert np.radians(columns[1].values) == pytest.approx(ROWS[:, 1], abs=1e-8)


@pytest.mark.parametrize(("begin", "end"), [("", ""), ("\x1b[0;32m", "\x1b[0m")])
def test_the_log_of_an_esp32_tells_its_own_time(begin, end, log):
    lines = [
        f"{begin}I ({1000 + 1e3 * t:.0f}) balance: pitch={tilt:.9f} u={u:.6f}{end}" for t, tilt, u in ROWS[:, [0, 1, 7]]
    ]
    columns = all_columns(log("\n".join(lines) + "\n"))
    assert [column.name for column in columns] == ["time_ms", "pitch", "u"]
    assert columns[0].values - 1000.0 == pytest.approx(1e3 * ROWS[:, 0])
    assert columns[1].values == pytest.approx(ROWS[:, 1], abs=1e-8)


def test_a_few_torn_lines_are_left_out_and_said(log):
    """A serial line loses characters, so that two lines become one, or a part of one."""
    lines = text(LONG).splitlines()
    lines[100] = lines[100][:9] + lines[101][20:]
    lines[300] = "0.1"
    read = read_text(log("\n".join(lines) + "\n"), WANTED)
    assert read.values == pytest.approx(np.delete(LONG[:, PLACES], [99, 299], axis=0), abs=1e-8)
    assert list(read.rows[98:100]) == [98, 100]  # a row is missing between them
    assert "2 lines have another number of columns, first line 101: left out" in read.notes


@pytest.mark.parametrize("delimiter", [",", "\t", " "])
@pytest.mark.parametrize("at", [30, 390])
def test_a_header_again_in_another_order_is_refused(at, delimiter, log):
    """As of a program whose columns were changed between two runs that are in one file."""
    order = [0, 7, *range(2, 7), 1]
    second = text(LONG[at:, order], delimiter, names=[NAMES[k] for k in order])
    path = log(text(LONG[:at], delimiter) + second)
    said = rf"Line {at + 2} of .* is a header with the columns in another order \(time.command.* Cut the file there"
    for use in (lambda: read_text(path, WANTED), lambda: read_text(path, [1, 2]), lambda: all_columns(path)):
        with pytest.raises(LogError, match=said):
            use()


@pytest.mark.parametrize("again", [",".join(NAMES), ", ".join(NAMES), ",".join(f'"{name}"' for name in NAMES)])
def test_a_header_again_is_left_out_and_said_however_it_is_spaced(again, log):
    lines = text(LONG).splitlines()
    lines.insert(31, again)
    path = log("\n".join(lines) + "\n")
    read = read_text(path, WANTED)
    assert read.values == pytest.approx(LONG[:, PLACES], abs=1e-8)
    assert read.header_again == 32
    assert "its header comes again, first in line 32: left out" in read.notes
    assert [column.name for column in all_columns(path)] == list(NAMES)


def test_a_header_again_with_a_damaged_name_is_a_row_without_numbers(log):
    lines = text(LONG).splitlines()
    lines.insert(31, ",".join(NAMES).replace("acceleration", "acc#leration"))
    read = read_text(log("\n".join(lines) + "\n"), WANTED)
    assert np.isnan(read.values[30]).all() and len(read.values) == len(LONG) + 1


def test_many_torn_lines_are_an_error_that_gives_the_first(log):
    lines = text(LONG).splitlines()
    for k in range(100, 110):
        lines[k] = "0.1"
    with pytest.raises(LogError, match=r"Line 101 of .* has 1 columns, those before it 8"):
        read_text(log("\n".join(lines) + "\n"), WANTED)


def test_a_field_that_is_no_number_now_and_then_is_taken_as_missing(log):
    lines = text(LONG).splitlines()
    lines[50] = ",".join(["0.49", "0.1.2", *lines[50].split(",")[2:]])
    read = read_text(log("\n".join(lines) + "\n"), WANTED)
    assert np.isnan(read.values[49, 1]) and np.isfinite(np.delete(read.values, 49, axis=0)).all()
    assert "'0.1.2' in column 2 (tilt) of line 51 is taken as missing" in read.notes


@pytest.mark.parametrize("word", ["-", "--", "N/A", "NA", "none", "NULL", "-nan", "NaN", ""])
def test_whatever_says_that_a_number_is_missing_is_no_reason_to_pass_its_column_over(word, log):
    lines = [line.split(",") for line in text(ROWS).splitlines()]
    for k in range(1, 60, 7):
        lines[k][1] = word
    path = log("\n".join(map(",".join, lines)) + "\n")
    assert np.isnan(read_text(path, WANTED).values[::7, 1]).all()
    (tilt,) = (column for column in all_columns(path) if column.name == "tilt")
    assert np.isfinite(tilt.values).sum() == 51


@pytest.mark.parametrize("begin", ["2024-05-03T12:34:", "2024-05-03 12:34:", "12:34:"])
@pytest.mark.parametrize("end", ["", "Z", "+02:00"])
@pytest.mark.parametrize("names", [NAMES, None])
def test_times_of_day_are_seconds_from_the_first(begin, end, names, log):
    rows = [line.split(",") for line in text(LONG, names=names).splitlines()]
    for row, time in zip(rows[bool(names) :], LONG[:, 0], strict=True):
        row[0] = f"{begin}{time + 50:06.3f}{end}"
    path = log("\n".join(map(",".join, rows)) + "\n")
    read = read_text(path, [1, 2])
    assert read.values == pytest.approx(LONG[:, :2], abs=1e-8)
    assert any("seconds from the first" in note for note in read.notes)
    assert all_columns(path)[0].values == pytest.approx(LONG[:, 0], abs=1e-8)


@pytest.mark.parametrize(("begin", "named"), [(b"\x1f\x8b\x08\0", "gzip.* gunzip"), (b"PK\x03\x04\0\0", "workbook")])
def test_a_compressed_file_is_said_to_be_one(begin, named, log):
    with pytest.raises(LogError, match=f"compressed by .*{named}"):
        read_text(log(begin * 30), WANTED)


def test_an_empty_field_is_no_number(log):
    lines = text(ROWS).splitlines()
    lines[5] = ",".join("" if i == 1 else field for i, field in enumerate(lines[5].split(",")))
    read = read_text(log("\n".join(lines)), WANTED)
    assert np.isnan(read.values[4, 1])
    assert np.isfinite(np.delete(read.values, 4, axis=0)).all()


def spoiled(line, change):
    lines = text(ROWS).splitlines()
    lines[line - 1] = change(lines[line - 1])
    return "\n".join(lines) + "\n"


BAD = {
    "Line 17 of .* has 9 columns": spoiled(17, lambda line: line + ",1"),
    "Line 18 of .* has 7 columns": spoiled(18, lambda line: line.rpartition(",")[0]),
    "Line 9 of .* has 'abc' in column 2 \\(tilt\\)": spoiled(
        9, lambda line: line.replace(line.split(",")[1], "abc", 1)
    ),
    "Line 9 of .* has '0x1f' in column 2 .*hexadecimal": spoiled(
        9, lambda line: ",".join(["9", "0x1f", *line.split(",")[2:]])
    ),
    "is empty": "",
    "is empty but for comments": "# nothing\n# at all\n",
    "no columns of numbers; its first line is 'time,tilt": ",".join(NAMES) + "\n",
    "no text file": b"PK\x03\x04\0\0\0" * 30,
    "are no characters": bytes(range(1, 32)) * 20,
    "no columns of numbers": "one two\nthree four\n",
}


@pytest.mark.parametrize("complaint", BAD)
def test_what_cannot_be_read_is_one_error_that_says_where(complaint, log):
    with pytest.raises(LogError, match=complaint):
        read_text(log(BAD[complaint]), WANTED)


def test_a_row_with_more_fields_than_the_header_names_is_told_by_number(log):
    content = "tilt\n" + "1,2\n" * 3 + "1,x\n" + "1,2\n"
    with pytest.raises(LogError, match=r"Line 5 of .* has 'x' in column 2: no number"):
        read_text(log(content), [1, 2])


@pytest.mark.parametrize("read", [all_columns, lambda path: read_text(path, ["millis", "pitch"])])
@pytest.mark.parametrize(
    ("header", "row", "advice"),
    [
        ("millis,pitch,gyro_y,enc_l,enc_r,pwm", "{},-9,67,5,11,0,0,-58", "decimal commas"),
        ("millis,pitch,enc", "{},0.9,5,7", "one name"),
        ("millis,pitch,enc,pwm", "{},0,5", "one name"),
        ("millis;pitch;enc", "{};-9;5;7", "one name"),
        ("millis;pitch", "{};1;2;", "one name"),
    ],
)
def test_a_header_with_another_number_of_columns_is_an_error(header, row, advice, read, log):
    content = "\n".join([header, *(row.format(10 * k) for k in range(30))]) + "\n"
    with pytest.raises(LogError, match=rf"header of .* names \d columns, and the first row .* has \d .*{advice}"):
        read(log(content))


@pytest.mark.parametrize(("after_header", "after_rows"), [(",", ""), ("", ","), (",", ",")])
def test_one_delimiter_at_line_ends_is_no_column(after_header, after_rows, log):
    header, *rows = text(ROWS).splitlines()
    content = "\n".join([header + after_header, *(row + after_rows for row in rows)]) + "\n"
    assert read_text(log(content), WANTED).values == pytest.approx(ROWS[:, PLACES], abs=1e-8)
    assert [column.name for column in all_columns(log(content))][: len(NAMES)] == list(NAMES)


def test_names_of_the_mapping_that_do_not_fit_the_columns_are_an_error(log):
    with pytest.raises(LogError, match=r"no header, and the mapping names 7 columns, and the first row of .* has 8"):
        read_text(log(text(ROWS, names=None)), WANTED, NAMES[:-2] + NAMES[-1:])


def test_decimal_commas_in_some_numbers_alone_are_named_in_the_error(log):
    content = "millis,pitch\n" + "".join(f"{k},0,{k}\n" for k in range(30)) + "31,4\n32,0,1\n"
    with pytest.raises(LogError, match=r"Line 32 of .* has 2 columns, those before it 3. .* decimal commas"):
        read_text(log(content), [1, 2])


def test_a_column_that_is_wanted_twice_comes_twice_and_its_errors_once(log):
    twice = read_text(log(text(ROWS)), ["tilt", "time", "tilt"])
    assert twice.values == pytest.approx(ROWS[:, [1, 0, 1]], abs=1e-8)
    with pytest.raises(LogError, match=r"Line 9 of .* has 'abc' in column 2 \(tilt\): no number"):
        read_text(log(spoiled(9, lambda line: line.replace(line.split(",")[1], "abc", 1))), ["tilt", "time", "tilt"])


def test_quotation_marks_are_left_out_and_must_end(log):
    lines = text(ROWS).splitlines()
    quoted = [lines[0], *(",".join(f'"{field}"' for field in line.split(",")) for line in lines[1:])]
    assert read_text(log("\n".join(quoted)), WANTED).values == pytest.approx(ROWS[:, PLACES], abs=1e-8)
    lines[20], lines[30] = f'"{lines[20]}', f'"{lines[30]}'
    with pytest.raises(LogError, match=r"cannot be read: .*|has 60 rows, and \d+ where quotation marks join some"):
        read_text(log("\n".join(lines)), [2])
    with pytest.raises(LogError, match=r"Line 21 of .* column 1 \(time\): no number"):
        read_text(log("\n".join(lines)), [1])


def test_a_column_that_is_not_there_lists_those_that_are(log):
    with pytest.raises(LogError, match=r"no column 'pitch'; it has: time, tilt, .*command"):
        read_text(log(text(ROWS)), ["pitch"])
    with pytest.raises(LogError, match="has 8 columns; the mapping asks for column 9"):
        read_text(log(text(ROWS)), [9])


def test_a_missing_file_is_an_error(tmp_path):
    with pytest.raises(LogError, match="cannot be read"):
        read_text(tmp_path / "no.csv", WANTED)


@pytest.mark.parametrize("ending", [".csv", *formats()])
def test_a_pipe_that_nobody_writes_to_is_refused_and_not_waited_for(ending, tmp_path):
    os.mkfifo(tmp_path / f"log{ending}")
    with pytest.raises(LogError, match="cannot be read: it is a pipe or a device"):
        all_columns(tmp_path / f"log{ending}")


def test_damaged_files_are_read_or_refused_and_never_crash(log):
    rng = np.random.default_rng(0)
    whole = text(ROWS).encode()
    for _ in range(300):
        data = bytearray(whole)
        for _ in range(rng.integers(1, 6)):
            place = int(rng.integers(len(data)))
            match rng.integers(3):
                case 0:
                    data[place] = int(rng.integers(256))
                case 1:
                    del data[place : place + int(rng.integers(1, 40))]
                case 2:
                    data[place:place] = bytes(rng.choice(list(b',;\n\t -.e0x%#"'), 3).tolist())
        try:
            read = read_text(log(bytes(data)), WANTED)
        except LogError:
            continue
        assert read.values.shape == (len(read.lines), 3)


def test_a_header_that_comes_again_after_a_reset_is_left_out_and_said(log):
    read = read_text(log(text(ROWS[:20]) + text(ROWS[20:])), WANTED)
    assert read.values == pytest.approx(ROWS[:, PLACES], abs=1e-8)
    assert read.lines[20] == 23
    assert "its header comes again, first in line 22: left out" in read.notes
