"""The figures show the data that they are given, on axes with units, in files that are the same each time."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle
from matplotlib.text import Text

from twbal.algorithm.iteration import Iteration, PolicyFile
from twbal.algorithm.summary import SimData, Summary
from twbal.core.cost import SaturatingCost
from twbal.core.errors import ConfigError
from twbal.core.evaluation import SuccessCriterion
from twbal.core.gaussian import Array, Gaussian
from twbal.core.palette import GOOD, REAL
from twbal.viz.canvas import save, svg
from twbal.viz.cost_figures import cost_figure
from twbal.viz.learning_figure import learning_curve_figure
from twbal.viz.prediction_figures import prediction_figure
from twbal.viz.trial_figures import Trials, drift_figure, tilt_figure

CHANNELS, UNITS = ("tilt", "tilt_rate", "speed"), ("rad", "rad/s", "m/s")
PERIOD = 0.02
RULE = SuccessCriterion(tilt_limit=np.radians(30), settled_tilt_limit=np.radians(10), settle_step=20, steps=60)
COST = SaturatingCost(np.array([0.05, 0.0, 0.0]), np.array([0.25, 2.5, np.inf]))

A = np.array([[0.99, 0.02, 0.0], [-0.4, 0.9, 0.0], [0.1, 0.0, 0.98]])
Q = np.diag([1e-5, 1e-3, 1e-4])


def predicted(steps: int) -> list[Gaussian]:
    """Exact p(x_t) of a damped linear system."""
    seen = [Gaussian(np.array([-0.17, 0.0, 0.0]), np.diag([4e-4, 1e-3, 0.0]))]
    for _ in range(steps):
        seen.append(Gaussian(A @ seen[-1].mean, A @ seen[-1].covariance @ A.T + Q))
    return seen


def trajectories(count: int, steps: int, growth: float = 1.0) -> list[Array]:
    """Draws of that system; with growth over 1 of one that falls."""
    rng = np.random.default_rng(5)
    courses = []
    for _ in range(count):
        x = [predicted(0)[0].sample(1, rng)[0]]
        for _ in range(steps):
            x.append(growth * A @ x[-1] + rng.multivariate_normal(np.zeros(3), Q))
        courses.append(np.array(x))
    return courses


def summary() -> Summary:
    policy = PolicyFile("policy.pt", "0" * 64)
    first = Iteration(0, 0, 0, 0.0, 8.0, 80.0, 1, 10, 0.05, 2.0, 10.0, 0.4, None, policy, "")
    unmeasured = replace(first, index=1, real_episodes=1, real_cost=None, coverage95=None, trials=0, successes=0)
    last = replace(first, index=2, real_episodes=2, real_seconds=2.5, real_cost=9.0, coverage95=0.9, successes=10)
    return Summary("paper", 1, 100.0, SimData(20, 800), (first, unmeasured, last), 2)


def draw_prediction() -> Figure:
    return prediction_figure(predicted(40), trajectories(10, 60), CHANNELS, UNITS, PERIOD, "iteration 0")


def draw_tilt() -> Figure:
    groups = [
        Trials("before", [x[:, 0] for x in trajectories(4, 30, 1.05)]),
        Trials("after", [x[:, 0] for x in trajectories(4, 60)]),
    ]
    return tilt_figure(groups, PERIOD, RULE)


def draw_drift() -> Figure:
    groups = [Trials(f"iteration {i}", [PERIOD * np.cumsum(x[:, 2]) for x in trajectories(3, 60)]) for i in range(5)]
    return drift_figure(groups, PERIOD, RULE)


DRAWINGS: dict[str, Callable[[], Figure]] = {
    "cost": lambda: cost_figure([0.25, 0.5, 1.0], COST, CHANNELS, UNITS),
    "prediction": draw_prediction,
    "learning": lambda: learning_curve_figure(summary()),
    "tilt": draw_tilt,
    "drift": draw_drift,
}


def curves(axes: Axes, colour: str) -> list[Array]:
    """(points, 2) of each solid line of that colour, crosses left out."""
    lines = [line for line in axes.get_lines() if line.get_color() == colour and line.get_marker() != "x"]
    return [np.asarray(line.get_xydata(), dtype=np.float64) for line in lines]


def crosses(axes: Axes) -> list[Array]:
    return [np.asarray(x.get_xydata(), dtype=np.float64)[0] for x in axes.get_lines() if x.get_marker() == "x"]


@pytest.mark.parametrize("name", DRAWINGS)
@pytest.mark.parametrize("suffix", [".svg", ".png"])
def test_drawing_twice_gives_the_same_bytes(name: str, suffix: str, tmp_path: Path) -> None:
    for copy in ("a", "b"):
        save(DRAWINGS[name](), tmp_path / f"{copy}{suffix}", dots_per_inch=40)
    written = (tmp_path / f"a{suffix}").read_bytes()
    assert written == (tmp_path / f"b{suffix}").read_bytes() and len(written) > 2000


@pytest.mark.parametrize("name", DRAWINGS)
def test_every_axis_of_every_panel_is_named(name: str) -> None:
    figure = DRAWINGS[name]()
    assert all(panel.get_xlabel() and (panel.get_ylabel() or name == "drift") for panel in figure.axes)
    ElementTree.fromstring(svg(figure))


def test_the_style_of_the_caller_is_left_alone() -> None:
    before = dict(matplotlib.rcParams)
    svg(draw_prediction())
    assert dict(matplotlib.rcParams) == before


def test_a_figure_of_another_kind_of_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"written as \.svg or \.png; found 'a\.gif'"):
        save(draw_tilt(), tmp_path / "a.gif")


def test_what_varies_between_rollouts_is_a_darker_band_within_the_predicted_one():
    variance = np.array([state.sd**2 for state in predicted(40)])
    figure = prediction_figure(predicted(40), [], CHANNELS, UNITS, PERIOD, "band", unknown=0.75 * variance)
    for axes in figure.axes[: len(CHANNELS)]:
        whole, within = (c.get_paths()[0].vertices for c in axes.collections if isinstance(c, PolyCollection))
        heights = [np.ptp(band[np.isclose(band[:, 0], 40 * PERIOD), 1]) for band in (whole, within)]
        assert heights[1] == pytest.approx(0.5 * heights[0])


def test_the_darker_band_looks_in_the_legend_as_it_does_over_the_other_band() -> None:
    variance = np.array([state.sd**2 for state in predicted(40)])
    figure = prediction_figure(predicted(40), [], CHANNELS, UNITS, PERIOD, "band", unknown=0.75 * variance)
    whole, within = (c.get_alpha() for c in figure.axes[0].collections if isinstance(c, PolyCollection))
    (placed,) = figure.legends
    patches = zip(placed.get_texts(), placed.legend_handles, strict=True)
    shown = {text.get_text(): patch.get_facecolor()[3] for text, patch in patches if isinstance(patch, Patch)}
    assert shown["predicted, 95 %"] == whole
    assert shown["varies from rollout to rollout"] == pytest.approx(1.0 - (1.0 - whole) * (1.0 - within))


def test_the_band_holds_95_percent_of_draws_from_the_prediction() -> None:
    figure = prediction_figure(predicted(40), [], CHANNELS, UNITS, PERIOD, "band")
    rng = np.random.default_rng(2)
    for i, factor in enumerate([180 / np.pi, 180 / np.pi, 1.0]):
        band = next(c for c in figure.axes[i].collections if isinstance(c, PolyCollection)).get_paths()[0].vertices
        at_end = np.asarray(band)[np.isclose(np.asarray(band)[:, 0], 40 * PERIOD), 1]
        draws = factor * predicted(40)[40].sample(4000, rng)[:, i]
        inside = np.mean((draws > at_end.min()) & (draws < at_end.max()))
        assert inside == pytest.approx(0.95, abs=4 * np.sqrt(0.95 * 0.05 / 4000))


def test_trajectories_are_drawn_over_the_horizon_in_degrees_and_si() -> None:
    figure, courses = draw_prediction(), trajectories(10, 60)
    for i, factor in enumerate([180 / np.pi, 180 / np.pi, 1.0]):
        drawn = curves(figure.axes[i], REAL.light)
        assert len(drawn) == 10
        for course, line in zip(courses, drawn, strict=True):
            np.testing.assert_allclose(line, np.column_stack([PERIOD * np.arange(41), factor * course[:41, i]]))
    assert [panel.get_ylabel() for panel in figure.axes] == ["tilt [°]", "tilt rate [°/s]", "speed [m/s]"]


def test_a_trial_that_ends_early_ends_in_a_cross() -> None:
    whole, short = trajectories(2, 40)[0], trajectories(2, 40)[1][:11]
    figure = prediction_figure(predicted(40), [whole, short], CHANNELS, UNITS, PERIOD, "one falls")
    np.testing.assert_allclose(crosses(figure.axes[2]), [[10 * PERIOD, short[-1, 2]]])


def test_all_that_the_robot_did_is_within_the_axes_and_a_wild_band_is_cut() -> None:
    wild = [Gaussian(p.mean, 1e6 * p.covariance) for p in predicted(40)]
    courses = trajectories(10, 40, growth=1.03)
    figure = prediction_figure(wild, courses, CHANNELS, UNITS, PERIOD, "wild")
    low, high = figure.axes[2].get_ylim()
    speeds = np.concatenate([x[:, 2] for x in courses])
    assert low < speeds.min() and speeds.max() < high
    assert high - low < 10 * np.ptp(np.append(speeds, [p.mean[2] for p in wild]))


def test_a_prediction_that_runs_away_does_not_hide_the_robot_and_a_note_says_how_far_it_goes() -> None:
    away = [Gaussian(p.mean + np.radians([3.0 * t, 0, 0]), p.covariance) for t, p in enumerate(predicted(40))]
    courses = trajectories(10, 40)
    panel = prediction_figure(away, courses, CHANNELS, UNITS, PERIOD, "falls on the model").axes[0]
    low, high = panel.get_ylim()
    seen = np.degrees(np.concatenate([x[:, 0] for x in courses]))
    assert low < seen.min() and seen.max() < high
    assert high - low < 2.5 * np.ptp(seen)
    ends = [[p.mean[0] + side * 1.96 * p.sd[0] for p in away] for side in (-1, 1)]
    bottom, top = np.degrees(min(ends[0])), np.degrees(max(ends[1]))
    assert [text.get_text() for text in panel.texts] == [f"band: {bottom:.2g} to {top:.0f}"]
    assert not draw_prediction().axes[0].texts


def test_a_note_over_a_panel_overlaps_no_title() -> None:
    """Bands of a small robot have long numbers, and some channels long names."""
    names, units = ("position_integral", "command_2", "speed"), ("m·s", "N·m", "m/s")
    wild = [Gaussian(0.01 * p.mean, 2e-3 * p.covariance) for p in predicted(40)]
    courses = [5e-4 * course for course in trajectories(3, 40)]
    figure = prediction_figure(wild, courses, names, units, PERIOD, "small robot")
    figure.draw_without_rendering()
    for panel in figure.axes:
        (title,) = (text for text in panel.findobj(Text) if text.get_text() == panel.get_title("left"))
        (note,) = panel.texts
        assert note.get_text().startswith("band: ")
        assert panel.get_window_extent().y1 < note.get_window_extent().y0
        assert note.get_window_extent().y1 < title.get_window_extent().y0


@pytest.mark.parametrize("steps", [0, 40])
def test_where_the_robot_does_not_move_the_axes_are_those_of_the_band(steps: int) -> None:
    figure = prediction_figure(predicted(40), [np.zeros((steps + 1, 3))], CHANNELS, UNITS, PERIOD, "at rest")
    for i, factor in enumerate([180 / np.pi, 180 / np.pi, 1.0]):
        ends = [factor * (p.mean[i] + side * 1.96 * p.sd[i]) for p in predicted(40) for side in (-1, 1)]
        low, high = figure.axes[i].get_ylim()
        assert low < min(*ends, 0.0) and max(*ends, 0.0) < high
        assert high - low < 1.3 * np.ptp([*ends, 0.0])


@pytest.mark.parametrize(("count", "name"), [(1, "robot, 1 trial"), (2, "robot, 2 trials")])
def test_the_legend_counts_the_trials(count: int, name: str) -> None:
    figure = prediction_figure(predicted(40), trajectories(count, 40), CHANNELS, UNITS, PERIOD, "counted")
    assert name in [text.get_text() for text in figure.legends[0].get_texts()]


@pytest.mark.parametrize("settle_step", [20, RULE.steps])
def test_the_legend_has_the_settled_area_only_where_there_is_one(settle_step: int) -> None:
    """The rule of the paper has none: trials of 2 s, of which nothing is asked beyond 2 s."""
    courses = [x[:, 0] for x in trajectories(2, RULE.steps)]
    (placed,) = tilt_figure([Trials("some", courses)], PERIOD, replace(RULE, settle_step=settle_step)).legends
    told = [text.get_text() for text in placed.get_texts()]
    assert any("must stay in here" in name for name in told) == (settle_step < RULE.steps)


def test_no_line_runs_through_a_width_of_a_band() -> None:
    first, *others = summary().iterations
    about = replace(summary(), iterations=(replace(first, tilt_band_widest=np.radians(2)), *others))
    (width,) = (text for text in learning_curve_figure(about).axes[2].texts if text.get_text() == "±2°")
    backing = width.get_bbox_patch()
    assert backing is not None and backing.get_facecolor()[3] == 1.0


def test_the_widest_band_stands_beside_the_share_that_it_holds() -> None:
    first, *others = summary().iterations
    about = replace(summary(), iterations=(replace(first, tilt_band_widest=np.radians(100)), *others))
    _, _, coverage = learning_curve_figure(about).axes
    assert [text.get_text() for text in coverage.texts] == ["0.95 wanted", "±100°", "±: widest band of the tilt"]


def test_the_cost_is_drawn_as_it_is_charged() -> None:
    figure = DRAWINGS["cost"]()
    shapes, tilt, tilt_rate = figure.axes
    for line, a in zip(shapes.get_lines(), [0.25, 0.5, 1.0], strict=True):
        d, c = np.asarray(line.get_xydata()).T
        np.testing.assert_allclose(c, 1 - np.exp(-0.5 * d**2 / a**2), atol=1e-12)
    degrees, c = np.asarray(tilt.get_lines()[0].get_xydata()).T
    np.testing.assert_allclose(c, 1 - np.exp(-0.5 * ((np.radians(degrees) - 0.05) / 0.25) ** 2), atol=1e-12)
    assert tilt_rate.get_xlabel() == "tilt rate [°/s]"


def test_the_mark_of_a_cost_is_on_the_curve_also_where_changes_of_the_command_are_priced() -> None:
    names, units = ("tilt", "command_1", "command_2"), ("rad", "N·m", "N·m")
    widths, change = np.array([0.25, 20.0, np.inf]), np.array([0.0, 1.0, -1.0]) / 6.0
    for cost, expected in (
        (SaturatingCost(np.zeros(3), widths, change), 1.0 / np.sqrt(1 / 20**2 + 1 / 6**2)),
        (SaturatingCost(np.zeros(3), widths), 20.0),
    ):
        figure = cost_figure([0.5], cost, names, units)
        curve, mark = figure.axes[2].get_lines()
        ends, level = np.asarray(mark.get_xydata()).T
        np.testing.assert_allclose(ends, [-expected, expected], rtol=1e-5)
        np.testing.assert_allclose(np.interp(ends, *np.asarray(curve.get_xydata()).T), level, atol=1e-3)
        (note,) = figure.axes[2].texts
        assert note.get_text() == f"± {expected:.3g}"
        assert (figure.axes[2].get_title("left"), figure.axes[2].get_xlabel()) == ("last command", "last command [N·m]")


def test_past_commands_are_called_so_in_predictions() -> None:
    names, units = ("tilt", "command_1", "command_2"), ("rad", "N·m", "N·m")
    states = [Gaussian(np.zeros(3), np.eye(3)) for _ in range(5)]
    figure = prediction_figure(states, [], names, units, PERIOD, "iteration 0")
    assert [panel.get_title("left") for panel in figure.axes] == ["tilt", "last command", "2nd last command"]
    assert [panel.get_ylabel() for panel in figure.axes][1:] == ["last command [N·m]", "2nd last command [N·m]"]


def test_the_axis_of_a_share_holds_shares_and_the_titles_of_the_learning_curve_fit() -> None:
    figure = DRAWINGS["learning"]()
    figure.draw_without_rendering()
    *_, coverage = figure.axes
    assert -0.1 < coverage.get_ylim()[0] < 0.0 and min(coverage.get_yticks()) >= 0.0
    for panel in figure.axes:
        (title,) = (text for text in panel.findobj(Text) if text.get_text() == panel.get_title("left"))
        assert title.get_window_extent().x1 < figure.bbox.x1 - 5.0


def test_the_words_of_the_tilt_figure_are_outside_its_panels() -> None:
    figure = draw_tilt()
    assert not any(panel.texts for panel in figure.axes)
    (placed,) = figure.legends
    assert [text.get_text() for text in placed.get_texts()] == [
        *("must stay in here from 0.4 s on", "falls"),
        "trial ends early",
    ]


def test_the_legend_of_the_drift_tells_crosses_of_any_panel_and_the_place() -> None:
    fallen = Trials("iteration 1", [np.linspace(0.0, 0.4, 21)])
    rule = replace(RULE, place_radii=1.0, wheel_radius=0.15, place_step=30)
    (placed,) = drift_figure([Trials("iteration 0", [np.zeros(61)]), fallen], PERIOD, rule).legends
    assert [text.get_text() for text in placed.get_texts()] == ["must stay in here from 0.6 s on", "trial ends early"]


def test_the_legend_of_the_cost_says_what_its_marks_are() -> None:
    (placed,) = DRAWINGS["cost"]().legends
    assert [text.get_text() for text in placed.get_texts()] == ["distance from the target at which a state costs 0.39"]


def test_the_learning_curve_shows_counts_marks_the_best_and_skips_what_was_not_measured() -> None:
    trials, cost, coverage = DRAWINGS["learning"]().axes
    bars = [patch for patch in trials.patches if isinstance(patch, Rectangle)]
    assert [bar.get_height() for bar in bars] == [1, 0, 10]
    colours = [to_hex(bar.get_facecolor()) for bar in bars]
    assert [colour == GOOD.light for colour in colours] == [False, False, True]
    assert np.asarray(cost.get_lines()[1].get_xydata()).tolist() == [[0, 80], [2, 9]]
    assert np.asarray(coverage.get_lines()[1].get_xydata()).tolist() == [[0, 0.05], [2, 0.9]]
    assert [tick.get_text() for tick in trials.get_xticklabels()] == ["0\n0.0 s", "1\n0.0 s", "2\n2.5 s"]


@pytest.mark.parametrize(("count", "best"), [(4, 1), (6, 5), (7, 3), (11, 10), (12, 1), (40, 17)])
def test_labels_of_many_iterations_stand_apart_and_the_best_has_one(count: int, best: int) -> None:
    first = summary().iterations[0]
    iterations = tuple(
        replace(first, index=i, real_seconds=12.5 * i, tilt_band_widest=0.05, coverage95=0.5) for i in range(count)
    )
    figure = learning_curve_figure(replace(summary(), iterations=iterations, best_iteration=best))
    figure.draw_without_rendering()
    trials, _, coverage = figure.axes
    places = [round(tick) for tick in trials.get_xticks()]
    assert best in places and places == sorted(places)
    assert len(places) >= min(count, 6) // 2
    names = [text for text in trials.get_xticklabels() if text.get_text()]
    shares = [text for text in trials.texts if text.get_text()]
    widths = [text for text in coverage.texts if text.get_text().startswith("±2")]
    for texts in (names, shares, widths):
        assert len(texts) == len(places)
        boxes = [text.get_window_extent() for text in texts]
        assert all(left.x1 < right.x0 for left, right in pairwise(boxes))


def test_falls_are_crossed_and_whole_trials_are_not() -> None:
    before, after = draw_tilt().axes
    assert len(crosses(before)) == 4 and not crosses(after)
    assert all(point[0] == pytest.approx(30 * PERIOD) for point in crosses(before))


def test_the_drift_panels_share_one_scale_that_holds_every_course() -> None:
    figure = draw_drift()
    assert len(figure.axes) == 5
    limits = {panel.get_ylim() for panel in figure.axes}
    (low, high), *others = limits
    seen = np.concatenate([line[:, 1] for panel in figure.axes for line in curves(panel, REAL.light)])
    assert not others and low < seen.min() and seen.max() < high
