"""`twbal check-link` over a port: a page, a record, a histogram, and an exit code that says what is wrong."""

import io
import os
import re
import signal
import struct
import sys
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path

import pytest
import yaml
from held_robot import HeldRobot
from served import served

from twbal.cli.conf_folder import conf_folder
from twbal.cli.main import main
from twbal.core.json_records import read_record
from twbal.link.checks.procedure import LinkReport
from twbal.link.protocol import Clock
from twbal.virtual_robot.firmware import Firmware, Identity

pytestmark = pytest.mark.usefixtures("as_from_a_shell")
QUICK = ("exchanges=20", "rest=0.6", "write_sheet=false", "hydra.run.dir=out")
PATIENT = "link.timeout=10"  # a machine with other work to do may halt robot and host for longer than the default


def port_of(plant, firmware=0, torque_limit=4.0):
    """As long as it is served."""
    return served(Firmware(plant, Identity("held", torque_limit, 1.0, 0.1, Clock.LOCKSTEP, firmware=firmware)))


def tried(plant, *words, **identity):
    """Held against a packaged sheet with a torque limit near 4 N·m, unless the words name another one."""
    words = words if any(word.startswith("robot=") for word in words) else ("robot=upkie", *words)
    with port_of(plant, **identity) as port:
        return main(["check-link", "link=serial", f"link.port={port}", PATIENT, *QUICK, *words])


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
    assert "The robot held is not fit to be driven: torque sign." in said.err
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
    monkeypatch.setattr(sys, "stdin", Terminal("\n\nn\n\nn\n\nno\n\nn\n"))
    assert tried(HeldRobot(), "hand_time=0.5") == 1
    said = capsys.readouterr()
    asked = (
        "wheels OFF THE GROUND",
        "lean the body FORWARD",
        "LEFT wheel FORWARD",
        "RIGHT wheel FORWARD",
        "TO THE LEFT",
    )
    places = [said.out.index(words) for words in asked]
    assert places == sorted(places)
    assert said.out.count("Enter to do it once more, n and Enter to go on") == 4
    assert "rest: the sensors are watched for 0.6 s, without torque: keep the robot still" in said.out
    assert "not fit to be driven: tilt sign, left wheel sign, right wheel sign, yaw rate sign." in said.err


def test_motions_by_hand_that_are_left_out_are_skipped_and_not_ok(monkeypatch, capsys):
    monkeypatch.setattr(sys, "stdin", Terminal("\n"))
    assert tried(HeldRobot(), "by_hand=false") == 0
    said = capsys.readouterr().out
    assert "skipped  signs by hand" in said
    assert "the robot is not armed before its signs were tried by hand" in said
    (line,) = [line for line in said.splitlines() if line.startswith(("next", "then"))]
    assert re.fullmatch(rf"next  twbal check-link robot=upkie link=serial link.port=/dev/pts/\d+ {PATIENT}", line)


def test_a_robot_whose_signs_were_left_out_is_armed_only_where_it_places_itself(tmp_path, monkeypatch, capsys):
    own_sheet(tmp_path)
    monkeypatch.setattr(sys, "stdin", Terminal("\n" * 9))
    assert tried(HeldRobot(), "by_hand=false", "--config-dir=mine", "robot=mine", "write_sheet=true") == 0
    robot = HeldRobot()
    with port_of(robot) as port:
        reset, robot.reset = robot.reset, lambda trial: pytest.fail("armed")
        assert driven(port, of_person=True) == 1
        assert re.search(r"last twbal check-link of .* left out: signs by hand\.", capsys.readouterr().err)
        robot.reset = reset
        assert driven(port, "heed_check=false", of_person=True) == 0
        capsys.readouterr()
        assert driven(port, "hydra.run.dir=again") == 0
        said = "the signs by hand of the robot 'held' were not tried by `twbal check-link`"
        assert said in capsys.readouterr().out


def own_sheet(tmp_path, **changed):
    """A sheet of one's own, of the held robot."""
    text = (conf_folder() / "robot" / "paper.yaml").read_text().replace("name: paper", "name: mine")
    text = text.replace("torque_limit: 20.0 ", "torque_limit: 4.5 ")
    for key, value in changed.items():
        text = re.sub(rf"^{key}: [\d.]+", f"{key}: {value}", text, flags=re.MULTILINE)
    path = tmp_path / "mine" / "robot" / "mine.yaml"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def driven(port, *words, of_person=False):
    """By `real-rollout`, and by one's own sheet unless the words name another one."""
    mine = () if any(word.startswith("robot=") for word in words) else ("--config-dir=mine", "robot=mine")
    quick = ("policy=random", "trials=1", "steps=3", *([] if of_person else ["link.confirm_placed=null"]))
    return main(["real-rollout", "link=serial", f"link.port={port}", PATIENT, *mine, *quick, *words])


