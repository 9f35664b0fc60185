"""Ranges of the effects that may be missing, in a robot's size."""

from dataclasses import replace

import pytest

from twbal.diagnosis.effect_candidates import candidates_for


@pytest.mark.parametrize("name", ["actuation_delay", "motor_lag", "imu_delay"])
def test_times_of_a_fast_loop_may_be_as_long_as_those_of_a_usual_one(paper, name):
    """A delay of a bus or a radio does not get shorter because the loop is fast."""

    def range_at(period):
        (candidate,) = (c for c in candidates_for(replace(paper, control_period=period)) if c.name == name)
        return candidate.parameters[0]

    usual, fast, slow = (range_at(period) for period in (0.02, 0.002, 0.04))
    assert fast.high == usual.high
    assert fast.start == pytest.approx(0.1 * usual.start)
    assert slow.high == pytest.approx(2.0 * usual.high)
