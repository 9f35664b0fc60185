from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hydra.utils import instantiate
from omegaconf import OmegaConf
from synthetic_recordings import synthetic_recording

from twbal.cli.conf_folder import conf_folder
from twbal.core.errors import ConfigError
from twbal.diagnosis import name as naming
from twbal.diagnosis.candidates import Candidate
from twbal.diagnosis.effect_candidates import candidates_for
from twbal.diagnosis.filter_result import filter_recordings
from twbal.diagnosis.name import name_effects
from twbal.diagnosis.record import GIVEN_EFFECTS, Verdict
from twbal.effects.library import library

SETTINGS = instantiate(OmegaConf.load(conf_folder() / "groups" / "diagnosis.yaml").default)
MISSING = {
    "actuation_delay": {"delay": 0.008},
    "backlash": {"gap": 0.02},
    "backlash_behind_encoder": {"gap": 0.02, "rotor_share": 0.5},
    "battery_sag": {"rate": 0.01},
    "cable_spring": {"stiffness": 3.0},
    "cogging": {"torque": 0.1, "count": 13.0, "phase": 1.0},
    "com_offset": {"angle": 0.01},
    "coulomb_friction": {"torque": 0.1},
    "dead_zone": {"width": 0.3},
    "eccentric_wheel": {"eccentricity": 0.005, "phase": 1.0},
    "flexible_frame": {"share": 0.05, "frequency": 6.0, "damping": 0.05, "height": 1.8},
    "friction_feedforward": {"torque": 0.1, "rate": 0.3},
    "gear_efficiency": {"loss": 0.1},
    "ground_slope": {"angle": 0.01},
    "ground_waves": {"slope": 0.004, "waves": 1.5, "phase": 0.5},
    "gyro_bias": {"rate": 0.02},
    "gyro_scale": {"factor": 1.05},
    "imu_delay": {"delay": 0.008},
    "imu_mount_angle": {"angle": -0.01},
    "motor_lag": {"time_constant": 0.01},
    "periodic_disturbance": {"force": 1.0, "frequency": 1.3, "phase": 2.0},
    "presliding": {"angle": 0.005},
    "quadratic_drag": {"coefficient": 4.0},
    "rolling_resistance": {"torque": 0.1},
    "rolling_viscous": {"coefficient": 0.02},
    "slew_limit": {"rate": 80.0},
    "stribeck_friction": {"torque": 0.1, "breakaway": 0.1, "rate": 1.0},
    "torque_saturation": {"limit": 4.0},
    "viscous_friction": {"coefficient": 0.02},
    "wheel_slip": {"friction": 0.16},
}


def diagnose(robot, recordings, effects=None, candidates=None):
    chosen = candidates_for(robot, tuple(MISSING)) if candidates is None else candidates
    return name_effects(recordings, robot, effects or {}, chosen, SETTINGS)


@pytest.fixture(scope="module")
def clean(paper):
    return diagnose(paper, [synthetic_recording(paper, {}, seed=11, periods=1000)])


def test_nothing_is_missing_where_nothing_is(clean):
    assert clean.verdict is Verdict.NONE
    assert clean.named_effects == ()
    assert dict(clean.named.effects) == dict(clean.refitted.effects)
    assert max(abs(shift.sigmas) for shift in clean.data_sheet) < 2.5


def test_errors_of_the_right_model_are_white_and_as_large_as_their_noise(clean):
    errors = clean.named.errors[0][20:]
    np.testing.assert_allclose(errors.std(axis=0), clean.named.error_noise, rtol=0.1)
    assert max(each.after for each in clean.autocorrelation) < 3


def test_a_missing_delay_is_named_with_its_value(paper):
    found = diagnose(paper, [synthetic_recording(paper, {"actuation_delay": {"delay": 0.008}}, seed=12, periods=1000)])
    assert found.verdict is Verdict.NAMED
    (effect,) = found.named_effects
    estimate = effect.parameters["delay"]
    assert effect.name == "actuation_delay"
    assert estimate.value == pytest.approx(0.008, rel=0.05)
    assert estimate.low95 < estimate.value < estimate.high95
    assert found.rivals[0].names == ("actuation_delay",)
    assert found.named.effects["actuation_delay"]["delay"] == pytest.approx(estimate.value, rel=0.01)


