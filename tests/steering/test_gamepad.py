import os
from pathlib import Path

import pytest

from twbal.core.errors import ConfigError
from twbal.steering.gamepad import Gamepad, RecordedGamepad, gamepad
from twbal.steering.joystick import DEAD_ZONE, EVENT, JoystickDecoder, Layout
from twbal.steering.request import Key, Sticks

LAYOUT = Layout(speed_axis=1, turn_axis=0, rest_button=0, stop_button=1, end_button=7)
BUTTON, AXIS, STATE = 1, 2, 0x80


def packed(*events):
    return b"".join(EVENT.pack(*event) for event in events)


def test_an_event_is_that_of_the_kernels_header():
    (event,) = JoystickDecoder().feed(bytes.fromhex("78563412 0180 02 01".replace(" ", "")))
    assert event == (0x12345678, -32767, AXIS, 1)


def test_events_may_come_in_pieces():
    data, decoder = packed((1, 5, AXIS, 0), (2, 6, AXIS, 1)), JoystickDecoder()
    found = [event for byte in data for event in decoder.feed(bytes([byte]))]
    assert [event.value for event in found] == [5, 6]


@pytest.fixture
def pipe(tmp_path):
    """A pad's device, in the form of a named pipe, and the end that is written to."""
    os.mkfifo(tmp_path / "js0")
    with Gamepad(tmp_path / "js0", LAYOUT) as pad, open(tmp_path / "js0", "wb", buffering=0) as end:
        yield pad, end


def test_forward_and_left_are_the_negative_ends_of_axes_and_the_middle_asks_for_nothing(pipe):
    pad, end = pipe
    small = int(0.9 * DEAD_ZONE * 32767)
    end.write(packed((0, -32767, AXIS, 1), (1, 32767, AXIS, 0), (2, small, AXIS, 1), (3, -32768, AXIS, 0)))
    assert pad.read(0.0) == [Sticks(1.0, 0.0), Sticks(1.0, -1.0), Sticks(0.0, -1.0), Sticks(0.0, 1.0)]


def test_what_stood_so_at_the_opening_counts_not_and_other_axes_only_show_that_the_pad_is_there(pipe):
    pad, end = pipe
    end.write(packed((0, -32767, AXIS | STATE, 1), (0, 1, BUTTON | STATE, 1)))
    assert pad.read(0.0) == [] and not pad.lost
    end.write(packed((1, 32767, AXIS, 5)))
    assert pad.read(0.0) == [Key.KEEP]


def test_a_stick_that_was_let_go_and_a_stop_that_was_pressed_while_events_were_lost_count(pipe):
    """After an overflow of its queue Linux tells how all stands (joydev_fetch_next_event in drivers/input/joydev.c)."""
    pad, end = pipe
    end.write(packed((0, 0, AXIS | STATE, 1), (1, -32767, AXIS, 1)))
    assert pad.read(0.0) == [Sticks(1.0, 0.0)]
    end.write(packed((9, 0, BUTTON | STATE, 0), (9, 1, BUTTON | STATE, 1), (9, 0, AXIS | STATE, 1)))
    assert pad.read(0.0) == [Key.KEEP, Key.STOP, Sticks(0.0, 0.0)]


def test_buttons_count_when_they_are_pressed(pipe):
    pad, end = pipe
    end.write(packed((0, 1, BUTTON, 0), (1, 0, BUTTON, 0), (2, 1, BUTTON, 7), (3, 1, BUTTON, 1), (4, 1, BUTTON, 3)))
    assert pad.read(0.0) == [Key.REST, Key.KEEP, Key.END, Key.STOP, Key.KEEP]


def test_a_pad_without_news_is_not_lost_and_one_that_is_unplugged_is(pipe):
    pad, end = pipe
    assert pad.read(0.0) == [] and not pad.lost
    end.close()
    assert pad.read(0.1) == [] and pad.lost
    assert pad.read(0.2) == []


def test_a_recording_comes_as_it_was_recorded_and_is_lost_after_its_last_event(tmp_path):
    (tmp_path / "pad.bin").write_bytes(packed((5000, -32767, AXIS, 1), (5250, 0, AXIS, 1), (6000, 1, BUTTON, 0)))
    pad = gamepad(tmp_path / "pad.bin", LAYOUT)
    assert pad.read(0.0) == [Sticks(1.0, 0.0)]
    assert pad.read(0.24) == [] and pad.read(0.25) == [Sticks(0.0, 0.0)]
    assert not pad.lost
    assert pad.read(1.0) == [Key.REST] and pad.lost


def test_a_recording_gives_nothing_any_more_once_the_terminal_is_lost(tmp_path):
    (tmp_path / "pad.bin").write_bytes(packed((0, -32767, AXIS, 1), (500, 0, AXIS, 1)))
    pad = gamepad(tmp_path / "pad.bin", LAYOUT)
    pad.read(0.0)
    pad.lose("terminal")
    assert pad.read(1.0) == [] and pad.lost and pad.name == "terminal"


def test_a_pad_that_is_not_there_and_a_file_without_events_are_errors_that_say_what_to_do(tmp_path):
    with pytest.raises(ConfigError, match=r"Cannot open the gamepad .*js9: No such file.* the group input"):
        gamepad(tmp_path / "js9", LAYOUT)
    (tmp_path / "empty").write_bytes(b"1234567")
    with pytest.raises(ConfigError, match=r"no event of a joystick"):
        RecordedGamepad(tmp_path / "empty", LAYOUT)


@pytest.mark.parametrize(
    "data",
    [
        b"# A text that somebody took for a recording.",
        packed((0, 1, BUTTON, 0), (1, 2, BUTTON, 0)),
        packed((5, 0, AXIS, 0), (4, 0, AXIS, 0)),
        packed((5, 0, 3, 0)),
    ],
    ids=["text", "a button of 2", "time runs back", "no button and no axis"],
)
def test_a_file_of_something_else_drives_no_robot(data, tmp_path):
    (tmp_path / "other").write_bytes(data)
    with pytest.raises(ConfigError, match=r"other is no recording of a joystick: its event \d would be .*cat /dev"):
        gamepad(tmp_path / "other", LAYOUT)


@pytest.mark.parametrize("path", ["/", "/dev/null"], ids=["folder", "another device"])
def test_what_is_no_joystick_drives_no_robot(path):
    with pytest.raises(ConfigError, match="is no joystick"):
        gamepad(Path(path), LAYOUT)
