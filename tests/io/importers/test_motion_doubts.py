"""What a log whose accelerations hardly follow the command is said to be."""

import numpy as np
import pytest

from twbal.core.block_regression import Regression
from twbal.io.importers.checks.doubt import DoubtKind, LogPart
from twbal.io.importers.checks.mechanics import Mechanics, expected
from twbal.io.importers.checks.motion_doubts import motion_doubts

COUNT = 50


def regressed(*coefficients_and_widths, explained=0.9):
    coefficients, widths = np.array(coefficients_and_widths).T
    return Regression(coefficients, widths, 0.5 * widths, explained, np.zeros(COUNT))


def doubts(robot, share, half):
    """Where body and wheels answer the command by a share of what the sheet says, known to ± half of it."""
    sheet, wave = expected(robot), np.sin(np.arange(COUNT))
    found = Mechanics(
        length=0.3,
        motion=regressed((sheet.gravity, 0.1 * sheet.gravity), (-sheet.coupling, 0.1 * sheet.coupling)),
        body=regressed((-share * sheet.turned, half * sheet.turned)),
        wheels=regressed((share * sheet.driven, half * sheet.driven)),
        torque=wave,
        tilt_acceleration=wave,
        wheel_acceleration=wave,
        lag=(0.0, 0.1),
    )
    return list(motion_doubts(LogPart(0.02, {}, wave[1:], {}, False, False, robot), found, ()))


def test_a_command_whose_effect_is_lost_in_friction_is_not_said_to_have_another_unit(paper):
    (doubt,) = doubts(paper, 0.002, 0.015)
    assert doubt.kind is DoubtKind.COLUMN
    assert "friction or back-EMF takes nearly all of it" in doubt.sentence


def test_a_weak_effect_that_is_sure_has_another_unit(paper):
    (doubt,) = doubts(paper, 0.001, 0.0003)
    assert doubt.kind is DoubtKind.UNIT
    assert "0.001 times as strongly" in doubt.sentence
    assert "mNm" in doubt.sentence


@pytest.mark.parametrize("share", [0.5, 1.0, 2.0])
def test_an_effect_near_that_of_the_sheet_is_no_doubt(paper, share):
    assert doubts(paper, share, 0.1) == []
