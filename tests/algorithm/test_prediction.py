"""What a prediction says of each candidate survives being saved, and older files are read."""

from dataclasses import replace

import numpy as np
import pytest

from twbal.algorithm.prediction import KIND, Assessment, PredictedBy, Prediction, load_prediction, save_prediction
from twbal.core.errors import CheckpointError
from twbal.core.gaussian import Gaussian
from twbal.io.checkpoint import load_checkpoint, save_checkpoint
from twbal.search.predictor import Predictor

FOUND = Assessment("search from policy 1 x 1", 3.0, 1.0, 0.1, None, 60.5 / 61)
KEPT = Assessment("policy 1", 4.0, 0.5, 0.2, 1, 30.5 / 61)
BY = (PredictedBy(Predictor.ROBOTS, 0.7, 0.03, "mean parameters"), PredictedBy(Predictor.MODEL, 0.9))
STATES = (Gaussian(np.zeros(1), np.eye(1)), Gaussian(np.ones(1), np.eye(1)))


@pytest.mark.parametrize("written", ["now", "before candidates said which earlier policy they are"])
def test_which_earlier_policy_a_candidate_is_is_read_back(tmp_path, written):
    save_prediction(tmp_path / "p.pt", Prediction(("tilt",), STATES, KEPT, (KEPT, FOUND), BY))
    if written != "now":
        payload = load_checkpoint(tmp_path / "p.pt", KIND)
        for verdict in (payload["best"], *payload["candidates"]):
            del verdict["earlier"]
        save_checkpoint(tmp_path / "p.pt", KIND, payload)
    read = load_prediction(tmp_path / "p.pt")
    assert (read.best, read.candidates) == (KEPT, (KEPT, FOUND))


def test_which_earlier_policy_it_is_does_not_depend_on_how_it_is_called(tmp_path):
    renamed = replace(KEPT, origin="the one before")
    save_prediction(tmp_path / "p.pt", Prediction(("tilt",), STATES, renamed, (renamed, FOUND), BY))
    assert load_prediction(tmp_path / "p.pt").best.earlier == 1


def test_a_file_without_probabilities_of_success_is_read(tmp_path):
    save_prediction(tmp_path / "p.pt", Prediction(("tilt",), STATES, KEPT, (KEPT,), BY))
    payload = load_checkpoint(tmp_path / "p.pt", KIND)
    del payload["best"]["success_probability"]
    save_checkpoint(tmp_path / "p.pt", KIND, payload)
    read = load_prediction(tmp_path / "p.pt")
    assert read.best.success_probability is None
    assert read.candidates == (KEPT,)


def test_what_predicted_is_read_back(tmp_path):
    save_prediction(tmp_path / "p.pt", Prediction(("tilt",), STATES, KEPT, (KEPT,), BY))
    read = load_prediction(tmp_path / "p.pt")
    assert read.predictors == BY
    assert read.cost == 0.7


def test_margins_and_what_is_not_known_are_read_back_and_may_be_missing(tmp_path):
    unknown = np.array([[0.0], [0.25]])
    best = replace(FOUND, margin=0.7)
    save_prediction(tmp_path / "p.pt", Prediction(("tilt",), STATES, best, (best, KEPT), BY, unknown))
    read = load_prediction(tmp_path / "p.pt")
    assert [each.margin for each in (read.best, *read.candidates)] == [0.7, 0.7, None]
    np.testing.assert_array_equal(read.unknown, unknown)
    assert read.unknown_share(0) == 0.25
    payload = load_checkpoint(tmp_path / "p.pt", KIND)
    del payload["unknown"], payload["best"]["margin"]
    save_checkpoint(tmp_path / "p.pt", KIND, payload)
    old = load_prediction(tmp_path / "p.pt")
    assert old.unknown is old.best.margin is old.unknown_share(0) is None


def test_an_older_file_was_predicted_by_the_model(tmp_path):
    save_prediction(tmp_path / "p.pt", Prediction(("tilt",), STATES, KEPT, (KEPT,), BY))
    payload = load_checkpoint(tmp_path / "p.pt", KIND)
    del payload["predictors"]
    save_checkpoint(tmp_path / "p.pt", KIND, payload)
    read = load_prediction(tmp_path / "p.pt")
    assert read.predictors == (PredictedBy(Predictor.MODEL, KEPT.cost),)
    assert read.cost == KEPT.cost


@pytest.mark.parametrize(
    ("predictors", "message"),
    [
        ([], "found none"),
        (
            [{"by": "a cousin", "cost": 0.5, "crps": None, "detail": ""}],
            "more of: model, sampled robots; found a",
        ),
        ([{"by": "model", "cost": 1.5, "crps": None, "detail": ""}], r"cost must be within \[0, 1\]; found 1.5"),
        ([{"by": "model", "cost": 0.5, "crps": -0.1, "detail": ""}], "crps must be within"),
        ([{"by": "model", "cost": 0.5, "crps": None}], "has no 'detail'"),
    ],
)
def test_predictors_that_cannot_be_ones_are_refused(tmp_path, predictors, message):
    save_prediction(tmp_path / "p.pt", Prediction(("tilt",), STATES, KEPT, (KEPT,), BY))
    payload = load_checkpoint(tmp_path / "p.pt", KIND)
    save_checkpoint(tmp_path / "p.pt", KIND, {**payload, "predictors": predictors})
    with pytest.raises(CheckpointError, match=message):
        load_prediction(tmp_path / "p.pt")
