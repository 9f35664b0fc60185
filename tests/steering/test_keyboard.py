import os
import pty
import termios

import pytest

from twbal.core.errors import ConfigError
from twbal.steering.keyboard import Keyboard
from twbal.steering.request import Key


@pytest.fixture
def terminal():
    """The person's end of a pseudo-terminal, and the program's."""
    person, program = pty.openpty()
    yield person, program
    for end in (person, program):
        try:
            os.close(end)
        except OSError:  # closed by the test
            continue


def modes(program):
    return termios.tcgetattr(program)


def test_keys_come_without_enter_and_are_not_shown(terminal):
    person, program = terminal
    with Keyboard(program) as keyboard:
        assert keyboard.read(0.0) == [] and not keyboard.lost
        os.write(person, b"w\x1b[D ")
        assert keyboard.read(0.1) == [Key.FASTER, Key.LEFT, Key.REST]
        os.set_blocking(person, False)
        with pytest.raises(BlockingIOError):
            os.read(person, 100)


def test_ctrl_z_and_ctrl_s_do_nothing_and_ctrl_c_interrupts_as_ever(terminal):
    person, program = terminal
    with Keyboard(program) as keyboard:
        os.write(person, b"\x1a\x13\x1cw")
        assert keyboard.read(0.0) == [Key.FASTER]
        os.write(program, b"shown")  # not held up
        assert os.read(person, 100) == b"shown"
        assert modes(program)[3] & termios.ISIG and modes(program)[6][termios.VINTR] == b"\x03"


@pytest.mark.parametrize("error", [None, RuntimeError, KeyboardInterrupt])
def test_the_terminal_is_as_before_on_every_way_out_and_no_key_is_left_in_it(terminal, error):
    person, program = terminal
    before = modes(program)
    try:
        with Keyboard(program):
            assert modes(program) != before
            os.write(person, b"rm -rf\n")
            if error is not None:
                raise error
    except (RuntimeError, KeyboardInterrupt):
        pass
    assert modes(program) == before
    os.set_blocking(program, False)
    with pytest.raises(BlockingIOError):
        os.read(program, 100)


def test_a_terminal_that_is_closed_is_lost(terminal):
    person, program = terminal
    with Keyboard(program) as keyboard:
        os.close(person)
        assert keyboard.read(0.0) == [] and keyboard.lost
        assert keyboard.read(0.1) == []


def test_what_is_no_terminal_is_refused_with_what_to_do():
    read, write = os.pipe()
    with pytest.raises(ConfigError, match=r"standard input is no terminal .* input=/dev/input/js0"):
        Keyboard(read)
    os.close(read)
    os.close(write)


def test_without_standard_input_the_error_is_the_same(monkeypatch):
    monkeypatch.setattr("sys.stdin", None)
    with pytest.raises(ConfigError, match="standard input is no terminal"):
        Keyboard()