MINE = ("--config-dir=mine", "robot=mine", "link.confirm_placed=null", "write_sheet=true")


def test_what_was_measured_enters_ones_own_sheet_and_comments_stay(tmp_path, capsys):
    path = own_sheet(tmp_path, control_period="0.01")
    comments = [line.partition("#")[2].strip() for line in path.read_text().splitlines()]
    assert tried(HeldRobot(bias=0.0125), *MINE) == 0
    said, text = capsys.readouterr().out, path.read_text()
    assert "control_period: 0.01 -> 0.02, data_sheet" in said
    assert "torque_limit: 4.5 -> 4, data_sheet" in said
    assert all(comment.rpartition("; ")[2] in text for comment in comments)
    sheet = yaml.safe_load(text)
    assert (sheet["control_period"], sheet["torque_limit"]) == (0.02, 4.0)
    assert {"control_period", "torque_limit"} <= set(sheet["provenance"]["data_sheet"])
    gyro = float(re.search(r"^#   gyro bias (\S+) rad/s$", text, re.MULTILINE)[1])
    assert gyro == pytest.approx(0.0125, abs=3 * 0.003 / 31**0.5)
    assert tried(HeldRobot(), *MINE) == 0
    assert "its values are the robot's" in capsys.readouterr().out
    assert path.read_text().count("# twbal check-link") == 1


@pytest.mark.parametrize("limit", [0.8, 1.0000055])
def test_a_torque_limit_that_single_precision_cannot_hold_is_that_of_the_sheet_after_the_check(limit, tmp_path, capsys):
    path = own_sheet(tmp_path, torque_limit=f"{1.03 * limit:.6f}")
    pulse = f"pulse={0.4 / limit:.2f}"
    assert tried(HeldRobot(), *MINE, pulse, torque_limit=limit) == 0
    assert 0.0 <= limit - yaml.safe_load(path.read_text())["torque_limit"] < 1e-5 * limit
    with port_of(HeldRobot(), torque_limit=limit) as port:
        assert driven(port) == 0


def test_a_sheet_a_little_beyond_the_limit_is_changed_as_it_would_not_be_driven(tmp_path):
    path = own_sheet(tmp_path, torque_limit="4.00002")
    assert tried(HeldRobot(), *MINE) == 0
    assert yaml.safe_load(path.read_text())["torque_limit"] == 4.0


def test_a_packaged_sheet_stays_and_a_copy_of_ones_own_is_written(tmp_path, capsys):
    packaged = (conf_folder() / "robot" / "upkie.yaml").read_text()
    words = ("robot=upkie", "link.confirm_placed=null", "write_sheet=true")
    assert tried(HeldRobot(), *words) == 0
    assert (conf_folder() / "robot" / "upkie.yaml").read_text() == packaged
    sheet = yaml.safe_load((tmp_path / "my_conf" / "robot" / "my_upkie.yaml").read_text())
    assert (sheet["name"], sheet["control_period"], sheet["torque_limit"]) == ("my_upkie", 0.02, 3.4)
    said = capsys.readouterr().out
    assert "choose it by --config-dir=my_conf robot=my_upkie" in said
    assert "next  twbal lqr --config-dir=my_conf robot=my_upkie" in said
    then = r"^then  twbal real-rollout --config-dir=my_conf robot=my_upkie policy.path=<its policy.pt> link=serial"
    assert re.search(
        then + rf" link.port=/dev/pts/\d+ {PATIENT} link.confirm_placed=null steps=25$", said, re.MULTILINE
    )


def test_the_sheet_of_another_robot_is_not_written_into(tmp_path, capsys):
    path = own_sheet(tmp_path, torque_limit="20.0")
    before = path.read_text()
    assert tried(HeldRobot(), *MINE) == 1
    said = capsys.readouterr()
    assert "not fit to be driven: sheet." in said.err
    assert "problem  sheet      'mine', torque limit 20 N·m (expected about the robot's, 4 N·m)" in said.out
    assert path.read_text() == before
    assert tried(HeldRobot(), *MINE, "robot.torque_limit=4.0") == 1
    assert "takes at most 4 N·m, and the sheet 'mine' says 20 N·m: nothing was written" in capsys.readouterr().err
    assert path.read_text() == before


