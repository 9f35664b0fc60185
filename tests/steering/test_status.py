import os
import pty
import time

import pytest

from twbal.core.heading import HeadingSample
from twbal.core.motion_profile import Motion
from twbal.core.plant import Observation
from twbal.steering.limits import SteeringLimits
from twbal.steering.pace import Pace
from twbal.steering.request import SteeringRequest
from twbal.steering.status import Display, StatusLine
from twbal.steering.steered import Moment

RADIUS = 0.15


@pytest.fixture
def limits(paper):
    return SteeringLimits.from_settings(paper, 0.1, 0.5, 0.5, False, 2.0, speed_limit=1.0, yaw_rate_limit=1.0)


def moment(time, angle=0.0, heading=None):
    seen = Observation(time, 0.05, 0.0, 0.0, angle, 2.0, 0.0)
    return Moment(seen, SteeringRequest(0.4, -0.5), Motion(1.0, 0.25, 0.0), heading, 1.5)


def test_a_line_has_what_is_asked_the_reference_and_the_robot(limits):
    written, clock = [], iter([0.0, 1.0])
    line = StatusLine(limits, RADIUS, written.append, lambda: next(clock))
    line.show(moment(0.0, 0.0, HeadingSample(0.0, 0.0, 0.5, 0.0, 0.0)))
    line.show(moment(3.0, 10.0, HeadingSample(0.0, 0.0, 0.5, 0.0, 0.0)))
    for part in ("3.0 s", "asked +0.40 m/s turn  -29°/s", "reference +0.25", "robot +0.30", "place +1.50 m"):
        assert part in written[1]
    assert "heading   +29°" in written[1] and "tilt +2.9°" in written[1]


def test_lines_come_five_times_a_second(limits):
    written, clock = [], iter(0.02 * n for n in range(1000))
    line = StatusLine(limits, RADIUS, written.append, lambda: next(clock))
    for step in range(500):
        line.show(moment(0.02 * step))
    assert len(written) == pytest.approx(10.0 * 5, abs=5)


def test_a_terminal_that_nobody_reads_holds_nobody_up(monkeypatch):
    person, program = pty.openpty()
    with open(program, "w") as shown:
        monkeypatch.setattr("sys.stdout", shown)
        display, began = Display(), time.monotonic()
        for _ in range(2000):
            display.write("\r" + 200 * "x" + "\x1b[K")
        display.close()
        assert time.monotonic() - began < 5.0
    os.close(person)


def test_without_a_terminal_nothing_is_shown(monkeypatch, tmp_path):
    with open(tmp_path / "out", "w") as out:
        monkeypatch.setattr("sys.stdout", out)
        display = Display()
        display.write("line")
        display.close()
    assert (tmp_path / "out").read_text() == ""


@pytest.mark.parametrize("rate", [1.0, 0.5, 4.0])
def test_the_drives_time_goes_at_its_rate_and_lateness_is_not_caught_up_with(rate):
    clock = [100.0]
    pace = Pace(rate, lambda: clock[0], lambda seconds: clock.__setitem__(0, clock[0] + seconds))
    for step in range(51):
        pace.wait(0.02 * step)
    assert clock[0] == pytest.approx(100.0 + 1.0 / rate)
    clock[0] += 5.0  # the program was held up
    pace.wait(1.02)
    late = clock[0]
    pace.wait(1.02 + 0.2)
    assert clock[0] == pytest.approx(late + 0.2 / rate)
