"""How much the bias of a gyro walks, told from logs of robots in MuJoCo."""

import sys
from pathlib import Path

import pytest
from test_lost_commands import NOISE, asked, driven
from test_real_logs import settings

from twbal.diagnosis.candidates import always_free
from twbal.diagnosis.gyro_walk import gyro_bias_walk
from twbal.diagnosis.hypothesis import fit_hypothesis
from twbal.diagnosis.side_findings import USUAL, BiasWalk

sys.path.insert(0, str(Path(__file__).parents[1] / "virtual_robot"))
from conftest import conf, make  # noqa: F401 - fixtures


def told(build, sheet, density, seeds):
    sensors = {"gyro_walk": density, "noise": NOISE}
    logs = [driven(build("paper", start=0.02, seed=s, sensors=sensors), sheet, 0.0, seed=s)[0] for s in seeds]
    data, model = asked(logs, sheet)
    free = always_free(settings("default").tolerances, model.planar, len(logs))
    return gyro_bias_walk(data, fit_hypothesis(data, model, free, (), 4))


@pytest.mark.parametrize("density", [0.0005, 0.003])
def test_the_interval_holds_the_density_of_a_walk_and_says_that_it_is_unusual(density, make, conf):  # noqa: F811
    walk = told(make, conf("robot/paper"), density, (1, 2, 3))
    assert walk.low95 < density < walk.high95
    assert walk.high95 < 6.0 * walk.low95
    assert walk.is_unusual
    assert "or something else changes the measured tilt rate over seconds" in walk.text


def test_a_gyro_that_does_not_walk_is_not_said_to(make, conf):  # noqa: F811
    walk = told(make, conf("robot/paper"), 0.0, (1, 2))
    assert walk.low95 < USUAL
    assert walk.high95 < 0.0005
    assert not walk.is_unusual


def test_a_sentence_says_the_size_the_interval_and_what_is_usual():
    text = BiasWalk(2e-5, 0.0, 8e-5).text
    assert text == (
        "The bias of the gyro walks by 2e-05 rad/s/√s (0 to 8e-05); that of a gyro of silicon walks by less than 1e-04."
    )