@pytest.mark.parametrize("words", [["write_sheet=true"], ["write_sheet=false"], ["heed_check=false"]])
def test_a_sheet_of_another_robot_is_told_before_a_person_is_asked_or_a_motor_turns(words, monkeypatch, capsys):
    robot = HeldRobot()
    robot.reset = lambda trial: pytest.fail("armed")
    monkeypatch.setattr(sys, "stdin", Terminal(""))
    assert tried(robot, "robot=paper", *words) == 1  # of 20 N·m
    said = capsys.readouterr()
    assert "not fit to be driven: sheet." in said.err
    assert "choose its own by --config-dir=<folder> robot=<name>" in said.out
    assert "OFF THE GROUND" not in said.out


def test_a_robot_that_announces_its_limit_in_another_unit_is_not_armed(capsys):
    """esp32, of 0.98 N·m, whose firmware says 98, as of N·cm."""
    robot = HeldRobot()
    robot.reset = lambda trial: pytest.fail("armed")
    assert tried(robot, "robot=esp32", "link.confirm_placed=null", torque_limit=98.0) == 1
    said = capsys.readouterr().out
    assert "problem  sheet      'esp32', torque limit 0.98 N·m (expected about the robot's, 98 N·m)" in said
    assert "does the firmware announce its limit in another unit than N·m?" in said


def test_motors_that_may_be_on_are_the_last_words(capsys):
    robot = HeldRobot()
    step = robot.step

    def hangs(command):
        if command > 0.0:
            time.sleep(4.0)
        return step(command)

    robot.step = hangs
    assert tried(robot, *MINE[2:], "write_sheet=false", "link.timeout=0.2") == 1
    said = capsys.readouterr().err.splitlines()
    assert said[-1].startswith("twbal: error: The robot held is not fit to be driven: stop.")
    assert said[-1].endswith("THEY MAY STILL BE ON: switch it off by hand.")


def test_a_check_that_was_broken_off_leaves_no_earlier_one_to_rely_on(tmp_path, capsys):
    own_sheet(tmp_path)
    assert tried(HeldRobot(), *MINE) == 0
    robot = HeldRobot()
    step = robot.step
    robot.step = lambda command: os.kill(os.getpid(), signal.SIGINT) or step(command)
    assert tried(robot, *MINE) == 130
    capsys.readouterr()
    with port_of(HeldRobot()) as port:
        assert driven(port) == 1
        assert re.search(
            r"is not armed: the last twbal check-link of [-\d]+ [:\d]+\+00:00 did not finish\.", capsys.readouterr().err
        )
        assert driven(port, "heed_check=false") == 0
    assert tried(HeldRobot(), *MINE) == 0
    with port_of(HeldRobot()) as port:
        assert driven(port, "hydra.run.dir=again") == 0


def test_motors_that_may_be_on_after_a_check_are_kept_from_being_armed(tmp_path, capsys):
    own_sheet(tmp_path)
    assert tried(HeldRobot(), *MINE) == 0
    robot = HeldRobot()
    reset = robot.reset
    robot.reset = lambda trial: time.sleep(2.0) or reset(trial)
    assert tried(robot, *MINE, "link.arm_timeout=0.2", "link.timeout=0.2") == 1
    assert "fit to be driven: rest, motors off." in capsys.readouterr().err
    with port_of(HeldRobot()) as port:
        assert driven(port) == 1
        assert "found something wrong: rest, motors off." in capsys.readouterr().err


def test_a_check_with_a_packaged_sheet_counts_for_its_copy(tmp_path, capsys):
    words = ("robot=upkie", "link.confirm_placed=null", "write_sheet=true")
    assert tried(HeldRobot(), *words) == 0
    assert tried(HeldRobot(signs=(-1.0, -1.0)), *words) == 1
    capsys.readouterr()
    with port_of(HeldRobot()) as port:
        assert driven(port, "--config-dir=my_conf", "robot=my_upkie") == 1
        assert re.search(r"found something wrong: .*torque sign\.", capsys.readouterr().err)


def test_a_robot_that_was_found_wrong_writes_no_sheet_and_is_not_armed_until_that_is_said(tmp_path, capsys):
    path = own_sheet(tmp_path, torque_limit="4.0")
    before = path.read_text()
    assert tried(HeldRobot(signs=(-1.0, -1.0)), *MINE) == 1
    assert path.read_text() == before
    robot = HeldRobot()
    with port_of(robot) as port:
        robot.reset = lambda trial: pytest.fail("armed")
        assert driven(port) == 1
        said = capsys.readouterr().err
        assert "is not armed: the last twbal check-link of " in said
        assert re.search(r"found something wrong: .*torque sign\.", said)  # and losses, under load
        del robot.reset
        assert driven(port, "heed_check=false") == 0


