"""The pictures of a diagnosis show its numbers."""

from itertools import pairwise

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from twbal.core.palette import PALETTE
from twbal.diagnosis.record import Gap, Region, ResidualAutocorrelation, Rival
from twbal.viz.canvas import svg
from twbal.viz.diagnosis_figures import autocorrelation_figure, disagreement_figure, gap_figure, rivals_figure
from twbal.viz.map_axes import AXES

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


def map_of(axis, edges, bias=0.0):
    """The only panel of a map with ranges between these edges, drawn."""
    ranges = pairwise(edges)
    figure = disagreement_figure([Region("wheel_angle", axis, *e, 50, bias, 10.0) for e in ranges], ("wheel_angle",))
    figure.draw_without_rendering()
    (panel,) = figure.axes
    return panel


EDGES = {
    "negative": ("speed", [-0.0475, -0.0288, -0.0163, -0.00649, 0.00464, 0.0267, 0.0663]),
    "hardly any": ("tilt", [-7.3e-9, 1.9e-8, 5.1e-8, 1.2e-7, 4.5e-7, 6.6e-7, 7.8e-7]),
    "near": ("speed", [0.252, 0.29, 0.294, 0.296, 0.299, 0.301, 0.32]),
    "close": ("command", [-0.49, -0.339, -0.0516, 0.343, 0.468, 0.489, 0.49]),
    "large": ("speed", [-1234.0, -987.0, -500.0, 0.1, 500.0, 987.0, 1234.0]),
    "many": ("time", list(np.linspace(0.0, 300.0, 61))),
}


@pytest.mark.parametrize("edges", EDGES.values(), ids=EDGES)
def test_the_ends_of_ranges_stand_apart_below_a_map(edges):
    panel = map_of(*edges)
    labels = panel.get_xticklabels()
    where = [panel.transData.transform((x, 0.0))[0] for x in panel.get_xticks()]
    room = min(later - sooner for sooner, later in pairwise(where))
    for text in labels:
        if text.get_rotation():
            text.set_rotation(0.0)
            height = text.get_window_extent().height
            assert height * np.sqrt(2.0) < room  # lines at 45 degrees
        else:
            assert text.get_window_extent().width < room - 3.0


def test_the_ends_of_ranges_are_rounded_alike_and_no_more_than_tells_them_apart():
    def said(name):
        return [text.get_text() for text in map_of(*EDGES[name]).get_xticklabels()]

    assert said("negative") == ["-0.048", "-0.029", "-0.016", "-0.006", "0.005", "0.027", "0.066"]
    assert said("hardly any") == ["0.00"] * 7
    assert said("close")[-3:] == ["0.468", "0.489", "0.490"]
    assert said("large")[:4] == ["-1234", "-987", "-500", "0"]
    assert [text.get_text() for text in map_of("tilt", [-0.1, 0.0, 0.2]).get_xticklabels()] == ["-6", "0", "11"]
    halves = map_of("time", [0.0, 2.5, 5.0, 7.5]).get_xticklabels()
    assert [text.get_text() for text in halves] == ["0.0", "2.5", "5.0", "7.5"]  # and not 0, 2, 5, 8


def test_a_range_that_was_left_out_is_an_empty_field():
    regions = [Region("tilt", "speed", *ends, 50, 0.0, 1.0) for ends in ((0.0, 1.0), (2.0, 3.0))]
    (panel,) = disagreement_figure(regions, ("tilt",)).axes
    assert [text.get_position() for text in panel.texts] == [(0, 0), (2, 0)]
    assert [text.get_text() for text in panel.get_xticklabels()] == ["0.0", "1.0", "2.0", "3.0"]


def luminance(colour):
    parts = np.array(to_rgb(colour))
    return float(np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4) @ [0.2126, 0.7152, 0.0722])


