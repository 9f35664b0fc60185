"""The chart of what policies survive shows the shares that it is given."""

import numpy as np
import pytest
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from twbal.algorithm.robustness import AxisLevels, Cell, MethodRobustness, PolicyRobustness, Robustness
from twbal.viz.canvas import svg
from twbal.viz.robustness_figure import robustness_figure
from twbal.viz.robustness_page import robustness_page, table_rows


def cell(level, succeeded):
    return Cell(level, 10, succeeded, min(succeeded + 2, 10), 10, 10, succeeded)


@pytest.fixture
def robustness():
    axes = (AxisLevels("delay", "s", (0.01, 0.02)), AxisLevels("pushes", "N·s for 10 kg", (5.0, 10.0, 15.0)))
    methods = []
    for name, delay, pushes in (("one", (8, 2), (10, 5, 0)), ("other", (10, 10), (3, 2, 1))):
        cells = {
            axis.name: tuple(map(cell, axis.levels, counts)) for axis, counts in zip(axes, (delay, pushes), strict=True)
        }
        methods.append(MethodRobustness(name, (PolicyRobustness("paper", 880, cell(0.0, 10), cells),)))
    return Robustness(0, 10, axes, tuple(methods))


def test_each_axis_has_a_line_a_method_from_the_unchanged_robot_on(robustness):
    figure = robustness_figure(robustness)
    delay, pushes, _ = figure.axes
    assert [tuple(line.get_ydata()) for line in delay.lines] == [(1.0, 0.8, 0.2), (1.0, 1.0, 1.0)]
    assert [tuple(line.get_ydata()) for line in pushes.lines] == [(1.0, 1.0, 0.5, 0.0), (1.0, 0.3, 0.2, 0.1)]
    assert [tick.get_text() for tick in pushes.get_xticklabels()] == ["0", "5", "10", "15"]
    assert pushes.get_xlabel() == "pushes [N·s for 10 kg]"


def test_lines_of_the_same_share_do_not_lie_on_each_other(robustness):
    first, second = robustness_figure(robustness).axes[0].lines
    assert np.min(np.abs(np.subtract(first.get_xdata(), second.get_xdata()))) > 0.01


def test_bars_are_means_over_levels_and_pale_ones_what_stayed_upright(robustness):
    bars = [[bar.get_height() for bar in group] for group in robustness_figure(robustness).axes[-1].containers]
    upright, means = bars[0], bars[1]  # of the first method: delay, pushes, overall
    assert means == pytest.approx([0.5, 0.5, 0.5])
    assert upright == pytest.approx([(1.0 + 0.4) / 2, (1.0 + 0.7 + 0.2) / 3, 0.5 * (0.7 + 1.9 / 3)])


def test_the_same_shares_are_the_same_bytes(robustness):
    assert svg(robustness_figure(robustness)) == svg(robustness_figure(robustness))


def test_methods_beyond_the_colours_look_different(robustness):
    methods = tuple(robustness.methods[0]._replace(name=f"m{k}") for k in range(10))
    lines = robustness_figure(robustness._replace(methods=methods)).axes[0].lines
    assert len({(line.get_color(), line.get_marker(), line.get_linestyle()) for line in lines}) == 10


def six(robustness):
    """The methods of docs/robustness.md: all with the same shares."""
    return robustness._replace(methods=tuple(robustness.methods[0]._replace(name=f"m{k}") for k in range(6)))


def test_points_of_six_methods_with_the_same_shares_are_seen_beside_each_other(robustness):
    figure = robustness_figure(six(robustness))
    figure.draw_without_rendering()
    panel = figure.axes[1]
    across = np.array([panel.transData.transform(line.get_xydata())[:, 0] for line in panel.lines])
    size = panel.lines[0].get_markersize() * figure.dpi / 72
    assert np.diff(across, axis=0).min() > size
    assert np.min(across[0, 1:] - across[-1, :-1]) > size  # and those of a level apart from those of the next


def test_six_methods_have_six_colours(robustness):
    panel = robustness_figure(six(robustness)).axes[0]
    assert len({line.get_color() for line in panel.lines}) == 6


def test_the_legend_shows_line_and_bar_of_each_method_hatched_where_the_bar_is(robustness):
    methods = tuple(robustness.methods[0]._replace(name=f"_{k}") for k in range(9))
    (placed,) = (figure := robustness_figure(robustness._replace(methods=methods))).legends
    assert [text.get_text() for text in placed.get_texts()] == [method.name for method in methods]
    figure.draw_without_rendering()
    hatched = [patch.get_hatch() is not None for patch in placed.findobj(Rectangle) if patch.get_width() > 0.0]
    assert hatched.count(True) == 2
    assert len(hatched) == 9
    assert len([line for line in placed.findobj(Line2D) if line.get_marker() != "None"]) >= 9


def test_long_names_of_methods_stay_inside_the_figure(robustness):
    methods = tuple(robustness.methods[0]._replace(name=f"outputs/learn/a rather long name {k}") for k in range(6))
    figure = robustness_figure(robustness._replace(methods=methods))
    figure.draw_without_rendering()
    extent = figure.legends[0].get_window_extent()
    assert figure.bbox.x0 < extent.x0 < extent.x1 < figure.bbox.x1


def test_the_table_has_each_mean_and_the_page_says_what_was_missed(robustness):
    head, one, _ = table_rows(robustness)
    shown = dict(zip(head, (cell.replace("\u00a0", " ") for cell in one), strict=True))
    assert shown["unchanged"] == "100 %"
    assert shown["delay"] == shown["pushes"] == shown["overall"] == shown["worst robot"] == "50 %"
    assert shown["overall, upright"] == "67 %"
    page = robustness_page(robustness, svg(robustness_figure(robustness)))
    assert "0.01, 0.02 [s]" in page
    assert "paper 880" in page
    assert "WARNING" not in page
