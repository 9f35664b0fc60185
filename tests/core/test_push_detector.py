"""Pushes are told by how fast a robot's speed changes."""

import numpy as np
import pytest

from twbal.core.push_detector import AFTER_PUSH, PushDetector

PERIOD, PUSH = 0.02, 1.0


def test_a_robot_that_begins_with_a_lean_is_not_pushed() -> None:
    detector = PushDetector(PUSH)
    assert not any(detector.follow(time, 15.0 * min(time, 0.1)) for time in np.arange(0.0, 4.0, PERIOD).tolist())


def test_a_speed_that_changes_slowly_is_no_push_at_any_control_period() -> None:
    for period in (0.005, 0.03):
        slow, fast = PushDetector(PUSH), PushDetector(PUSH)
        times = np.arange(0.0, 6.0, period).tolist()
        assert not any(slow.follow(time, 2.0 * np.sin(4.0 * time)) for time in times)
        found = [time for time in times if fast.follow(time, 0.0 if time < 3.0 else 1.2)]
        assert found[0] == pytest.approx(3.0, abs=period) and found[-1] == pytest.approx(
            3.0 + AFTER_PUSH, abs=2.0 * period
        )


def test_tyres_that_slip_after_a_push_are_no_further_push() -> None:
    detector, found = PushDetector(PUSH), []
    for time in np.arange(0.0, 5.5, PERIOD).tolist():
        found.append(detector.follow(time, 2.0 * np.sin(50.0 * time) if time > 3.0 else 0.0))
    assert PERIOD * sum(found) == pytest.approx(2 * AFTER_PUSH, abs=0.05)  # at 3 s, and again 2 s later