@pytest.mark.parametrize("bias", [-8.0, -2.0, -1.0, 0.0, 1.0, 2.0, 8.0])
def test_the_number_in_a_field_can_be_read_on_its_colour(bias):
    panel = map_of("speed", [0.0, 1.0], bias)
    (image,), (number,) = panel.images, panel.texts
    field = luminance(image.to_rgba(image.get_array())[0, 0, :3])
    darker, lighter = sorted([field, luminance(number.get_color())])
    assert (lighter + 0.05) / (darker + 0.05) > 3.8
    assert (luminance(number.get_color()) > 0.5) == (bias == -8.0)


def test_a_dark_page_recolours_no_number_as_it_recolours_no_field():
    figure = disagreement_figure(REGIONS, CHANNELS)
    colours = {text.get_color() for panel in figure.axes for text in panel.texts}
    assert len(colours) == 2
    assert not colours & {colour.light for colour in PALETTE}


def test_the_best_rivals_are_drawn_from_the_top_with_their_probability():
    rivals = [Rival((), 0.0, 0.0, 9.0)] + [Rival((name,), 100.0 - i, 0.5**i, 1.0) for i, name in enumerate("abcd")]
    (panel,) = rivals_figure(rivals, most=3).axes
    assert [tick.get_text() for tick in panel.get_yticklabels()] == ["a", "b", "c", "data sheet refitted alone"]
    heights = [bar.get_y() for bar in panel.patches]
    assert heights == sorted(heights, reverse=True)
    assert texts(panel) == ["lowest BIC (100%, likeliest)", "1 (50%)", "2 (25%)", "100 (0%)"]


def test_the_lowest_bic_and_the_likeliest_set_are_told_apart_and_both_drawn():
    scores = {"a": (90.0, 0.02), "b": (80.0, 0.01), "c": (50.0, 0.48), "d": (50.0, 0.48 + 1e-9), "e": (40.0, 0.0)}
    rivals = [Rival((name,), *weighed, 1.0) for name, weighed in scores.items()]
    (panel,) = rivals_figure([*rivals, Rival((), 0.0, 0.01, 9.0)], most=2).axes
    said = ["lowest BIC (2%)", "10 (1%)", "40 (48%, likeliest)", "40 (48%, likeliest)", "90 (1%)"]
    assert texts(panel) == said
    (alone,) = rivals_figure([Rival(("a",), 9.0, 0.4, 1.0), Rival((), 0.0, 0.6, 9.0)], most=2).axes
    assert texts(alone) == ["lowest BIC (40%)", "9 (60%, likeliest)"]


def test_the_rivals_say_why_the_table_of_effects_has_other_probabilities():
    figure = rivals_figure([Rival(("a",), 1.0, 1.0, 1.0)], most=3)
    assert "compare the fitted sets with each other" in figure.get_supxlabel()
    assert "objections" in figure.get_supxlabel()
    note = next(text for text in figure.texts if text.get_text() == figure.get_supxlabel())
    figure.draw_without_rendering()
    assert note.get_window_extent().width < figure.bbox.width


def test_rivals_that_explain_nearly_as_well_are_told_apart_by_what_they_fall_short_of_the_best():
    rivals = [Rival((name,), 10754.0 - short, 0.1, 1.0) for name, short in {"a": 0.0, "b": 5.0, "c": 700.0}.items()]
    (panel,) = rivals_figure([*rivals, Rival((), 0.0, 0.0, 9.0)], most=10).axes
    assert [bar.get_width() for bar in panel.patches] == [0.0, 5.0, 700.0, 10754.0]
    assert [text.split(" ")[0] for text in texts(panel)] == ["lowest", "5", "700", "10754"]
    ends = [panel.transData.transform((bar.get_width(), 0.0))[0] for bar in panel.patches]
    width = panel.get_window_extent().width
    assert all(later - sooner > 0.05 * width for sooner, later in pairwise(ends))


def test_figures_that_a_page_scales_to_its_width_keep_fonts_of_about_one_size():
    gaps = [Gap(channel, 0.1, 0.01, 0.008, 0.002, 0.001, 0.9, 0.001, -3.0) for channel in ("tilt", "tilt_rate")]
    units = {"tilt": "rad", "tilt_rate": "rad/s"}
    figures = [
        rivals_figure([Rival(("a",), 1.0, 1.0, 1.0)], most=3),
        autocorrelation_figure([ResidualAutocorrelation("tilt", 20.0, 1.2)], "with what was named"),
        gap_figure(gaps, units, "with what was named"),
        disagreement_figure([Region("tilt", axis, -1.0, 0.0, 50, 0.2, 1.1) for axis in AXES], CHANNELS),
    ]
    widths = [figure.get_figwidth() for figure in figures]
    assert max(widths) < 1.3 * min(widths)


