"""The curve of a free form is drawn in the units of the sentence beside it."""

import numpy as np

from twbal.diagnosis.free_form_record import FreeForm
from twbal.viz.free_form_figure import free_form_figure

FOUND = FreeForm(
    *("tilt reading", "rad", "tilt", "rad", 9.0, 0.001, 0.4, (), (), "it rises"),
    *((-0.07, 0.0, 0.09), (-0.021, 0.0, 0.029), (-0.03, -0.01, 0.02), (-0.01, 0.01, 0.04)),
)


def test_the_curve_has_the_ends_that_its_sentence_gives():
    (panel,) = free_form_figure(FOUND).axes
    (curve,) = (line for line in panel.lines if line.get_label() == "estimate")
    assert (panel.get_xlabel(), panel.get_ylabel()) == ("tilt [rad]", "added, less its mean [rad]")
    lowest, highest = np.min(curve.get_ydata()), np.max(curve.get_ydata())
    assert f"between {lowest:.2g} and {highest:.2g} rad" in FOUND.text
    first, *_, last = curve.get_xdata()
    assert f"from {first:.2g} to {last:.2g} rad" in FOUND.text
