"""What a prediction says of each candidate survives being saved, and older files are read."""

import numpy as np
import pytest

from twbal.algorithm.prediction import KIND, Assessment, Prediction, load_prediction, save_prediction
from twbal.core.gaussian import Gaussian
from twbal.io.checkpoint import load_checkpoint, save_checkpoint

FOUND, KEPT = Assessment("search from policy 1 x 1", 3.0, 1.0, 0.1, None), Assessment("policy 1", 4.0, 0.5, 0.2, 1)


@pytest.mark.parametrize("written", ["now", "before candidates said which earlier policy they are"])
def test_which_earlier_policy_a_candidate_is_is_read_back(tmp_path, written):
    states = (Gaussian(np.zeros(1), np.eye(1)), Gaussian(np.ones(1), np.eye(1)))
    save_prediction(tmp_path / "p.pt", Prediction(("tilt",), states, KEPT, (KEPT, FOUND)))
    if written != "now":
        payload = load_checkpoint(tmp_path / "p.pt", KIND)
        for verdict in (payload["best"], *payload["candidates"]):
            del verdict["earlier"]
        save_checkpoint(tmp_path / "p.pt", KIND, payload)
    read = load_prediction(tmp_path / "p.pt")
    assert (read.best, read.candidates) == (KEPT, (KEPT, FOUND))
