"""The pictures of a diagnosis show its numbers."""

import numpy as np
import pytest

from twbal.diagnosis import Gap, Region, Rival, Whiteness
from twbal.figures.canvas import svg
from twbal.figures.diagnosis import disagreement_figure, gap_figure, rivals_figure, whiteness_figure

CHANNELS = ("tilt", "tilt_rate")
REGIONS = [
    Region("tilt", "speed", -1.0, 0.0, 50, 0.2, 1.1),
    Region("tilt_rate", "speed", -1.0, 0.0, 50, -4.0, 7.3),
    Region("tilt_rate", "speed", 0.0, 2.0, 50, 4.0, 6.9),
    Region("tilt_rate", "direction", 0.0, 1.0, 50, 4.0, 5.5),
]


def texts(axes):
    return [text.get_text() for text in axes.texts]


def test_each_field_shows_the_error_of_its_region_at_its_place():
    speed, direction = disagreement_figure(REGIONS, CHANNELS).axes
    assert texts(speed) == ["1.1", "7.3", "6.9"]
    assert texts(direction) == ["5.5"]
    (field,) = speed.images
    shades = np.asarray(field.get_array())
    assert shades.shape == (2, 2)
    assert shades[1, 0] < -0.9 < 0.9 < shades[1, 1]
    assert np.isnan(shades[0, 1]) or np.ma.is_masked(field.get_array()[0, 1])


def test_the_best_rivals_are_drawn_from_the_top_with_their_probability():
    rivals = [Rival((), 0.0, 0.0, 9.0)] + [Rival((name,), 100.0 - i, 0.5**i, 1.0) for i, name in enumerate("abcd")]
    (panel,) = rivals_figure(rivals, most=3).axes
    assert [bar.get_width() for bar in panel.patches] == [100.0, 99.0, 98.0]
    assert [tick.get_text() for tick in panel.get_yticklabels()] == ["a", "b", "c"]
    heights = [bar.get_y() for bar in panel.patches]
    assert heights == sorted(heights, reverse=True)
    assert texts(panel) == ["100%", "50%", "25%"]


def test_gaps_are_drawn_in_degrees_over_milliseconds():
    gaps = [Gap("tilt", h, 0.1 * h, 0.08 * h, 0.02 * h, 0.01 * h, 0.9) for h in (0.1, 0.2)]
    (panel,) = gap_figure(gaps, {"tilt": "rad"}).axes
    before, refitted, after, floor = panel.lines
    np.testing.assert_allclose(before.get_xdata(), [100.0, 200.0])
    np.testing.assert_allclose(before.get_ydata(), np.degrees([0.01, 0.02]))
    np.testing.assert_allclose(after.get_ydata(), np.degrees([0.002, 0.004]))
    assert refitted.get_ydata()[1] == pytest.approx(np.degrees(0.016))
    assert floor.get_ydata()[1] == pytest.approx(np.degrees(0.002))
    assert "°" in panel.get_ylabel()


def test_whiteness_stands_before_beside_after():
    (panel,) = whiteness_figure([Whiteness("tilt", 20.0, 1.2), Whiteness("tilt_rate", 8.0, 1.1)]).axes
    assert [bar.get_height() for bar in panel.patches] == [20.0, 8.0, 1.2, 1.1]
    assert panel.get_yscale() == "log"


def test_the_same_diagnosis_gives_the_same_picture():
    assert svg(disagreement_figure(REGIONS, CHANNELS)) == svg(disagreement_figure(REGIONS, CHANNELS))
