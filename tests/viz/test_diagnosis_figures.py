"""The pictures of a diagnosis show its numbers."""

from itertools import pairwise

import numpy as np
import pytest

from twbal.diagnosis.record import Gap, Region, Rival, Whiteness
from twbal.diagnosis.where import AXES
from twbal.viz.canvas import svg
from twbal.viz.diagnosis_figures import disagreement_figure, gap_figure, rivals_figure, whiteness_figure

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
    assert [tick.get_text() for tick in panel.get_yticklabels()] == ["a", "b", "c", "data sheet refitted alone"]
    heights = [bar.get_y() for bar in panel.patches]
    assert heights == sorted(heights, reverse=True)
    assert texts(panel) == ["best (100%)", "1 (50%)", "2 (25%)", "100 (0%)"]


def test_rivals_that_explain_nearly_as_well_are_told_apart_by_what_they_fall_short_of_the_best():
    rivals = [Rival((name,), 10754.0 - short, 0.1, 1.0) for name, short in {"a": 0.0, "b": 5.0, "c": 700.0}.items()]
    (panel,) = rivals_figure([*rivals, Rival((), 0.0, 0.0, 9.0)], most=10).axes
    assert [bar.get_width() for bar in panel.patches] == [0.0, 5.0, 700.0, 10754.0]
    assert [text.split(" ")[0] for text in texts(panel)] == ["best", "5", "700", "10754"]
    ends = [panel.transData.transform((bar.get_width(), 0.0))[0] for bar in panel.patches]
    width = panel.get_window_extent().width
    assert all(later - sooner > 0.05 * width for sooner, later in pairwise(ends))


def test_figures_that_a_page_scales_to_its_width_keep_fonts_of_about_one_size():
    gaps = [Gap(channel, 0.1, 0.01, 0.008, 0.002, 0.001, 0.9, 0.001) for channel in ("tilt", "tilt_rate")]
    units = {"tilt": "rad", "tilt_rate": "rad/s"}
    figures = [
        rivals_figure([Rival(("a",), 1.0, 1.0, 1.0)], most=3),
        whiteness_figure([Whiteness("tilt", 20.0, 1.2)], "with what was named"),
        gap_figure(gaps, units, "with what was named"),
        disagreement_figure([Region("tilt", axis, -1.0, 0.0, 50, 0.2, 1.1) for axis in AXES], CHANNELS),
    ]
    widths = [figure.get_figwidth() for figure in figures]
    assert max(widths) < 1.3 * min(widths)


def test_gaps_are_drawn_in_degrees_over_milliseconds():
    gaps = [Gap("tilt", h, 0.1 * h, 0.08 * h, 0.02 * h, 0.01 * h, 0.9, 0.01 * h) for h in (0.1, 0.2)]
    (panel,) = gap_figure(gaps, {"tilt": "rad"}, "with what was named").axes
    before, refitted, after, floor = panel.lines
    np.testing.assert_allclose(before.get_xdata(), [100.0, 200.0])
    np.testing.assert_allclose(before.get_ydata(), np.degrees([0.01, 0.02]))
    np.testing.assert_allclose(after.get_ydata(), np.degrees([0.002, 0.004]))
    assert refitted.get_ydata()[1] == pytest.approx(np.degrees(0.016))
    assert floor.get_ydata()[1] == pytest.approx(np.degrees(0.002))
    assert "°" in panel.get_ylabel()


def test_the_floor_is_drawn_where_it_is_and_nothing_is_drawn_twice():
    """Noise alone may leave more than the rollouts do, and without effects these are those of the refit."""
    gaps = [Gap("tilt", h, 0.1 * h, 0.02 * h, 0.02 * h, 0.02 * h, 1.0, 0.03 * h) for h in (0.1, 0.2)]
    (panel,) = gap_figure(gaps, {"tilt": "rad"}, None).axes
    assert [line.get_label() for line in panel.lines] == ["data sheet", "data sheet refitted", "sensor noise alone"]
    assert panel.lines[-1].get_ydata()[1] == pytest.approx(np.degrees(0.006))


def test_whiteness_stands_before_beside_after():
    (panel,) = whiteness_figure([Whiteness("tilt", 20.0, 1.2), Whiteness("tilt_rate", 8.0, 1.1)], None).axes
    assert [bar.get_height() for bar in panel.patches] == [20.0, 8.0, 1.2, 1.1]
    assert panel.get_yscale() == "log"


def test_the_same_diagnosis_gives_the_same_picture():
    assert svg(disagreement_figure(REGIONS, CHANNELS)) == svg(disagreement_figure(REGIONS, CHANNELS))
