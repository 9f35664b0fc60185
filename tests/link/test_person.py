import io
from pathlib import Path

import pytest
from hydra.utils import instantiate
from omegaconf import OmegaConf

from twbal.core.errors import LinkError
from twbal.link.person import confirm_placed


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


def test_without_a_person_it_is_an_error_that_says_what_to_do(monkeypatch):
    monkeypatch.setattr("sys.stdin", Terminal(""))
    with pytest.raises(LinkError, match=r"link\.confirm_placed=null"):
        confirm_placed(0)


def test_a_pipe_cannot_arm_a_robot(monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO("\n\n\n"))
    with pytest.raises(LinkError, match="no terminal to ask at"):
        confirm_placed(0)


def test_the_serial_link_asks_by_default(monkeypatch, capsys):
    link = OmegaConf.load(Path(__file__).parents[2] / "conf" / "groups" / "link.yaml").serial
    monkeypatch.setattr("sys.stdin", Terminal("\n"))
    instantiate(link.confirm_placed)(5)
    assert "Trial 5" in capsys.readouterr().out
