"""The histogram of round trips counts every answer, on an axis of plain milliseconds."""

import numpy as np

from twbal.viz.canvas import svg
from twbal.viz.round_trip_figure import round_trip_figure


def test_every_answer_is_counted_beside_the_control_period():
    times = np.geomspace(2e-5, 0.05, 200)
    (panel,) = round_trip_figure(times.tolist(), 0.02, "mine").axes
    assert sum(bar.get_height() for bar in panel.patches) == 200
    assert panel.lines[0].get_xdata()[0] == 20.0
    assert [text.get_text() for text in panel.get_xticklabels()] == ["0.1", "1", "10"]


def test_a_name_with_dollar_signs_is_written_as_it_is():
    assert r"robot bot $\foo$</text>" in svg(round_trip_figure([0.001, 0.002], 0.01, r"bot $\foo$"))
