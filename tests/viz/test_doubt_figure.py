"""The title of a picture of a doubt: within the picture, whether it has one panel or two."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from twbal.io.importers.checks.doubt import Curves
from twbal.viz.doubt_figure import doubt_figure

SENTENCE = (
    "the tilt takes the gyro in a row (10 ms) late: is its column shifted, or is it a value of the loop before, as "
    "where a program sends what it measured a period ago?"
)


@pytest.mark.parametrize("has_expected", [False, True])
def test_the_sentence_is_not_cut_off(has_expected):
    course = np.sin(np.arange(300.0))
    evidence = Curves(0.02, course, "tilt [rad]", *((1.1 * course, "of the gyro [rad]") if has_expected else ()))
    figure = doubt_figure(SENTENCE, evidence)
    FigureCanvasAgg(figure).draw()
    (title,) = [text for text in figure.texts if "late" in text.get_text()]
    box = title.get_window_extent()
    assert box.x0 >= 0.0 and box.x1 <= figure.bbox.width


def test_curves_have_their_name_at_their_axis_and_two_have_a_legend():
    course = np.sin(np.arange(300.0))
    alone = doubt_figure(SENTENCE, Curves(0.02, course, "tilt [rad]"))
    assert alone.axes[0].get_ylabel() == "tilt [rad]" and not alone.legends
    both = doubt_figure(SENTENCE, Curves(0.02, course, "tilt [rad]", 1.1 * course, "of the gyro [rad]"))
    assert both.axes[0].get_ylabel() == "tilt [rad]" and both.legends
