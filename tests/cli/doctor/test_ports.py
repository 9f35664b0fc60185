"""Ports that are there, that are not, that are none, and that may not be used; adapters by a folder like sysfs."""

import os
import pty
import stat
from pathlib import Path

import pytest

from twbal.cli.doctor.ports import latency_check, port_check, port_checks
from twbal.core.check import CheckStatus

NOBODY = 65534


@pytest.fixture
def terminal():
    """Path of a pseudo-terminal: a device, as a serial port is."""
    host, robot = pty.openpty()
    yield os.ttyname(robot)
    os.close(host)
    os.close(robot)


@pytest.fixture
def sysfs(tmp_path):
    """Makes a folder that is like /sys, in which the adapter of a device has a latency timer."""

    def make(device, text):
        folder = tmp_path / "bus" / "usb-serial" / "devices" / device
        folder.mkdir(parents=True)
        (folder / "latency_timer").write_text(text)
        return tmp_path

    return make


def as_user(number, body):
    """What `body` returns, as text, in a process of another user without groups."""
    reader, writer = os.pipe()
    child = os.fork()
    if not child:
        os.setgroups([])
        os.setresgid(number, number, number)
        os.setresuid(number, number, number)
        os.write(writer, body().encode())
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader) as said:
        text = said.read()
    os.waitpid(child, 0)
    return text


def test_a_pseudo_terminal_is_a_port_that_may_be_used_and_has_no_timer(terminal, tmp_path):
    found = port_checks(terminal, tmp_path)
    assert [check.verdict for check in found] == [CheckStatus.OK, CheckStatus.OK]
    assert "no latency timer" in found[1].found


def test_a_port_that_is_not_there_is_a_problem_and_the_adapter_is_not_looked_at(tmp_path):
    (check,) = port_checks(str(tmp_path / "ttyUSB7"), tmp_path)
    assert check.verdict is CheckStatus.PROBLEM
    assert "ttyUSB7: No such file or directory" in check.found
    assert "ports that are there" in check.advice


def test_a_file_and_a_folder_are_no_ports(tmp_path):
    (tmp_path / "file").touch()
    for path in (tmp_path / "file", tmp_path):
        check = port_check(path, Path("/sys"))
        assert (check.verdict, check.found) == (CheckStatus.PROBLEM, f"{path} is no serial device")


@pytest.mark.skipif(not Path("/sys/dev/char").is_dir(), reason="this system does not tell of its devices")
def test_a_device_that_is_no_terminal_is_no_port(terminal):
    check = port_check(Path("/dev/null"), Path("/sys"))
    assert (check.verdict, check.found) == (CheckStatus.PROBLEM, "/dev/null is no serial device")
    assert port_check(Path(terminal), Path("/sys")).verdict is CheckStatus.OK


@pytest.mark.skipif(os.geteuid() != 0, reason="only root may become another user")
@pytest.mark.parametrize(
    ("mode", "advice"), [(0o660, "sudo usermod -a -G dialout"), (0o600, "Its group may not use it either")]
)
def test_a_port_of_others_says_how_to_be_let_at_it(terminal, mode, advice):
    groups = [line.split(":") for line in Path("/etc/group").read_text().splitlines()]
    number = next((int(number) for name, _, number, *_ in groups if name == "dialout"), None)
    if number is None:
        pytest.skip("this system has no group dialout")
    os.chown(terminal, 0, number)
    os.chmod(terminal, mode)
    said = as_user(NOBODY, lambda: port_check(Path(terminal), Path("/sys")).line(12))
    assert said.startswith("problem")
    assert "may not be used by you: it is of root and group dialout" in said
    assert advice in said
    assert as_user(0, lambda: port_check(Path(terminal), Path("/sys")).verdict) == "ok"


@pytest.mark.parametrize(("text", "verdict"), [("16\n", "warning"), ("1\n", "ok"), ("4\n", "ok"), ("?", "warning")])
def test_the_adapters_timer_is_read_where_the_kernel_has_it(text, verdict, sysfs, tmp_path):
    found = latency_check(tmp_path / "ttyUSB0", sysfs("ttyUSB0", text))
    assert found.verdict == verdict
    if text == "16\n":
        assert "up to 16 ms" in found.found
        assert "setserial" in found.advice
        assert "echo 1" in found.advice


def test_a_port_by_its_other_name_has_the_same_timer(sysfs, tmp_path):
    (tmp_path / "ttyUSB3").touch()
    (tmp_path / "usb-FTDI_42").symlink_to("ttyUSB3")
    assert latency_check(tmp_path / "usb-FTDI_42", sysfs("ttyUSB3", "16")).verdict is CheckStatus.WARNING


@pytest.mark.parametrize("port", [None, "socket://robot:2000"])
def test_what_is_no_port_of_this_computer_is_skipped(port, tmp_path):
    assert [check.verdict for check in port_checks(port, tmp_path)] == [CheckStatus.SKIPPED]


def test_the_port_is_not_opened(terminal, tmp_path, monkeypatch):
    """Opening it would start many boards anew."""
    monkeypatch.setattr(os, "open", lambda *_, **__: pytest.fail("opened"))
    port_checks(terminal, tmp_path)
    assert stat.S_ISCHR(os.stat(terminal).st_mode)
