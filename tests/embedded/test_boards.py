"""Estimates of what a policy takes on a board."""

import pytest
from some_policies import POLICIES, exported

from twbal.embedded.boards import BOARDS, need_on

# Cycles of one call of `twbal_policy_step`, compiled by avr-gcc 5.4 -Os and run in simavr 1.6, of these policies.
SIMULATED = {"searched": 144_448}


def need(name, robot, board):
    made = exported(POLICIES[name], robot)
    return need_on(board, made.policy, len(made.channels.lags), made.control_period)


@pytest.mark.parametrize("board", BOARDS, ids=lambda board: board.name)
def test_what_has_more_parameters_takes_more(board, paper):
    small, large = (need(name, paper, board) for name in ("linear", "tanh"))
    assert small.flash < large.flash
    assert small.memory < large.memory
    assert small.cycles < large.cycles


def test_the_estimate_for_the_small_board_is_near_a_simulation_of_it(paper):
    (board,) = (board for board in BOARDS if board.name == "ATmega32U4")
    assert need("searched", paper, board).cycles == pytest.approx(SIMULATED["searched"], rel=0.15)


def test_what_does_not_fit_says_what_it_takes_too_much_of(paper, regbot):
    (small,) = (board for board in BOARDS if board.name == "ATmega32U4")
    assert need("linear", paper, small).fits
    found = need("tanh", regbot, small)  # at 15 ms
    assert not found.fits
    assert "time (" in found.lacks and "of a control period of 15 ms" in found.lacks
    assert "memory" not in found.lacks
