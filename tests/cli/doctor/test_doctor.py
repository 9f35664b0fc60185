"""`twbal doctor` prints a line for each thing, and its exit code says whether one is a problem."""

import os
import pty

import pytest

from twbal.cli.main import main

pytestmark = pytest.mark.usefixtures("as_from_a_shell")
QUICK = "timing=0.05"


def test_it_works_without_a_robot_and_writes_nothing(capsys, tmp_path):
    assert main(["doctor", QUICK]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert {line.split()[0] for line in lines} <= {"ok", "warning", "skipped"}
    for name in ("python", "packages", "compiled kernels", "serial port", "real-time priority", "clock", "lateness"):
        assert sum(line[9:].startswith(f"{name} ") for line in lines) == 1, name
    assert not list(tmp_path.iterdir())


def test_a_missing_port_is_a_problem_by_exit_code_and_name(capsys, tmp_path):
    assert main(["doctor", QUICK, "link=serial", f"link.port={tmp_path}/none"]) == 1
    said = capsys.readouterr()
    assert f"problem  serial port         {tmp_path}/none: No such file or directory" in said.out
    assert "twbal: error: This computer is not ready to drive a robot: serial port." in said.err


def test_a_slow_adapter_is_a_warning_alone(capsys, tmp_path):
    host, robot = pty.openpty()
    folder = tmp_path / "bus" / "usb-serial" / "devices" / os.path.basename(os.ttyname(robot))
    folder.mkdir(parents=True)
    (folder / "latency_timer").write_text("16\n")
    try:
        code = main(["doctor", QUICK, "link=serial", f"link.port={os.ttyname(robot)}", f"sysfs={tmp_path}"])
    finally:
        os.close(host)
        os.close(robot)
    assert code == 0
    assert "warning  USB latency" in capsys.readouterr().out
