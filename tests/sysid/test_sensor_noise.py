"""A recording alone tells the noise of its sensors."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from twbal.sysid.noise import UNSENSED
from twbal.sysid.sensor_noise import sensor_noise

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "diagnosis"))
from synthetic_recordings import NOISE, synthetic_recording

TRUE = np.array(list(NOISE.values()))
HIDDEN = {"coulomb_friction": {"torque": 0.3}, "dead_zone": {"width": 1.0}, "actuation_delay": {"delay": 0.03}}


@pytest.mark.parametrize("effects", [{}, HIDDEN], ids=["nominal", "effects"])
@pytest.mark.parametrize("still", [False, True], ids=["shaken", "still"])
def test_noise_of_angles_is_exact_and_that_of_rates_not_far_above(effects, still, paper):
    found = sensor_noise(synthetic_recording(paper, effects, seed=5, periods=1500, still=still))
    assert found[[0, 2]] == pytest.approx(TRUE[[0, 2]], rel=0.1)
    assert (found[[1, 3]] > 0.9 * TRUE[[1, 3]]).all()
    assert (found[[1, 3]] < 1.4 * TRUE[[1, 3]]).all()


def test_no_sensor_is_finer_than_its_steps_and_one_that_there_is_not_is_none(paper):
    recording = synthetic_recording(paper, {}, seed=6, periods=600)
    measured = recording.measured.copy()
    measured[:, 2] = 0.05 * np.round(measured[:, 2] / 0.05)
    coarse = replace(recording, measured=measured, sensed=np.array([True, False, True, False]))
    found = sensor_noise(coarse)
    assert (found[[1, 3]] == UNSENSED).all()
    assert found[2] >= 0.999 * 0.05 / np.sqrt(12)
    assert found[0] == pytest.approx(TRUE[0], rel=0.2)
