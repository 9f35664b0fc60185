"""Runs beside each other: dots where the values are, and nowhere on the numbers of an axis what has none."""

import math
from itertools import pairwise

import numpy as np
import pytest
from markupsafe import Markup

from twbal.algorithm.comparison import METRICS, Run
from twbal.core.palette import MUTED, PREDICTED, REAL
from twbal.viz.comparison_figure import comparison_figure
from twbal.viz.page import render
from twbal.viz.short_names import short_names


def runs(**values):
    """Runs of which some metrics differ, a value each."""
    count = len(next(iter(values.values())))
    plain = dict.fromkeys(METRICS, 0.5)
    return [Run((str(k),), plain | {name: each[k] for name, each in values.items()}) for k in range(count)]


def drawn(groups, metric):
    figure = comparison_figure(groups)
    figure.draw_without_rendering()
    return figure.axes[list(METRICS).index(metric)]


def heights(panel, colour, marker):
    lines = [line for line in panel.lines if line.get_color() == colour and line.get_marker() == marker]
    return np.concatenate([np.asarray(line.get_ydata(), dtype=float) for line in lines])


def numbers(panel):
    ticks = zip(panel.get_yticks(), panel.get_yticklabels(), strict=True)
    return [tick for tick, name in ticks if name.get_text() != "never"]


@pytest.mark.parametrize("seconds", [(6.0, 10.0, math.inf, math.inf), (math.inf,) * 3])
def test_runs_that_never_got_there_stand_above_all_numbers_of_the_axis(seconds):
    panel = drawn({"all": runs(seconds=seconds)}, "seconds")
    never = heights(panel, MUTED.light, "x")
    finite = [value for value in seconds if math.isfinite(value)]
    assert len(never) == len(seconds) - len(finite)
    assert all(value > max([*numbers(panel), *finite], default=0.0) for value in never)
    assert panel.get_yticklabels()[-1].get_text() == "never" and panel.get_yticks()[-1] == never[0]
    assert (len(numbers(panel)) > 0) == bool(finite)
    assert heights(panel, PREDICTED.light, "None").max() == never[0]  # the median of these is infinite


@pytest.mark.parametrize("metric", ["success", "coverage", "upright"])
def test_the_axis_of_a_share_ends_at_0_and_1_and_cuts_no_dot(metric):
    panel = drawn({"all": runs(**{metric: (0.0, 0.2, 1.0)}), "other": runs(**{metric: (0.1, 0.2)})}, metric)
    low, high = panel.get_ylim()
    assert -0.1 < low < -0.02 and 1.02 < high < 1.1
    assert (min(numbers(panel)), max(numbers(panel))) == (0.0, 1.0)


def test_dots_are_where_the_values_are():
    panel = drawn({"all": runs(cost=(0.0, 20.0, math.nan))}, "cost")
    assert sorted(heights(panel, REAL.light, "o")) == [0.0, 20.0]
    assert panel.get_ylim()[0] < 0.0 and min(numbers(panel)) == 0.0


@pytest.mark.parametrize("names", ["a b", "paper default", "default pilco paper lqr lqr_integral lqr_identified"])
def test_names_of_groups_stand_apart(names):
    panel = drawn({name: runs(cost=(1.0,)) for name in names.split()}, "cost")
    boxes = [text.get_window_extent() for text in panel.get_xticklabels()]
    turned = {text.get_rotation() for text in panel.get_xticklabels()}
    assert turned == {45.0} or all(left.x1 < right.x0 for left, right in pairwise(boxes))


def test_long_names_take_no_room_from_the_panels():
    few, many = (drawn({name * k: runs(cost=(1.0,)) for name in "abc"}, "cost") for k in (1, 14))
    assert few.get_window_extent().height < 1.1 * many.get_window_extent().height


LONG = [f"2026-12-0{k}_14-22-33-123456" for k in range(1, 7)]


def test_long_names_are_short_below_the_panels_and_told_apart():
    panel = drawn({name: runs(cost=(1.0,)) for name in LONG}, "cost")
    names = [text.get_text() for text in panel.get_xticklabels()]
    assert names[0].startswith("…01_14-22")
    assert len(set(names)) == 6 and max(map(len, names)) <= 18
    assert panel.get_window_extent().width > 0.6 * panel.figure.bbox.width / 3


def test_the_page_has_a_key_of_short_names_and_scrolls_what_is_wide():
    def page(*names):
        told = {"rows": [], "names": [], "doubts": [], "picture": Markup("<svg/>")}
        return render("comparison.html.jinja", groups=dict.fromkeys(names), **told)

    html = page(*LONG, "lqr")
    for name, short in short_names([*LONG, "lqr"]).items():
        assert (f"<tr><th>{short}</th><td>{name}</td></tr>" in html) == (name != "lqr")
    assert '<div class="wide"><svg/></div>' in html
    assert html.count("<table") == html.count('<div class="wide">\n<table') == 2
    assert "shortened" not in page("lqr", "paper")


def test_a_median_hides_no_dot():
    panel = drawn({"all": runs(cost=(1.0,)), "other": runs(cost=(1.0, 1.0, 1.0))}, "cost")
    dots = [line for line in panel.lines if line.get_marker() == "o"]
    medians = [line for line in panel.lines if line.get_color() == PREDICTED.light]
    assert len(dots) == len(medians) == 2
    assert min(line.get_zorder() for line in dots) > max(line.get_zorder() for line in medians)


def test_a_panel_without_a_value_says_why():
    panel = drawn({"all": runs(crps_ratio=(math.nan, math.nan))}, "crps_ratio")
    (text,) = panel.texts
    said = " ".join(text.get_text().split())
    assert said == "measured in none of these runs: takes three trials or more of a policy"
    assert list(panel.get_yticks()) == []


@pytest.mark.parametrize("last", [12.0, math.inf])
def test_the_legend_says_what_dots_lines_and_crosses_are(last):
    (placed,) = comparison_figure({"all": runs(seconds=(6.0, 10.0, last)), "other": runs(cost=(1.0, 2.0))}).legends
    told = [text.get_text() for text in placed.get_texts()]
    assert told == ["a run", "median of the runs", *["a run that never got there"] * math.isinf(last)]