def test_gaps_are_drawn_in_the_units_of_the_table_beside_them_over_milliseconds():
    gaps = [Gap("tilt", h, 0.1 * h, 0.08 * h, 0.02 * h, 0.01 * h, 0.9, 0.01 * h, -3.0) for h in (0.1, 0.2)]
    (panel,) = gap_figure(gaps, {"tilt": "rad"}, "with what was named").axes
    before, refitted, after, floor = panel.lines
    np.testing.assert_allclose(before.get_xdata(), [100.0, 200.0])
    np.testing.assert_allclose(before.get_ydata(), [0.01, 0.02])
    np.testing.assert_allclose(after.get_ydata(), [0.002, 0.004])
    assert refitted.get_ydata()[1] == pytest.approx(0.016)
    assert floor.get_ydata()[1] == pytest.approx(0.002)
    assert panel.get_ylabel() == "error of tilt [rad]"
    assert panel.get_yscale() == "log"  # small errors can be told from each other beside large ones


@pytest.mark.parametrize("channels", [("tilt",), ("tilt", "tilt_rate")])
def test_the_legend_is_no_wider_than_the_figure(channels):
    gaps = [Gap(channel, h, 0.1, 0.08, 0.02, 0.01, 0.9, 0.01, -3.0) for channel in channels for h in (0.1, 0.2)]
    figure = gap_figure(gaps, {channel: "rad" for channel in channels}, "with what was named")
    figure.draw_without_rendering()
    (placed,) = figure.legends
    extent = placed.get_window_extent()
    assert len(placed.get_texts()) == 4
    assert figure.bbox.x0 < extent.x0 < extent.x1 < figure.bbox.x1
    lowest = min(panel.get_tightbbox().y0 for panel in figure.axes)
    assert extent.y1 < lowest


def test_the_floor_is_drawn_where_it_is_and_nothing_is_drawn_twice():
    """Noise alone may leave more than the rollouts do, and without effects these are those of the refit."""
    gaps = [Gap("tilt", h, 0.1 * h, 0.02 * h, 0.02 * h, 0.02 * h, 1.0, 0.03 * h, -3.0) for h in (0.1, 0.2)]
    (panel,) = gap_figure(gaps, {"tilt": "rad"}, None).axes
    assert [line.get_label() for line in panel.lines] == ["data sheet", "data sheet refitted", "sensor noise alone"]
    assert panel.lines[-1].get_ydata()[1] == pytest.approx(0.006)


def test_autocorrelation_stands_before_beside_after_and_begins_at_that_of_white_residuals():
    """On a logarithmic axis a bar from its lower end would be long or short by where that end is."""
    (panel,) = autocorrelation_figure(
        [ResidualAutocorrelation("tilt", 20.0, 1.2), ResidualAutocorrelation("tilt_rate", 8.0, 0.1)], None
    ).axes
    assert panel.get_yscale() == "log"
    assert {bar.get_y() for bar in panel.patches} == {1.0}
    ends = [bar.get_y() + bar.get_height() for bar in panel.patches]
    np.testing.assert_allclose(ends, [20.0, 8.0, 1.2, 0.1])
    assert texts(panel) == ["20", "8", "1.2", "0.1"]
    assert panel.get_ylim()[0] < 0.1


