"""A robot on a port is given to the library only where the commands would arm it, too."""

import warnings
from contextlib import contextmanager
from dataclasses import replace

import pytest
from held_robot import HeldRobot
from served import served

import twbal
from twbal.cli.conf_folder import conf_folder
from twbal.cli.main import main
from twbal.core.errors import CheckError, ConfigError
from twbal.link.protocol import Clock
from twbal.virtual_robot.firmware import Firmware, Identity

pytestmark = pytest.mark.usefixtures("as_from_a_shell")
PLACED = ["link.confirm_placed=null"]


@contextmanager
def port_of(robot, **identity):
    """As long as it is served."""
    with served(Firmware(robot, Identity("held", 4.0, 1.0, 0.1, Clock.LOCKSTEP, **identity))) as port:
        yield port


@pytest.fixture
def sheet(tmp_path):
    """Of the held robot, of one's own."""
    text = (conf_folder() / "robot" / "paper.yaml").read_text().replace("name: paper", "name: mine")
    path = tmp_path / "mine" / "robot" / "mine.yaml"
    path.parent.mkdir(parents=True)
    path.write_text(text.replace("torque_limit: 20.0 ", "torque_limit: 4.0 "))
    return path


def checked(robot):
    """By `twbal check-link`, with the sheet `mine`."""
    with port_of(robot) as port:
        words = ("--config-dir=mine", "robot=mine", "exchanges=10", "rest=0.4", "write_sheet=false")
        return main(["check-link", *words, "link=serial", f"link.port={port}", *PLACED])


def test_a_robot_that_was_found_wrong_is_refused_and_its_port_is_free(sheet):
    assert checked(HeldRobot(signs=(-1.0, -1.0))) == 1
    robot = HeldRobot()
    with port_of(robot) as port:
        robot.reset = lambda trial: pytest.fail("armed")
        for _ in range(2):
            with pytest.raises(CheckError, match=r"is not armed: .* found something wrong: .*torque sign") as refused:
                twbal.connect(port, sheet, PLACED)
        assert str(refused.value).endswith("or drive it all the same by twbal.connect(..., heed_check=False).")
        with twbal.connect(port, sheet, PLACED, heed_check=False) as plant:
            assert plant.robot_name == "held"


@pytest.mark.parametrize("kind", [str, twbal.robot])
def test_a_robot_that_was_checked_is_the_same_by_path_and_by_parameters_until_it_changes(kind, sheet):
    assert checked(HeldRobot()) == 0
    own = kind(str(sheet))
    with port_of(HeldRobot()) as port:
        with (
            pytest.warns(UserWarning, match=r"^The signs by hand of the robot 'held' were not tried by"),
            twbal.connect(port, own, PLACED) as plant,
        ):
            assert plant.control_period == pytest.approx(0.02)
        with pytest.raises(CheckError, match="left out: signs by hand"):
            twbal.connect(port, own)
        with pytest.raises(CheckError, match="body_mass was 10 kg and is 11 kg"):
            twbal.connect(port, replace(twbal.robot(sheet), body_mass=11.0), PLACED)
    with port_of(HeldRobot(), firmware=5) as port, pytest.raises(CheckError, match="its firmware was not numbered"):
        twbal.connect(port, own, PLACED)


def test_a_robot_that_was_never_checked_is_given_with_a_warning_and_not_by_a_sheet_of_new_robot(sheet):
    with port_of(HeldRobot()) as port:
        with pytest.warns(UserWarning, match=r"^The robot 'held' was never tried by `twbal check-link`.*\.$"):
            twbal.connect(port, sheet, PLACED).close()
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            twbal.connect(port, sheet, PLACED, heed_check=False).close()
        sheet.write_text(f"# mine, by `twbal new-robot`. Each comment is the unit.\n{sheet.read_text()}")
        with pytest.raises(CheckError, match="it was never tried by `twbal check-link`, and the sheet 'mine' is that"):
            twbal.connect(port, sheet, PLACED)


def test_what_is_an_argument_is_no_override():
    with pytest.raises(ConfigError, match=r"Give heed_check=\.\.\. to the function"):
        twbal.connect("/dev/ttyUSB0", overrides=["heed_check=false"])


def test_a_policy_on_board_is_not_driven_by_the_library():
    with pytest.raises(ConfigError, match="drives by whatever policy the board holds"):
        twbal.connect("/dev/null", overrides=["link.on_board=true"], heed_check=False)
