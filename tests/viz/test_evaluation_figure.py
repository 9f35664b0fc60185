"""Errors of simulations over the horizon: lines that are told apart, in the units of the tables beside them."""

import numpy as np

from twbal.diagnosis.evaluation_record import (
    EvaluatedLog,
    EvaluatedSimulation,
    Interval,
    PredictionScore,
    SimulationEvaluation,
)
from twbal.viz.evaluation_figure import evaluation_figure
from twbal.viz.evaluation_text import error_words, title

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


def lines(count):
    (panel,) = evaluation_figure(evaluation(count), "log").axes
    return panel, [line for line in panel.lines if line.get_label().startswith("simulation")]


def test_errors_are_drawn_as_the_tables_have_them():
    panel, (line,) = lines(1)
    assert panel.get_ylabel() == "error of tilt [rad]" and "[rad]" in title("tilt", 0.1)
    np.testing.assert_allclose(line.get_ydata(), HORIZONS)
    assert error_words(score("any", 0.1, line.get_ydata()[1])).startswith("0.1 ")
    np.testing.assert_allclose(line.get_xdata(), [50.0, 100.0, 200.0])


def test_ten_simulations_are_told_apart():
    _, drawn = lines(10)
    assert len({(line.get_color(), line.get_marker()) for line in drawn}) == 10