def test_a_good_robot_is_armed_until_its_sheet_or_its_firmware_changes(tmp_path, capsys):
    own_sheet(tmp_path)
    assert tried(HeldRobot(), *MINE) == 0
    with port_of(HeldRobot()) as port:
        assert driven(port) == 0
        assert "never tried" not in capsys.readouterr().out
        assert driven(port, "robot.body_mass=10.5") == 1
        assert ": body_mass was 10 kg and is 10.5 kg." in capsys.readouterr().err
    with port_of(HeldRobot(), firmware=77) as port:
        assert driven(port) == 1
        assert "its firmware was not numbered and is 0000004d" in capsys.readouterr().err


def test_a_robot_that_was_never_checked_is_driven_with_a_sentence_of_advice(tmp_path, capsys):
    own_sheet(tmp_path, torque_limit="4.0")
    with port_of(HeldRobot()) as port:
        assert driven(port) == 0
        assert "was never tried by `twbal check-link`" in capsys.readouterr().out
        assert driven(port, "heed_check=false") == 0
        assert "never tried" not in capsys.readouterr().out


def test_a_robot_with_a_sheet_of_new_robot_is_not_armed_before_it_was_checked(tmp_path, capsys):
    path = own_sheet(tmp_path, torque_limit="4.0")
    head = "# mine, by `twbal new-robot`. Each comment is the unit and where the number comes from."
    path.write_text(f"{head}\n{path.read_text()}")
    robot = HeldRobot()
    reset = robot.reset
    with port_of(robot) as port:
        robot.reset = lambda trial: pytest.fail("armed")
        assert driven(port) == 1
        said = capsys.readouterr().err
        assert "is not armed: it was never tried by `twbal check-link`" in said
        assert "heed_check=false" in said
        robot.reset = reset
        assert driven(port, "heed_check=false") == 0
    assert tried(HeldRobot(), *MINE) == 0
    with port_of(HeldRobot()) as port:
        assert driven(port, "hydra.run.dir=again") == 0


def test_iterate_and_drive_refuse_it_too_and_before_anything_is_learned(tmp_path, capsys):
    own_sheet(tmp_path, torque_limit="4.0")
    assert tried(HeldRobot(signs=(-1.0, -1.0)), *MINE) == 1
    words = ("--config-dir=mine", "robot=mine", "link=serial", "link.confirm_placed=null", "hydra.run.dir=run")
    with port_of(HeldRobot()) as port:
        assert main(["iterate", f"link.port={port}", *words]) == 1
        said = capsys.readouterr()
        assert re.search(r"found something wrong: .*torque sign", said.err)
        assert "real_rollout.heed_check=false" in said.err
        assert "sim-collect" not in said.out
    with port_of(HeldRobot()) as port, pseudo_keys() as keys:
        assert main(["drive", f"link.port={port}", "policy=random", f"input={keys}", "seconds=0.1", *words]) == 1
        assert re.search(r"found something wrong: .*torque sign", capsys.readouterr().err)


@contextmanager
def pseudo_keys():
    """Events of a gamepad that nobody touches."""
    with tempfile.NamedTemporaryFile() as events:
        events.write(struct.pack("<IhBB", 0, 0, 2, 0))  # as Linux writes them: an axis in its middle
        events.flush()
        yield events.name


@pytest.mark.slow
def test_a_virtual_robot_counts_only_where_that_is_asked_for(tmp_path, capsys):
    quick = ("exchanges=10", "rest=0.1", "pulse=0.4", "write_sheet=false", "hydra.run.dir=out")
    records = Path(os.environ["XDG_STATE_HOME"]) / "twbal" / "links"
    main(["check-link", *quick])
    assert not records.exists()
    main(["check-link", "heed_check=true", *quick])
    (record,) = records.iterdir()
    record.write_text(re.sub(r'"problems": \[[^]]*\]', '"problems": ["stop"]', record.read_text()))
    words = ("policy=random", "trials=1", "steps=3")
    capsys.readouterr()
    assert main(["real-rollout", "heed_check=true", "hydra.run.dir=a", *words]) == 1
    assert "found something wrong: stop." in capsys.readouterr().err
    assert main(["real-rollout", "hydra.run.dir=b", *words]) == 0