@pytest.mark.slow
def test_what_the_simulation_has_already_is_not_missed(paper):
    effects = {"actuation_delay": {"delay": 0.008}}
    found = diagnose(paper, [synthetic_recording(paper, effects, seed=12, periods=1000)], effects)
    assert found.verdict is Verdict.NONE
    assert found.named.effects["actuation_delay"]["delay"] == pytest.approx(0.008, rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("effect", ["coulomb_friction", "viscous_friction", "actuation_delay"])
def test_an_effect_that_the_simulation_has_too_small_is_said_to_be_so_and_corrected(paper, effect):
    ((parameter, size),) = MISSING[effect].items()
    given = {effect: {parameter: 0.75 * size}}
    found = diagnose(paper, [synthetic_recording(paper, {effect: MISSING[effect]}, seed=12, periods=1000)], given)
    assert found.verdict is Verdict.DATA_SHEET and found.named_effects == ()
    assert found.data_sheet_class == (GIVEN_EFFECTS,)
    assert found.data_sheet[0].name == f"{effect} {parameter}"
    assert found.data_sheet[0].factor == pytest.approx(1 / 0.75, rel=0.05)
    assert found.named.effects[effect][parameter] == pytest.approx(size, rel=0.05)


def test_what_no_candidate_explains_is_unknown(paper):
    recording = synthetic_recording(paper, {"com_offset": {"angle": 0.02}}, seed=13, periods=1000)
    innocent = [c for c in candidates_for(paper) if c.name in ("battery_sag", "imu_delay", "torque_gain")]
    assert diagnose(paper, [recording], candidates=innocent).verdict is Verdict.UNKNOWN


def test_what_settings_leave_out_is_said_where_nothing_explains_the_data(paper):
    recording = synthetic_recording(paper, {"com_offset": {"angle": 0.02}}, seed=13, periods=1000)
    names = ("battery_sag", "imu_delay", "torque_gain", "com_offset", "motor_lag")
    few = [c for c in candidates_for(paper) if c.name in names]
    settings = replace(SETTINGS, exclude=["motor_lag", "com_offset"])
    found = name_effects([recording], paper, {}, few, settings)
    assert found.verdict is Verdict.UNKNOWN
    assert "Not weighed, as the settings leave them out (diagnosis.exclude): com offset, motor lag." in found.advice


@pytest.mark.parametrize(
    ("bic", "at_bound", "is_worth_it"), [(-50.0, (), True), (float("inf"), (), False), (-50.0, ("torque",), False)]
)
def test_after_unknown_a_part_that_diverges_or_runs_to_a_bound_is_no_guess(bic, at_bound, is_worth_it, monkeypatch):
    sure, doubtful = (Candidate(name, (), (), (), "") for name in ("sure", "doubtful"))
    chosen = SimpleNamespace(effects=(sure, doubtful), at_bound=(), bic=-60.0)
    part = SimpleNamespace(effects=(sure,), at_bound=at_bound, bic=bic)
    monkeypatch.setattr(naming, "negligible", lambda *given: ())
    monkeypatch.setattr(naming, "without", lambda problem, whole, gone: part if gone is doubtful else whole)
    effects = [SimpleNamespace(name=n, probability=p) for n, p in (("sure", 0.9), ("doubtful", 0.2))]
    guess = naming._guess(SimpleNamespace(settings=SETTINGS), chosen, effects, [])
    assert guess is (part if is_worth_it else None)


def test_gears_with_an_efficiency_are_weighed_where_that_is_asked_for(paper):
    usual, asked = ({each.name for each in candidates_for(paper, names)} for names in ((), ("gear_efficiency",)))
    assert asked - usual == {"gear_efficiency"}
    with pytest.raises(ConfigError, match=r"no effect 'gears' to include; .* if asked: gear_efficiency\."):
        candidates_for(paper, ["gears"])
    left = naming._missing(candidates_for(paper), {}, replace(SETTINGS, exclude=["gear_efficiency", "dead_zone"]))
    assert usual - {each.name for each in left} == {"dead_zone"}


def test_what_acts_on_others_is_weighed_beside_them_alone(paper):
    (presliding,) = (each for each in candidates_for(paper) if each.name == "presliding")
    assert not presliding.may_stand_beside(("dead_zone",))
    assert presliding.may_stand_beside(("dead_zone", "coulomb_friction"))
    simulated = {"rolling_resistance": {"torque": 0.1}}
    (left,) = (c for c in naming._missing(candidates_for(paper), simulated, SETTINGS) if c.name == "presliding")
    assert left.may_stand_beside(())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effects", "group"),
    [
        ({"torque_gain": {"gain": 0.75}}, "gain, mass and inertia"),
        ({"com_height": {"factor": 1.25}}, "COM height and wheel radius"),
    ],
)
def test_a_data_sheet_that_is_off_is_called_so_with_its_class(paper, effects, group):
    found = diagnose(paper, [synthetic_recording(paper, effects, seed=14, periods=1000)])
    assert found.verdict is Verdict.DATA_SHEET
    assert found.data_sheet_class[0] == group


