import io
import os
import pty
import threading
from contextlib import suppress
from pathlib import Path

import pytest
from hydra.utils import instantiate
from omegaconf import OmegaConf

from twbal.core.errors import LinkError
from twbal.link.person import ask_again, ask_for_motion, confirm_lifted, confirm_placed


class Terminal(io.StringIO):
    """Keys pressed at a terminal."""

    def isatty(self):
        return True


def test_the_person_is_asked_and_waited_for(monkeypatch, capsys):
    keys = Terminal("\nleft over")
    monkeypatch.setattr("sys.stdin", keys)
    confirm_placed(3)
    assert "Trial 3: hold the robot at its start" in capsys.readouterr().out
    assert keys.read() == "left over"


def test_a_terminal_that_ends_is_an_error_that_says_what_to_do(monkeypatch):
    monkeypatch.setattr("sys.stdin", Terminal(""))
    with pytest.raises(LinkError, match=r"terminal has ended \(Ctrl-D.* press Enter; or set link\.confirm_placed=null"):
        confirm_placed(0)


def test_without_standard_input_there_is_no_terminal_to_ask_at(monkeypatch):
    monkeypatch.setattr("sys.stdin", None)
    for ask in (lambda: confirm_placed(0), confirm_lifted):
        with pytest.raises(LinkError, match=r"no terminal to ask at.* link\.confirm_placed=null"):
            ask()


def test_a_pipe_cannot_arm_a_robot(monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO("\n\n\n"))
    with pytest.raises(LinkError, match="no terminal to ask at"):
        confirm_placed(0)


def test_the_serial_link_asks_by_default(monkeypatch, capsys):
    link = OmegaConf.load(Path(__file__).parents[2] / "conf" / "groups" / "link.yaml").serial
    monkeypatch.setattr("sys.stdin", Terminal("\n"))
    instantiate(link.confirm_placed)(5)
    assert "Trial 5" in capsys.readouterr().out


@pytest.fixture
def terminal(monkeypatch):
    """The far end of the terminal at which this program asks."""
    far, near = pty.openpty()
    with os.fdopen(near) as keys:
        monkeypatch.setattr("sys.stdin", keys)
        yield far
    with suppress(OSError):
        os.close(far)


@pytest.mark.parametrize(
    "ask",
    [lambda: confirm_placed(1), confirm_lifted, lambda: ask_for_motion("Lean it"), lambda: ask_again("It fell")],
    ids=["placed", "lifted", "moved", "again"],
)
def test_an_enter_that_was_pressed_before_the_question_is_no_answer(ask, terminal):
    os.write(terminal, b"\n\n")
    answered = threading.Event()
    person = threading.Thread(target=lambda: (ask(), answered.set()), daemon=True)
    person.start()
    assert not answered.wait(0.3)
    os.write(terminal, b"\n")
    assert answered.wait(5.0)
    person.join()
