"""What is at a bound, and what swallows the commands."""

from dataclasses import replace

import numpy as np
import pytest
from hydra import compose
from hydra.utils import instantiate
from omegaconf import OmegaConf
from scipy.special import erf
from synthetic_recordings import synthetic_recording

from twbal.cli.composition import composing
from twbal.cli.conf_folder import conf_folder
from twbal.diagnosis.candidates import LOWEST, always_free
from twbal.diagnosis.data_sheet import DATA_SHEET, WHEELS
from twbal.diagnosis.effect_candidates import candidates_for
from twbal.diagnosis.hypothesis import FittedHypothesis, fit_hypothesis, is_at_bound
from twbal.diagnosis.name import first_noise
from twbal.diagnosis.settings import Tolerances
from twbal.planar.actuation import equivalent_gain
from twbal.planar.parameters import planar_parameters
from twbal.sysid.model import Data, FreeParameter, Model
from twbal.sysid.prediction_error_fit import Fit

PRESETS = [str(name) for name in OmegaConf.load(conf_folder() / "groups" / "diagnosis.yaml")]
TOLERANCES = Tolerances(0.15, 0.15, 0.0003, 0.00025, 0.0, 0.0, 0.0, 0.15)


def fitted(robot, values):
    """The data sheet refitted, with these values."""
    model = Model(planar_parameters(robot, {}), 0.0, first_noise(robot, np.ones(4, bool)))
    always = always_free(TOLERANCES, model.planar, 1)
    return FittedHypothesis((), Fit(model.put(values), always, 0.0, None, np.zeros(8)), np.ones(4), 0.0)


@pytest.mark.parametrize("field", [*DATA_SHEET, *WHEELS])
@pytest.mark.parametrize("end", ["low", "high"])
def test_a_value_of_the_data_sheet_at_a_bound_is_told(paper, field, end):
    (free,) = [free for free in fitted(paper, {}).fit.free_parameters if free.field == field]
    effect, _, parameter = field.rpartition("_")
    expected = field if field in WHEELS else f"{effect}.{parameter}"
    assert fitted(paper, {}).at_bound == ()
    assert [free.name for free in fitted(paper, {field: getattr(free, end)}).at_bound] == [expected]
    assert fitted(paper, {field: 0.9 * getattr(free, end) + 0.1 * free.mean}).at_bound == ()


@pytest.mark.parametrize("preset", PRESETS)
def test_a_value_is_beyond_its_tolerance_before_it_is_at_its_bound(preset):
    with composing():
        settings = instantiate(compose("diagnose", ["episodes=e", f"diagnosis={preset}"]).diagnosis)
    assert settings.thresholds.max_shift * settings.tolerances.data_sheet < 0.95 * (1.0 - LOWEST)


@pytest.mark.parametrize("ratio", [0.05, 0.5, 1.0, 2.0])
def test_the_equivalent_gain_is_booton_s_of_gaussian_commands(paper, ratio):
    commands = np.random.default_rng(1).normal(0.0, 1.0, 100_000)
    inside = erf(ratio / np.sqrt(2))
    saturated = planar_parameters(paper, {"torque_saturation": {"limit": ratio}, "torque_gain": {"gain": 0.7}})
    dead = planar_parameters(paper, {"dead_zone": {"width": ratio}})
    assert equivalent_gain(saturated, commands) == pytest.approx(inside, abs=0.01)
    assert equivalent_gain(dead, commands) == pytest.approx(1.0 - inside, abs=0.01)
    assert equivalent_gain(planar_parameters(paper, {}), commands) == pytest.approx(1.0)


