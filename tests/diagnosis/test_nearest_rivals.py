"""Effects of the same lateness in each other's place, on a recording of the planar model."""

from dataclasses import replace

import pytest
from conftest import CONF
from hydra.utils import instantiate
from omegaconf import OmegaConf
from synthetic_recordings import synthetic_recording
from test_likeliest import SETTINGS

from twbal.diagnosis.candidates import always_free
from twbal.diagnosis.effect_candidates import candidates_for
from twbal.diagnosis.name import QUIETEST, first_noise, largest_noise, with_fitted_noise
from twbal.diagnosis.nearest_rivals import with_nearest_rivals
from twbal.diagnosis.problem import Problem, Selection
from twbal.planar.parameters import planar_parameters
from twbal.sysid.model import Data, Model

HIDDEN = {"viscous_friction": {"coefficient": 0.06}, "actuation_delay": {"delay": 0.012}}


@pytest.fixture(scope="module")
def problem(paper):
    recordings = [synthetic_recording(paper, HIDDEN, seed=s, periods=300) for s in (71, 72)]
    data, planar = Data(recordings, SETTINGS.substeps, largest_noise(paper), QUIETEST), planar_parameters(paper, {})
    start = with_fitted_noise(data, Model(planar, 0.0, first_noise(paper, data.sensed)))
    few = [c for c in candidates_for(paper) if c.name in (*HIDDEN, "motor_lag", "imu_delay", "tilt_filter")]
    return Problem(data, start, always_free(SETTINGS.tolerances, planar, 2), few, SETTINGS)


def ended(problem, *names):
    """The selection that ended with these effects."""
    by_name = {c.name: c for c in problem.candidates}
    return Selection(problem.fit(problem.start, (), 3), (), problem.fit_at_once([by_name[name] for name in names]))


def test_a_lag_gives_way_to_the_delay_that_is_there(problem):
    before = ended(problem, "viscous_friction", "motor_lag")
    found = with_nearest_rivals(problem, before, lambda line: None)
    assert found.chosen.names == ("actuation_delay", "viscous_friction")
    assert found.chosen.bic < before.chosen.bic
    assert found.chosen.fit.model.value("actuation_delay_delay") == pytest.approx(0.012, rel=0.15)


def test_a_delay_stays_and_its_rivals_are_weighed(problem):
    before = ended(problem, "viscous_friction", "actuation_delay")
    found = with_nearest_rivals(problem, before, lambda line: None)
    assert found.chosen is before.chosen
    weighed = {w.names for w in found.sets}
    assert {("motor_lag", "viscous_friction"), ("imu_delay", "viscous_friction")} <= weighed
    assert not any("tilt_filter" in names for names in weighed)  # whose lead is no lateness of all


def test_nothing_is_tried_where_nothing_is_late(problem):
    before = ended(problem, "viscous_friction")
    assert with_nearest_rivals(problem, before, lambda line: None) is before


@pytest.fixture(scope="module")
def balboa():
    return instantiate(OmegaConf.load(CONF / "robot/balboa.yaml"))


def test_rotors_are_found_where_the_data_sheet_does_their_work(balboa):
    """The refit ends with another gain, another wheel radius and another height; none of them is off."""
    share, settings = 0.4, replace(SETTINGS, tolerances=replace(SETTINGS.tolerances, data_sheet=0.15))
    effects = {"rotor_inertia": {"share": share}}
    recordings = [synthetic_recording(balboa, effects, seed=s, periods=400, tolerance=0.0) for s in (71, 72)]
    data, planar = Data(recordings, settings.substeps, largest_noise(balboa), QUIETEST), planar_parameters(balboa, {})
    start = with_fitted_noise(data, Model(planar, 0.0, first_noise(balboa, data.sensed)))
    few = [c for c in candidates_for(balboa) if c.name in ("rotor_inertia", "dead_zone")]
    geared = Problem(data, start, always_free(settings.tolerances, planar, 2), few, settings)
    base = geared.fit(geared.start, (), 8)
    assert {"torque_gain", "wheel_radius"} <= set(geared.pulled_values(base))
    found = with_nearest_rivals(geared, Selection(base, (), base), lambda line: None).chosen
    assert found.names == ("rotor_inertia",)
    assert found.fit.model.value("rotor_inertia_share") == pytest.approx(share, rel=0.15)
    assert not geared.pulled_values(found)


def test_friction_without_a_breakaway_is_coulomb_friction(paper):
    """A search came to Stribeck friction, whose breakaway is next to nothing."""
    torque = 0.3
    recordings = [synthetic_recording(paper, {"coulomb_friction": {"torque": torque}}, seed=73, periods=400)]
    data, planar = Data(recordings, SETTINGS.substeps, largest_noise(paper), QUIETEST), planar_parameters(paper, {})
    start = with_fitted_noise(data, Model(planar, 0.0, first_noise(paper, data.sensed)))
    few = [c for c in candidates_for(paper) if c.name in ("coulomb_friction", "stribeck_friction", "ground_slope")]
    rubbing = Problem(data, start, always_free(SETTINGS.tolerances, planar, 1), few, SETTINGS)
    before = ended(rubbing, "stribeck_friction")
    found = with_nearest_rivals(rubbing, before, lambda line: None).chosen
    assert found.names == ("coulomb_friction",)
    assert found.bic < before.chosen.bic
    assert found.fit.model.value("coulomb_friction_torque") == pytest.approx(torque, rel=0.15)
    assert found.fit.model.value("stribeck_friction_torque") == 0.0


def test_dry_friction_that_bends_takes_the_place_of_a_viscous_one(paper):
    """Of a robot that hardly moves, viscous friction explains more than dry friction alone, and less than both."""
    hidden = {"rolling_resistance": {"torque": 0.25}, "presliding": {"angle": 0.02}}
    recordings = [synthetic_recording(paper, hidden, seed=s, periods=400, still=True, tolerance=0.0) for s in (74, 75)]
    data, planar = Data(recordings, SETTINGS.substeps, largest_noise(paper), QUIETEST), planar_parameters(paper, {})
    start = with_fitted_noise(data, Model(planar, 0.0, first_noise(paper, data.sensed)))
    few = [c for c in candidates_for(paper) if c.name in (*hidden, "rolling_viscous")]
    bending = Problem(data, start, always_free(SETTINGS.tolerances, planar, 2), few, SETTINGS)
    before, dry = ended(bending, "rolling_viscous"), ended(bending, "rolling_resistance").chosen
    assert before.chosen.bic < dry.bic
    found = with_nearest_rivals(bending, before, lambda line: None).chosen
    assert found.names == ("presliding", "rolling_resistance")
    assert found.bic < before.chosen.bic
    assert found.fit.model.value("rolling_resistance_torque") == pytest.approx(0.25, rel=0.2)
