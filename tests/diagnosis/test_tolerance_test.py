from dataclasses import replace

import numpy as np
import pytest
from hydra.utils import instantiate
from omegaconf import OmegaConf
from scipy.optimize import least_squares
from synthetic_recordings import synthetic_recording

from twbal.cli.conf_folder import conf_folder
from twbal.diagnosis.candidates import always_free
from twbal.diagnosis.data_sheet import DATA_SHEET, WHEELS
from twbal.diagnosis.effect_candidates import candidates_for
from twbal.diagnosis.hypothesis import fit_hypothesis
from twbal.diagnosis.name import first_noise, name_effects
from twbal.diagnosis.record import Verdict
from twbal.diagnosis.tolerance_test import tolerance_statistic
from twbal.planar.parameters import planar_parameters
from twbal.sysid.model import Data, Model

SETTINGS = instantiate(OmegaConf.load(conf_folder() / "groups" / "diagnosis.yaml").default)
TOLERANCE = SETTINGS.tolerances.data_sheet


LIMITS = {field: SETTINGS.tolerances.of(field) for field in (*DATA_SHEET, *WHEELS)}


def refitted(robot, effects):
    """Recordings of a robot whose data sheet is off by these effects alone, and the fit that is the model to beat."""
    data = Data([synthetic_recording(robot, effects, seed=21, periods=1000, tolerance=0.0)], SETTINGS.substeps)
    planar = planar_parameters(robot, {})
    start = Model(planar, 0.0, first_noise(robot, data.sensed))
    always = always_free(SETTINGS.tolerances, planar, 1)
    return data, fit_hypothesis(data, data.with_noise(start, 30), always, (), 8).fit


def scaled(**factors):
    return {name: {"factor": factor} for name, factor in factors.items()}


def test_a_robot_within_its_tolerances_strains_nothing(paper):
    corner = scaled(body_mass=1.029, body_inertia=0.971, com_height=1.029, wheel_radius=0.971)
    assert tolerance_statistic(*refitted(paper, corner), LIMITS) < 0.2 * SETTINGS.thresholds.max_tolerance_statistic


def test_strain_is_what_a_bounded_fit_loses(paper):
    """The truth is a fit within the limits by another method, with nothing linearised.

    Factors multiply, and together reach a little farther than their sum, of which the strain is the square.
    """
    data, fit = refitted(paper, scaled(body_mass=1.12))
    sds = np.array([free.sd for free in fit.free_parameters])
    means = np.array([free.mean for free in fit.free_parameters])
    sheet = np.array([free.field in (*DATA_SHEET, *WHEELS) for free in fit.free_parameters])
    low = np.where(sheet, means * (1 - TOLERANCE), [free.low for free in fit.free_parameters])
    high = np.where(sheet, means * (1 + TOLERANCE), [free.high for free in fit.free_parameters])

    def errors(shares):
        values = low + shares * (high - low)
        model = fit.model.put(dict(zip([free.field for free in fit.free_parameters], values, strict=True)))
        return np.concatenate([data.white(model, fit.kalman), ((values - means) / sds)[~sheet]])

    begin = np.clip((fit.values - low) / (high - low), 1e-3, 1 - 1e-3)
    bounded = least_squares(errors, begin, bounds=(0.0, 1.0), diff_step=1e-4)
    unbounded = fit.white @ fit.white + np.sum(((fit.values - means) / sds)[~sheet] ** 2)
    found = tolerance_statistic(data, fit, LIMITS)
    assert found > SETTINGS.thresholds.max_tolerance_statistic
    assert found == pytest.approx(2.0 * bounded.cost - unbounded, rel=0.35)


@pytest.mark.slow
def test_a_body_too_heavy_is_seen_although_no_value_stands_out(paper):
    """Mass, inertia and gain share what the mass is off by, and each is within two standard deviations."""
    recording = synthetic_recording(paper, scaled(body_mass=1.11), seed=22, periods=1500, tolerance=0.0)
    found = name_effects([recording], paper, {}, candidates_for(paper), SETTINGS)
    assert found.verdict is Verdict.DATA_SHEET
    assert found.data_sheet_class == ("gain, mass and inertia",)
    assert max(abs(shift.sigmas) for shift in found.data_sheet) < SETTINGS.thresholds.min_reported_shift


@pytest.mark.slow
@pytest.mark.parametrize(("tolerance", "told"), [(0.03, True), (0.15, False)])
def test_a_data_sheet_that_is_far_off_is_no_finding_unless_it_is_said_to_be_rough(paper, tolerance, told):
    recording = synthetic_recording(paper, scaled(com_height=1.3), seed=23, periods=1000, tolerance=0.0)
    drag = [candidate for candidate in candidates_for(paper) if candidate.name == "coulomb_friction"]
    settings = replace(SETTINGS, tolerances=replace(SETTINGS.tolerances, data_sheet=tolerance))
    found = name_effects([recording], paper, {}, drag, settings)
    assert any("no finding" in sentence for sentence in found.advice) == told
    assert any("diagnosis.tolerances.data_sheet=0.15" in sentence for sentence in found.advice) == told


@pytest.mark.slow
def test_nothing_is_named_beside_a_data_sheet_that_is_beyond_what_a_rough_one_may_be(paper):
    """At the bounds of the search, or beyond the line that must lie inside them."""
    far = {"body_mass": {"factor": 0.3}, "com_height": {"factor": 0.4}, "torque_gain": {"gain": 0.75}}
    recording = synthetic_recording(
        paper, {**far, "coulomb_friction": {"torque": 0.2}}, seed=23, periods=600, tolerance=0.0
    )
    drag = [candidate for candidate in candidates_for(paper) if candidate.name in ("coulomb_friction", "dead_zone")]
    settings = replace(SETTINGS, tolerances=replace(SETTINGS.tolerances, data_sheet=0.15))
    found = name_effects([recording], paper, {}, drag, settings)
    assert found.verdict is Verdict.UNKNOWN
    assert found.named_effects == ()
