"""Errors of simulations over the horizon: lines that are told apart, in the units of the tables beside them."""

import numpy as np

from twbal.diagnosis.evaluation_record import (
    EvaluatedLog,
    EvaluatedSimulation,
    Interval,
    PredictionScore,
    SimulationEvaluation,
)
from twbal.viz.canvas import svg
from twbal.viz.evaluation_figure import evaluation_figure
from twbal.viz.evaluation_text import error_words, title, write_evaluation_report

HORIZONS = (0.05, 0.1, 0.2)


def score(name, horizon, error):
    ends = Interval(0.9 * error, 1.1 * error)
    return PredictionScore(name, "log", "tilt", horizon, 50, error, ends, 1.0, None, 0.01, None, None, 0.0, 0, False)


def evaluation(count):
    names = [f"simulation_{k}" for k in range(count)]
    scores = tuple(score(name, h, h * (k + 1)) for k, name in enumerate(names) for h in HORIZONS)
    simulations = tuple(EvaluatedSimulation(name, "file", {}, ()) for name in names)
    log = EvaluatedLog("log", "file", 10.0, 50, {"tilt": 0.001}, 0.1)
    return SimulationEvaluation("robot", names[0], simulations, (log,), scores)


def diverging(*names):
    """Simulations of which none predicts anything, on logs whose noise is not known either."""
    scores = tuple(
        PredictionScore(name, "log", "tilt", h, 50, None, None, None, None, None, None, None, 1.0, 50, False)
        for name in names
        for h in HORIZONS
    )
    simulations = tuple(EvaluatedSimulation(name, "file", {}, ()) for name in names)
    log = EvaluatedLog("log", "file", 10.0, 50, {"tilt": 0.001}, 0.1)
    return SimulationEvaluation("robot", names[0], simulations, (log,), scores)


def lines(count):
    (panel,) = evaluation_figure(evaluation(count), "log").axes
    return panel, [line for line in panel.lines if line.get_label().startswith("simulation")]


def test_errors_are_drawn_as_the_tables_have_them():
    panel, (line,) = lines(1)
    assert panel.get_ylabel() == "error of tilt [rad]" and "[rad]" in title("tilt", 0.1)
    np.testing.assert_allclose(line.get_ydata(), HORIZONS)
    assert error_words(score("any", 0.1, line.get_ydata()[1])).startswith("0.1 ")
    np.testing.assert_allclose(line.get_xdata(), [50.0, 100.0, 200.0])


def test_where_every_simulation_diverges_the_panel_and_the_page_say_so(tmp_path):
    evaluation = diverging("nominal", "other")
    picture = svg(evaluation_figure(evaluation, "log"))
    assert "no finite values" in picture
    assert picture == svg(evaluation_figure(evaluation, "log"))
    write_evaluation_report(tmp_path / "report.html", evaluation, picture)
    page = (tmp_path / "report.html").read_text()
    assert "no finite values" in page and "diverges (50 of 50)" in page


def test_the_legend_has_every_name_as_it_is_written():
    names = ["_mine", r"sim $\foo$", "plain"]
    figure = evaluation_figure(diverging(*names), "log")
    (placed,) = figure.legends
    assert [text.get_text() for text in placed.get_texts()] == [*names, "sensor noise alone"]
    assert all(f">{name}</text>" in svg(figure) for name in names)


def test_ten_simulations_are_told_apart():
    _, drawn = lines(10)
    assert len({(line.get_color(), line.get_marker()) for line in drawn}) == 10