def test_a_refit_has_one_colour_in_the_pictures_of_a_diagnosis():
    """Blue is what was added to the data sheet, wherever something was."""
    gaps = [Gap("tilt", h, 0.1 * h, 0.02 * h, 0.02 * h, 0.02 * h, 1.0, 0.03 * h, -3.0) for h in (0.1, 0.2)]
    for after, line in ((None, "data sheet refitted"), ("with what was named", "with what was named")):
        (gap,) = gap_figure(gaps, {"tilt": "rad"}, after).axes
        colours = {drawn.get_label(): drawn.get_color() for drawn in gap.lines}
        (panel,) = autocorrelation_figure([ResidualAutocorrelation("tilt", 20.0, 1.2)], after).axes
        assert to_rgb(panel.patches[-1].get_facecolor()) == to_rgb(colours[line])


@pytest.mark.parametrize("largest", [1.3, 4.0, 30.0, 2000.0])
def test_ticks_of_a_logarithmic_axis_are_plain_numbers(largest):
    gaps = [Gap("tilt", h, e, e, e, e, 1.0, e, -3.0) for h, e in ((0.1, 0.011), (0.2, 0.011 * largest))]
    (panel,) = gap_figure(gaps, {"tilt": "rad"}, None).axes
    said = [text.get_text() for text in panel.get_yticklabels()]
    assert len(said) >= 2
    np.testing.assert_allclose([float(text) for text in said], panel.get_yticks())
    low, high = panel.get_ylim()
    assert all(low <= tick <= high for tick in panel.get_yticks())
    assert len(panel.get_yticks(minor=True)) == 0


def test_a_map_says_what_its_numbers_and_colours_are():
    figure = disagreement_figure(REGIONS, CHANNELS)
    assert "root mean square error" in figure.get_supxlabel()
    assert "Blue: measured lower than predicted" in figure.get_supxlabel()
    (note,) = (text for text in figure.texts if text.get_text() == figure.get_supxlabel())
    figure.draw_without_rendering()
    assert note.get_window_extent().width < figure.bbox.width


@pytest.mark.parametrize("axes", [1, 2, 3])
def test_the_note_of_a_map_is_not_cut(axes):
    regions = [Region("wheel_angle", axis, 0.0, 1.0, 50, 0.0, 1.0) for axis in list(AXES)[:axes]]
    figure = disagreement_figure(regions, ("wheel_angle",))
    figure.draw_without_rendering()
    (note,) = (text for text in figure.texts if text.get_text() == figure.get_supxlabel())
    extent = note.get_window_extent()
    assert figure.bbox.x0 < extent.x0 < extent.x1 < figure.bbox.x1


@pytest.mark.parametrize(
    ("rms", "said"),
    [(1.04, "1.0"), (99.94, "99.9"), (99.96, "100"), (999.4, "999"), (12345.6, ">999"), (np.inf, ">999")],
)
def test_large_numbers_of_a_map_do_not_run_into_each_other(rms, said):
    regions = [Region("tilt", axis, k, k + 1.0, 50, 0.0, rms) for axis in AXES if axis != "direction" for k in range(6)]
    figure = disagreement_figure(regions, ("tilt",))
    figure.draw_without_rendering()
    for panel in figure.axes:
        assert texts(panel) == [said] * 6
        boxes = [text.get_window_extent() for text in panel.texts]
        assert all(left.x1 < right.x0 for left, right in pairwise(boxes))


def test_residuals_without_any_autocorrelation_have_a_bar_too():
    (panel,) = autocorrelation_figure(
        [ResidualAutocorrelation("tilt", 9.0, 0.0), ResidualAutocorrelation("tilt_rate", 0.0, 1.2)], None
    ).axes
    assert texts(panel) == ["9", "0", "0", "1.2"]
    assert 0.0 < panel.get_ylim()[0] < min(bar.get_y() + bar.get_height() for bar in panel.patches)


def test_numbers_below_the_rivals_are_plain():
    rivals = [Rival(("a",), 10754.0, 1.0, 1.0), Rival((), 0.0, 0.0, 9.0)]
    figure = rivals_figure(rivals, most=3)
    assert "$" not in svg(figure)
    assert [text.get_text() for text in figure.axes[0].get_xticklabels()][:4] == ["0", "10", "100", "1000"]


def test_the_same_diagnosis_gives_the_same_picture():
    assert svg(disagreement_figure(REGIONS, CHANNELS)) == svg(disagreement_figure(REGIONS, CHANNELS))
