"""Logs of one robot in MuJoCo whose battery and floor differ from log to log."""

import sys
from dataclasses import replace
from math import radians
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from diagnosis_settings import SETTINGS
from test_lost_commands import NOISE, USABILITY, driven
from test_real_logs import settings

import twbal
from twbal.diagnosis import pipeline
from twbal.diagnosis.candidates import always_free, log_offsets
from twbal.diagnosis.effect_candidates import candidates_for
from twbal.diagnosis.hypothesis import fit_hypothesis
from twbal.diagnosis.name import QUIETEST, first_noise, largest_noise, with_fitted_noise
from twbal.planar.parameters import planar_parameters
from twbal.sysid.held_out import Split
from twbal.sysid.intervals import interval, standard_errors
from twbal.sysid.model import Data, Model, Offsets
from twbal.sysid.prediction_error_fit import slopes_of
from twbal.sysid.recording import are_of_several_runs, read_recordings

sys.path.insert(0, str(Path(__file__).parents[1] / "virtual_robot"))
from conftest import conf, make  # noqa: F401 - fixtures

GAINS, SLOPES = (0.92, 1.08, 1.0), (0.7, 0.0, -0.7)
FRICTION, DELAY = 0.3, 0.02


@pytest.fixture
def logs(make, conf):  # noqa: F811
    """Three logs of a robot with dry friction and a delay, each with another battery and floor."""
    rubs = {"coulomb": FRICTION, "static": FRICTION, "bristle_stiffness": 1000.0, "bristle_damping": 4.0}

    def robot(seed, gain, slope):
        parts = {"drive": {"gain": (gain, gain), "delay": DELAY}, "surroundings": {"slope": radians(slope)}}
        return make("paper", start=0.02, seed=seed, friction=rubs, sensors={"noise": NOISE}, **parts)

    sheet = conf("robot/paper")
    return [
        driven(robot(seed, gain, slope), sheet, 0.0, seed=seed)[0]
        for seed, (gain, slope) in enumerate(zip(GAINS, SLOPES, strict=True))
    ]


def fitted(logs, sheet, several_runs):
    """The true set of effects, fitted; with the interval of the friction."""
    recordings = read_recordings(logs, [f"log {i}" for i, _ in enumerate(logs)], sheet, USABILITY)
    assert [recording.run for recording in recordings] == list(range(len(logs)))  # each log is a run of its own
    data = Data(recordings, 10, largest_noise(sheet), QUIETEST)
    planar = planar_parameters(sheet, {})
    start = Model(planar, 0.0, first_noise(sheet, data.sensed), (Offsets(),) * len(logs) if several_runs else ())
    start = start._replace(balanced=len(logs) if several_runs else 0)
    chosen = [c for c in candidates_for(sheet) if c.name in ("coulomb_friction", "actuation_delay")]
    free = always_free(settings("default").tolerances, planar, len(logs), several_runs)
    found = fit_hypothesis(data, with_fitted_noise(data, start), free, chosen, 6)
    errors = standard_errors(found.fit, slopes_of(data, found.fit), 20)
    names = [each.name for each in found.fit.free_parameters]
    at = names.index("coulomb_friction.torque")
    return found, interval(found.fit.values[at], errors[at])


def test_offsets_are_those_of_each_log_and_the_friction_is_that_of_all(logs, conf):  # noqa: F811
    sheet = conf("robot/paper")
    shared, _ = fitted(logs, sheet, several_runs=False)
    apart, (low, high) = fitted(logs, sheet, several_runs=True)
    offsets = apart.fit.model.apart.offsets
    torques, slopes = (np.array([getattr(each, kind) for each in offsets]) for kind in ("torque", "slope"))
    relative = (1.0 + torques) / np.mean(1.0 + torques)
    np.testing.assert_allclose(relative, GAINS, atol=0.015)
    np.testing.assert_allclose(np.degrees(slopes), SLOPES, atol=0.15)
    assert low < FRICTION < high
    _, (low_alone, high_alone) = fitted(logs[1:2], sheet, several_runs=False)  # the one on level ground
    assert high - low < high_alone - low_alone
    assert apart.fit.cost < shared.fit.cost - 500.0
    assert apart.autocorrelation < 0.5 * shared.autocorrelation


@pytest.mark.slow
def test_the_effects_of_all_logs_are_named_and_nothing_of_a_single_one(logs):
    quick = ["starts=4", "next_experiment=false", "free_form=false"]
    found = twbal.diagnose(logs, overrides=quick)
    assert {each.name for each in found.diagnosis.named_effects} == {"coulomb_friction", "actuation_delay"}
    truth = {"coulomb_friction": ("torque", FRICTION), "actuation_delay": ("delay", DELAY)}
    for each in found.diagnosis.named_effects:
        parameter, value = truth[each.name]
        assert each.parameters[parameter].low95 < value < each.parameters[parameter].high95
    in_first = found.findings.named.effects_in(0)
    assert in_first["ground_slope"]["angle"] == pytest.approx(radians(SLOPES[0]), abs=0.003)


def test_trials_of_one_run_share_battery_and_floor(logs, conf):  # noqa: F811
    trials = [replace(log, provenance=replace(log.provenance, trial=i)) for i, log in enumerate(logs)]
    read = read_recordings([*trials, *trials[:1]], ["a", "b", "c", "a again"], conf("robot/paper"), USABILITY)
    assert [recording.run for recording in read] == [0, 0, 0, 1]
    assert are_of_several_runs(read) and not are_of_several_runs(read[:3])
    kinds = {free.field.kind for free in log_offsets(SETTINGS.tolerances, 4, several_runs=True)}
    assert kinds == {"torque", "slope"} and not log_offsets(SETTINGS.tolerances, 3, several_runs=False)


def test_nothing_is_fitted_to_recordings_that_are_held_out_as_a_whole(logs, conf, monkeypatch):  # noqa: F811
    robot = conf("robot/paper")
    read = read_recordings(logs, ["a", "b", "c"], robot, USABILITY)
    asked = []
    monkeypatch.setattr(pipeline, "filter_recordings", lambda *arguments: asked.append(arguments))
    for are_ends in (False, True):
        split = Split(read[:2], read[2:], ("c",), are_ends)
        filtered = SimpleNamespace(effects={}, noise=None, angle_lead=0.0, offsets="as fitted")
        pipeline._seen_by(filtered, split, robot, SETTINGS)
    assert [arguments[-1] for arguments in asked] == [(), "as fitted"]
