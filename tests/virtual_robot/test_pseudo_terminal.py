import os
import select
from contextlib import closing

import pytest

from twbal.virtual_robot.pseudo_terminal import PseudoTerminal


@pytest.fixture
def line():
    with closing(PseudoTerminal()) as terminal:
        yield terminal


def host(line):
    return os.open(line.path, os.O_RDWR | os.O_NOCTTY)


def test_bytes_pass_unchanged_and_without_echo(line):
    end = host(line)
    os.write(end, bytes(range(256)))
    assert line.read(1.0) == bytes(range(256))
    assert line.read(0.0) == b""
    line.write(bytes(range(256)))
    assert os.read(end, 1000) == bytes(range(256))
    os.close(end)


def test_an_absent_host_is_not_a_silent_one(line):
    assert line.read(0.0) is None
    end = host(line)
    assert line.read(0.0) == b""
    os.close(end)
    assert line.read(0.0) is None
    again = host(line)
    os.write(again, b"back")
    assert line.read(1.0) == b"back"
    os.close(again)


def test_the_last_words_of_a_host_are_heard(line):
    end = host(line)
    os.write(end, b"stop")
    os.close(end)
    assert line.read(0.0) == b"stop"
    assert line.read(0.0) is None


def test_writing_never_blocks(line):
    end = host(line)
    for _ in range(100):
        line.write(b"x" * 1000)
    os.close(end)
    line.write(b"nobody hears this")


def test_a_port_that_was_readable_by_a_hang_up_and_is_open_again_is_silent(line, monkeypatch):
    os.close(host(line))
    assert select.select([line._robot_end], [], [], 1.0)[0]  # by the hang-up
    end = host(line)  # the next host opens it between looking and reading
    monkeypatch.setattr(select, "select", lambda *ends: (ends[0], [], []))
    assert line.read(0.1) == b""
    os.close(end)
