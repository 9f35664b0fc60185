"""Rows are lost of the recording of a linear system, of which every value and every command is known."""

import numpy as np
import pytest

from twbal.core.lost_rows import refilled

PERIODS = 800
A = np.array([[1.02, 0.02, 0.0], [0.9, 1.01, 0.0], [-0.3, 0.0, 0.98]])
B = np.array([-0.002, -0.2, 0.5])
NOISE = np.array([5e-4, 0.01, 0.02])


def recorded(late=0, seed=1, share=0.02, periods=PERIODS):
    """Under a regulator that is shaken; values are measured with noise, and a command may act some periods late."""
    rng = np.random.default_rng(seed)
    x, values, commands = np.zeros(3), np.zeros((periods + 1, 3)), np.zeros(periods)
    for n in range(periods):
        values[n] = x + NOISE * rng.standard_normal(3)
        commands[n] = 9.0 * x[0] + 1.0 * x[1] + 0.02 * x[2] + 0.3 * rng.standard_normal()
        x = A @ x + B * (commands[n - late] if n >= late else 0.0)
    values[periods] = x + NOISE * rng.standard_normal(3)
    lost = rng.uniform(size=periods + 1) < share
    lost[[0, -1]] = False
    return values, commands, ~lost


def lossy(values, commands, measured):
    """What is left where rows are lost: a straight line, and the command before."""
    numbers = np.flatnonzero(measured)
    lines = np.column_stack([np.interp(np.arange(len(values)), numbers, column[measured]) for column in values.T])
    return lines, np.repeat(commands[numbers[:-1]], np.diff(numbers))


def of_single_rows(measured):
    lost = np.flatnonzero(~measured)
    return np.array(
        [n for n in lost if 6 < n < PERIODS - 6 and measured[n - 4 : n].all() and measured[n + 1 : n + 5].all()]
    )


@pytest.mark.parametrize("late", [0, 1, 2])
def test_a_lost_row_is_what_the_rows_around_it_make_likeliest(late):
    values, commands, measured = recorded(late)
    lines, held = lossy(values, commands, measured)
    filled, given = refilled(lines, held, measured)
    rows = of_single_rows(measured)
    assert len(rows) > 8
    off = [np.sqrt(np.mean((each - values)[rows] ** 2, axis=0)) for each in (lines, filled)]
    assert (off[1] < np.maximum(0.5 * off[0], 2.5 * NOISE)).all()
    missed, still = (np.std((each - commands)[rows]) for each in (held, given))
    assert still < 0.35 * missed
    kept = measured.copy()
    np.testing.assert_array_equal(filled[kept], values[kept])
    np.testing.assert_array_equal(given[kept[:-1]], commands[kept[:-1]])


def test_a_channel_that_no_regression_explains_keeps_its_straight_line():
    values, commands, measured = recorded()
    smooth = np.sin(0.02 * np.arange(PERIODS + 1))
    values = np.column_stack([values, smooth])
    lines, held = lossy(values, commands, measured)
    filled, _ = refilled(lines, held, measured)
    assert np.abs(filled[:, 3] - smooth).max() < 3e-4


def test_a_channel_that_never_moves_tells_nothing_and_disturbs_nothing():
    values, commands, measured = recorded()
    lines, held = lossy(values, commands, measured)
    still = np.column_stack([lines, np.full(len(lines), 3.0)])
    _, alone = refilled(lines, held, measured)
    filled, beside = refilled(still, held, measured)
    np.testing.assert_allclose(filled[:, 3], 3.0, atol=1e-9)
    np.testing.assert_allclose(beside, alone, atol=1e-6)


def test_rows_that_were_lost_side_by_side_are_left_as_they_are():
    values, commands, measured = recorded(share=0.0)
    measured[[300, 301, 500]] = False
    lines, held = lossy(values, commands, measured)
    filled, given = refilled(lines, held, measured)
    np.testing.assert_array_equal(filled[300:302], lines[300:302])
    np.testing.assert_array_equal(given[300:302], held[300:302])
    assert given[500] != held[500]


def test_short_recordings_and_whole_ones_are_left_as_they_are():
    values, commands, measured = recorded(periods=60)
    lines, held = lossy(values, commands, measured)
    for given, mask in ((lines, measured), (values, np.ones(len(values), bool))):
        filled, kept = refilled(given, held, mask)
        np.testing.assert_array_equal(filled, given)
        np.testing.assert_array_equal(kept, held)


def test_a_command_that_nothing_shows_is_the_one_before():
    values, commands, measured = recorded()
    lines, held = lossy(np.random.default_rng(2).standard_normal(values.shape), commands, measured)
    _, given = refilled(lines, held, measured)
    rows = of_single_rows(measured)
    assert np.std((given - held)[rows]) < 0.5 * np.std(np.diff(commands))
