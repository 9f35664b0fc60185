"""`twbal check-link` over a port: a page, a record, a histogram, and an exit code that says what is wrong."""

import io
import sys
import threading
from contextlib import closing, contextmanager

import pytest
from held_robot import HeldRobot

from twbal.cli.main import main
from twbal.core.json_records import read_record
from twbal.link.checks.procedure import LinkReport
from twbal.link.protocol import Clock
from twbal.virtual_robot.firmware import Firmware, Identity
from twbal.virtual_robot.pseudo_terminal import PseudoTerminal

pytestmark = pytest.mark.usefixtures("as_from_a_shell")
QUICK = ("exchanges=20", "rest=0.6", "hydra.run.dir=out")


@contextmanager
def served(plant):
    """The port of a robot in this process."""
    me, ended = Identity("held", 4.0, 1.0, 0.1, Clock.LOCKSTEP), threading.Event()

    def live(line):
        firmware = Firmware(plant, me)
        while not ended.is_set():
            line.write(firmware.receive(line.read(0.05) or b"", 0))

    with closing(PseudoTerminal()) as line:
        thread = threading.Thread(target=live, args=(line,))
        thread.start()
        try:
            yield line.path
        finally:
            ended.set()
            thread.join()


def tried(plant, *words):
    with served(plant) as port:
        return main(["check-link", "link=serial", f"link.port={port}", *QUICK, *words])


def test_a_good_robot_passes_and_leaves_page_record_and_histogram(tmp_path, capsys):
    assert tried(HeldRobot(), "link.confirm_placed=null") == 0
    page = (tmp_path / "out" / "check_link.txt").read_text()
    assert page in capsys.readouterr().out
    assert "ok       torque sign" in page
    report = read_record(LinkReport, tmp_path / "out" / "check_link.json")
    assert (report.robot, report.version, len(report.round_trips)) == ("held", 2, 20)
    assert {check.verdict for check in report.checks} <= {"ok", "skipped", "warning"}
    picture = (tmp_path / "out" / "figures" / "round_trips.svg").read_text()
    assert "20 answers" in picture
    assert "control period" in picture


def test_a_robot_with_swapped_signs_is_an_exit_code_and_is_named(tmp_path, capsys):
    assert tried(HeldRobot(signs=(-1.0, -1.0)), "link.confirm_placed=null") == 1
    said = capsys.readouterr()
    assert "problem  torque sign" in said.out
    assert "The robot held is not fit to be driven: torque sign, difference sign." in said.err
    assert (tmp_path / "out" / "check_link.json").is_file()


def test_the_motors_do_not_turn_before_a_person_has_said_so(monkeypatch, capsys):
    robot = HeldRobot()
    monkeypatch.setattr(robot, "step", lambda command: pytest.fail("driven"))
    monkeypatch.setattr(sys, "stdin", open("/dev/null"))  # noqa: SIM115, closed below
    assert tried(robot) == 1
    sys.stdin.close()
    assert "has to be lifted by a person" in capsys.readouterr().err


class Terminal(io.StringIO):
    """Keys pressed at a terminal."""

    def isatty(self):
        return True


def test_a_person_is_asked_for_each_motion_and_one_who_does_nothing_passes_nothing(monkeypatch, capsys):
    monkeypatch.setattr(sys, "stdin", Terminal("\n\n\n\n"))
    assert tried(HeldRobot(), "hand_time=0.5") == 1
    said = capsys.readouterr()
    asked = ("wheels OFF THE GROUND", "lean the body FORWARD", "LEFT wheel FORWARD", "RIGHT wheel FORWARD")
    places = [said.out.index(words) for words in asked]
    assert places == sorted(places)
    assert "not fit to be driven: tilt sign, left wheel sign, right wheel sign." in said.err


def test_motions_by_hand_that_are_left_out_are_skipped_and_not_ok(monkeypatch, capsys):
    monkeypatch.setattr(sys, "stdin", Terminal("\n"))
    assert tried(HeldRobot(), "by_hand=false") == 0
    assert "skipped  signs by hand" in capsys.readouterr().out
