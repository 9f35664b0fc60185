"""A free form: its linear responses are those of the library's effects, and what is left out is drawn as it is."""

from dataclasses import replace

import numpy as np
import pytest
from hydra import compose
from hydra.utils import instantiate
from synthetic_recordings import synthetic_recording

from twbal.cli.composition import composing
from twbal.core.robot_parameters import GRAVITY
from twbal.diagnosis import free_form
from twbal.diagnosis.candidates import always_free
from twbal.diagnosis.free_form import FreeFormInputs, free_forms
from twbal.diagnosis.free_form_candidates import CANDIDATES, JOINT, OUTSIDE, TILT, courses
from twbal.diagnosis.free_form_record import on_free_forms
from twbal.diagnosis.hypothesis import fit_hypothesis
from twbal.diagnosis.linear_errors import linear_errors, responses
from twbal.planar.constants import constants
from twbal.planar.parameters import planar_parameters
from twbal.sysid.likelihood import weights_of
from twbal.sysid.model import Data, Model
from twbal.sysid.noise import NoiseModel

NOISE = NoiseModel(np.array([0.0035, 0.02, 0.001, 0.05]), np.array([0.02, 0.02]))
VISCOUS = {"viscous_friction": {"coefficient": 0.03}}


@pytest.fixture(scope="module")
def settings():
    with composing():
        return instantiate(compose("diagnose", ["episodes=e"]).diagnosis)


@pytest.fixture(scope="module")
def plain(paper):
    """A recording of a robot that lacks nothing, and its model."""
    data = Data([synthetic_recording(paper, {}, seed=1, periods=200, tolerance=0.0)], 10)
    return data, Model(planar_parameters(paper, {}), 0.0, NOISE)


def at(plain):
    data, model = plain
    kalman = data.filter(model)
    return linear_errors(data, model, (), kalman, weights_of(data.errors(model, kalman), data.usable, kalman))


def change(plain, **values):
    """Change of the prediction errors with fields of the planar model."""
    data, model = plain
    kalman = data.filter(model)
    (before,), (after,) = data.errors(model, kalman), data.errors(model.put(values), kalman)
    return after - before


def agree(found, expected, share=0.06):
    """To within what the planar model is not linear."""
    assert np.sqrt(np.mean((found - expected) ** 2)) < share * np.sqrt(np.mean(expected**2))


def test_a_force_leaves_what_a_slope_explains(plain):
    """The errors that a force leaves go where a model has it: what the model adds is what the robot lacks."""
    data, model = plain
    angle = 1e-3
    weight = GRAVITY * constants(model.planar, data.period).mass
    found = responses(at(plain), OUTSIDE, np.ones((len(data.recordings[0]), 1)))[:, :, 0]
    agree(weight * angle * found, change(plain, ground_slope_angle=angle))


def test_a_constant_tilt_reading_leaves_what_a_mounting_angle_explains(plain):
    data, _ = plain
    found = responses(at(plain), TILT, np.ones((len(data.recordings[0]) + 1, 1)))[:, :, 0]
    agree(-1e-3 * found, change(plain, imu_mount_angle_angle=1e-3))


def test_a_torque_over_the_wheel_rate_leaves_what_viscous_friction_explains(plain):
    data, model = plain
    kalman = data.filter(model)
    (course,) = courses(data, model, kalman, data.predictions(model, kalman))["wheel rate"]
    torque = -2.0 * 1e-3 * course.within.mean(axis=1)
    agree(-responses(at(plain), JOINT, torque[:, None])[:, :, 0], change(plain, viscous_friction_coefficient=1e-3))


def drawn_of(paper, settings, effects, seed):
    """What is drawn of recordings of a robot with effects, beside the data sheet refitted."""
    recordings = [synthetic_recording(paper, effects, 10 * seed + k, periods=600, tolerance=0.02) for k in range(3)]
    data = Data(recordings[:2], 10)
    planar = planar_parameters(paper, {})
    always = always_free(settings.tolerances, planar, 2)
    start = data.with_noise(Model(planar, 0.0, NOISE), 30)
    chosen = fit_hypothesis(data, start, always, (), 2)
    return free_forms(FreeFormInputs(data, chosen, always, replace(data, recordings=recordings[2:]), (), 0.04)), data


def test_viscous_friction_that_the_library_lacks_is_drawn_over_the_wheel_rate(paper, settings):
    (found,), data = drawn_of(paper, settings, VISCOUS, seed=1)
    assert (found.quantity, found.variable, found.in_place_of) == (JOINT, "wheel rate", ())
    rates = np.concatenate([recording.measured[:, 3] for recording in data.recordings])
    truth = -2.0 * 0.03 * (np.array(found.grid) - rates.mean())
    inside = (truth > np.array(found.low95)) & (truth < np.array(found.high95))
    assert inside.mean() >= 0.8
    assert "it falls throughout" in found.shape
    assert found.share > 0.0
    assert found.p_value < 0.05
    assert found.shape in on_free_forms([found])


def test_nothing_is_drawn_where_predictions_diverge_on_held_out_data(paper, settings, monkeypatch):
    """What is drawn goes into `diagnosis.json`, which takes no number that is not finite."""
    monkeypatch.setattr(free_form, "held_out_share", lambda *arguments: np.nan)
    assert drawn_of(paper, settings, VISCOUS, seed=1)[0] == ()


def test_nothing_is_drawn_where_nothing_is_missing(paper, settings):
    assert drawn_of(paper, settings, {}, seed=2)[0] == ()
    assert "No added torque" in on_free_forms([])


@pytest.mark.slow
def test_nearly_nothing_is_drawn_of_many_robots_that_lack_nothing(paper, settings):
    assert sum(bool(drawn_of(paper, settings, {}, seed)[0]) for seed in range(100, 120)) <= 1


def test_no_two_candidates_are_the_same():
    assert len({candidate.text for candidate in CANDIDATES}) == len(CANDIDATES)