def test_a_robot_that_stands_still_tells_too_little(paper):
    found = diagnose(paper, [synthetic_recording(paper, {}, seed=15, periods=400, still=True)])
    assert found.verdict in (Verdict.UNDECIDED, Verdict.NONE)
    assert any("could be there" in sentence for sentence in found.advice)


@pytest.mark.slow
def test_several_recordings_are_one_body_of_data(paper):
    effects = {"coulomb_friction": {"torque": 0.1}}
    found = diagnose(paper, [synthetic_recording(paper, effects, seed=s, periods=300) for s in (16, 17, 18)])
    assert [effect.name for effect in found.named_effects] == ["coulomb_friction"]
    assert len(found.named.trajectories) == 3


def test_an_account_of_other_recordings_is_that_of_the_same_model(paper, clean):
    other = synthetic_recording(paper, {}, seed=19, periods=200)
    model = clean.named
    account = filter_recordings(paper, model.effects, model.noise, model.angle_lead, [other], SETTINGS.substeps)
    assert len(account.trajectories[0].tilt) == 201
    assert np.abs(account.trajectories[0].tilt - other.measured[:, 0]).std() < 0.005


NOT_YET = {"wheel_slip": "what is left after tyres that slip at times is coloured, so the verdict is unknown"}
EVERY = [
    pytest.param(name, marks=pytest.mark.xfail(strict=True, reason=NOT_YET[name])) if name in NOT_YET else name
    for name in MISSING
]


@pytest.mark.slow
@pytest.mark.parametrize("name", EVERY)
def test_every_effect_is_named_on_data_of_the_planar_model(paper, name):
    effects = {other: MISSING[other] for other in (*library()[name].acts_on[:1], name)}
    found = diagnose(paper, [synthetic_recording(paper, effects, seed=20)])
    assert found.verdict is Verdict.NAMED
    assert len(found.named_effects) == len(effects)
    assert all(any(one in (e.name, *e.equivalents) for e in found.named_effects) for one in effects)


@pytest.mark.slow
def test_two_effects_are_both_named(paper):
    effects = {name: MISSING[name] for name in ("dead_zone", "viscous_friction")}
    found = diagnose(paper, [synthetic_recording(paper, effects, seed=21)])
    assert {effect.name for effect in found.named_effects} == set(effects)


@pytest.mark.slow
def test_a_small_robot_is_diagnosed_as_a_large_one(regbot):
    light = replace(regbot)
    effects = {"coulomb_friction": {"torque": 0.005}}
    found = diagnose(light, [synthetic_recording(light, effects, seed=22)])
    assert [effect.name for effect in found.named_effects] == ["coulomb_friction"]