@pytest.mark.parametrize(("start", "is_stuck"), [(0.1, True), (8.0, False)])
def test_a_saturation_that_nearly_all_commands_exceed_is_no_value(paper, start, is_stuck):
    data = Data([synthetic_recording(paper, {}, seed=51, periods=300)], 10)
    (saturation,) = [c for c in candidates_for(paper) if c.name == "torque_saturation"]
    kept = tuple(p._replace(low=0.9 * start, high=1.1 * start, none=1e9) for p in saturation.parameters)
    model = Model(planar_parameters(paper, {}), 0.0, first_noise(paper, data.sensed))
    model = model.put({"torque_saturation_limit": start})
    found = fit_hypothesis(
        data, model, always_free(TOLERANCES, model.planar, 1), [saturation._replace(parameters=kept)], 0
    )
    assert found.overriding == ("torque_saturation",) * is_stuck
    if is_stuck:
        assert "torque_saturation.limit" in [free.name for free in found.at_bound]


@pytest.mark.parametrize(("value", "reached"), [(0.0105, True), (0.05, False), (0.15, False), (20.0, False)])
def test_a_limit_near_a_low_bound_is_there_only_where_the_bound_itself_is_near(value, reached):
    free = FreeParameter("torque_saturation_limit", 0.01, 20.0, 20.0, np.inf, 1e-6)
    assert is_at_bound(free, value) == reached


def test_what_has_no_ends_or_may_lie_at_them_has_no_bounds(paper):
    """All of the wheels' inertia may turn with the rotors, as behind a high gear ratio; no gap is that wide."""
    free_parameters = {free.name: free for candidate in candidates_for(paper) for free in candidate.free_parameters}
    for name in ("backlash.rotor_share", "cogging.phase"):
        assert not is_at_bound(free_parameters[name], free_parameters[name].high)
    for name in ("backlash.gap", "cogging.torque", "rotor_inertia.share", "wheel_slip.creep"):
        assert is_at_bound(free_parameters[name], free_parameters[name].high)


@pytest.mark.parametrize(("strength", "share"), [(0.5, 1.0), (1.0, 1.0), (50.0, np.sqrt(1.0 / 50.0))])
def test_usual_torques_of_motors_that_are_too_strong_for_the_weight_are_less(paper, strength, share):
    """Ranges stay, and sizes that are no torques. The strength: the torque limit over what holds the robot level."""
    robot = replace(paper, torque_limit=strength * paper.body_mass * 9.81 * paper.com_height)
    scale = robot.torque_limit / paper.torque_limit
    before, after = ({c.name: c.parameters[0] for c in candidates_for(each)} for each in (paper, robot))
    for name in ("coulomb_friction", "viscous_friction", "dead_zone"):
        usual = before[name].start / np.sqrt(min(paper.body_mass * 9.81 * paper.com_height / paper.torque_limit, 1.0))
        assert after[name].start == pytest.approx(share * scale * usual)
        assert after[name].high == pytest.approx(scale * before[name].high)
    for name in ("gyro_scale", "cable_spring", "actuation_delay"):
        assert after[name].start == before[name].start


def test_a_candidate_that_is_taken_away_leaves_nothing_behind(paper):
    """A limit at the upper end of its range is no such thing: a slew limit still takes 2 ms for a step of 4 N·m."""
    data = Data([synthetic_recording(paper, {}, seed=2, periods=200)], 10)
    model = Model(planar_parameters(paper, {}), 0.0, first_noise(paper, np.ones(4, bool)))
    kalman = data.filter(model)
    plain = data.white(model, kalman)
    for candidate in candidates_for(paper):
        np.testing.assert_array_equal(data.white(model.put(candidate.none), kalman), plain, candidate.name)


def test_a_set_that_diverges_has_an_infinite_cost_and_no_small_autocorrelation(paper, monkeypatch):
    data = Data([synthetic_recording(paper, {}, seed=3, periods=300)], 10)
    model = Model(planar_parameters(paper, {}), 0.0, first_noise(paper, data.sensed))
    (friction,) = (each for each in candidates_for(paper) if each.name == "viscous_friction")
    errors = Data.errors
    monkeypatch.setattr(Data, "errors", lambda self, *of: [np.nan * each for each in errors(self, *of)])
    found = fit_hypothesis(data, model, always_free(TOLERANCES, model.planar, 1), [friction], 0)
    assert (found.bic, found.autocorrelation) == (np.inf, np.inf)
