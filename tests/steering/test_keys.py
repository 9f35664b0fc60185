import pytest

from twbal.steering.keys import ESCAPE_TIME, KeyDecoder
from twbal.steering.request import Key

BYTES = {
    b"wW": [Key.FASTER] * 2,
    b"s\x1b[B": [Key.SLOWER] * 2,
    b"\x1b[A\x1bOA": [Key.FASTER] * 2,
    b"a\x1b[Dd\x1b[C": [Key.LEFT, Key.LEFT, Key.RIGHT, Key.RIGHT],
    b"\r\n qx": [Key.KEEP, Key.KEEP, Key.REST, Key.END, Key.STOP],
    b"hjkl123\t\x7f\xc3\xa4": [],  # keys without a meaning, one of two bytes
    b"\x1b[3~w\x1b[1;5Aw\x1b[200~w": [Key.FASTER] * 3,  # delete, an arrow with Ctrl, a paste
}


@pytest.mark.parametrize(("data", "keys"), BYTES.items())
def test_bytes_are_keys_also_where_they_come_one_by_one(data, keys):
    assert KeyDecoder().feed(data, 0.0) == keys
    decoder = KeyDecoder()
    assert [key for byte in data for key in decoder.feed(bytes([byte]), 0.0)] == keys


def test_an_escape_that_stays_alone_is_a_stop_and_one_that_begins_an_arrow_is_not():
    decoder = KeyDecoder()
    assert decoder.feed(b"\x1b", 1.0) == decoder.feed(b"", 1.0 + ESCAPE_TIME / 2) == []
    assert decoder.feed(b"[A", 1.0 + ESCAPE_TIME / 2) == [Key.FASTER]
    assert decoder.feed(b"\x1b", 2.0) == []
    assert decoder.feed(b"", 2.0 + 1.01 * ESCAPE_TIME) == [Key.STOP]
    assert decoder.feed(b"", 3.0) == []


def test_an_escape_among_other_keys_is_a_stop_at_once():
    assert KeyDecoder().feed(b"\x1bw", 0.0)[0] is Key.STOP
    assert KeyDecoder().feed(b"\x1b\x1b", 0.0)[0] is Key.STOP
