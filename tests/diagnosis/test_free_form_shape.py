"""What is said of a curve is what it is."""

import numpy as np
import pytest

from twbal.diagnosis.free_form_shape import shape_of

GRID = np.linspace(-2.0, 2.0, 61)


def said(function, grid=GRID, is_periodic=False):
    return shape_of(grid, function(grid), is_periodic)


@pytest.mark.parametrize(("power", "written"), [(2, "2"), (3, "3")])
def test_an_odd_power_falls_throughout_and_has_its_power(power, written):
    text = said(lambda z: -np.sign(z) * np.abs(z) ** power)
    assert text.startswith("it falls throughout")
    assert "opposite sign on either side of zero" in text
    assert f"about as the power {written} " in text


def test_an_even_function_is_alike_on_either_side_and_has_its_turn():
    text = said(lambda z: z**2)
    assert "lowest at" in text
    assert "alike on either side of zero" in text
    assert "the power 2 " in text


def test_a_step_at_zero_has_one_size_on_each_side_and_no_power():
    assert "opposite sign on either side of zero, of one size on each" in said(lambda z: -np.tanh(20.0 * z))


def test_a_line_is_a_line_and_has_no_power():
    assert said(lambda z: 0.3 * z) == "it rises throughout, nearly along a straight line"


def test_what_begins_at_a_place_is_flat_before():
    text = said(lambda z: -np.clip(z - 0.5, 0.0, None))
    assert "it falls throughout" in text
    assert "nearly flat from -2 to 0.4" in text or "nearly flat from -2 to 0.5" in text


def test_no_symmetry_is_claimed_where_one_side_has_no_data():
    assert "zero" not in said(lambda z: z**3, grid=np.linspace(-0.2, 2.0, 61))


def test_waves_in_a_turn_are_counted():
    turn = np.linspace(0.0, 2.0 * np.pi, 61)
    assert said(lambda z: np.sin(3.0 * z + 1.0), turn, True) == "3 waves in a turn, which hold 100% of its variation"
