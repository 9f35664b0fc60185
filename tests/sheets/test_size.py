"""Which inertias of a wheel are believed."""

import pytest

from twbal.sheets.questions import QUESTIONS
from twbal.sheets.size import believed_range

QUESTION = QUESTIONS["wheel_inertia"]
KNOWN = {"body_mass": 1.09, "wheel_mass": 0.05, "wheel_radius": 0.04}


@pytest.mark.parametrize(("inertia", "believed"), [(4e-5, True), (9e-4, True), (0.73, False), (0.1, False)])
def test_a_wheel_is_not_harder_to_turn_than_the_whole_robot_is_heavy(inertia, believed):
    known = believed_range(QUESTION, KNOWN)
    assert (known.low <= inertia <= known.high) is believed


def test_without_masses_the_range_is_that_of_all_robots():
    assert believed_range(QUESTION, {}).high == QUESTION.high
