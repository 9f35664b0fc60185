"""The correction of probabilities: that it is of the records it names, and what it does."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.calibration.fit import fitted, reliability
from benchmarks.other_robots.__main__ import written
from twbal.core.errors import DataError
from twbal.core.files import file_hash
from twbal.core.json_records import decoded
from twbal.diagnosis.calibration import Objected, calibration

ROOT = Path(__file__).parents[2]


def test_it_was_fitted_to_the_records_that_it_names():
    on = calibration().fitted_on
    assert file_hash(ROOT / on.records) == on.sha256


def test_a_fit_to_these_records_gives_it_again(monkeypatch):
    monkeypatch.chdir(ROOT)
    again, stored = fitted(Path(calibration().fitted_on.records)), calibration()
    assert again.fitted_on == stored.fitted_on
    np.testing.assert_allclose(np.array(again.reliability, float), np.array(stored.reliability, float), atol=1e-6)
    found, kept = ([each.intercept, each.slope, *each.shares.values()] for each in (again, stored))
    np.testing.assert_allclose(found, kept, atol=1e-3)


@pytest.mark.parametrize("objected", list(Objected))
def test_likelier_effects_stay_likelier(objected):
    corrected = [calibration().corrected(p, objected) for p in np.linspace(0.0, 1.0, 2001)]
    assert corrected[0] == 0.0
    assert np.all(np.diff(corrected) >= 0.0)
    assert corrected[-1] <= 1.0


def test_what_is_objected_to_itself_is_least_likely():
    said = {objected: calibration().corrected(0.99, objected) for objected in Objected}
    assert min(said, key=said.get) is Objected.EFFECT
    assert max(said, key=said.get) is Objected.NOTHING


def test_a_known_correction_is_found_again(tmp_path, monkeypatch):
    """Effects that are there with a probability that is known: of sure ones 0.9, and less often with an objection."""
    rng, sets = np.random.default_rng(0), []
    for _ in range(600):
        said = []
        for _ in range(3):
            odds, objected = rng.normal(0.0, 4.0), rng.choice(["nothing", "effect"])
            share = 0.95 if objected == "nothing" else 0.2
            right = rng.uniform() < share / (1.0 + np.exp(0.5 - 0.6 * odds))
            said.append({"uncalibrated": 1.0 / (1.0 + np.exp(-odds)), "objected": str(objected), "right": bool(right)})
        sets.append({"said": said})
    monkeypatch.chdir(tmp_path)
    Path("records.json").write_text(written({"sets": sets}))
    found = fitted(Path("records.json"))
    assert found.intercept == pytest.approx(-0.5, abs=0.3)
    assert found.slope == pytest.approx(0.6, abs=0.15)
    assert found.shares["nothing"] == pytest.approx(0.95, abs=0.05)
    assert found.shares["effect"] == pytest.approx(0.2, abs=0.07)


def test_reliability_counts_by_range():
    low, high = reliability([0.01, 0.05, 0.99, 1.0], [False, True, True, True])
    assert (low.pairs, low.right, high.low, high.right) == (2, 0.5, 0.9, 1.0)
    assert high.said == pytest.approx(0.995)


def test_what_earlier_versions_objected_to_is_still_read():
    assert decoded(Objected, "set", "objected") is Objected.OTHERS
    with pytest.raises(DataError, match="objected must be one of 'nothing', 'others', 'effect'; found 'nobody'"):
        decoded(Objected, "nobody", "objected")
