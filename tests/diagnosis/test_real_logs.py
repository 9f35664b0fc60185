"""What logs of real robots bring: no gyro, another offset in each log, many effects at once, coarse sensors."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hydra import compose
from hydra.utils import instantiate
from synthetic_recordings import synthetic_recording

from twbal.cli.composition import composing
from twbal.cli.main import main
from twbal.diagnosis.candidates import always_free
from twbal.diagnosis.constancy import inconstant_effects
from twbal.diagnosis.effect_candidates import candidates_for
from twbal.diagnosis.hypothesis import fit_hypothesis
from twbal.diagnosis.name import name_effects
from twbal.diagnosis.record import Verdict
from twbal.io.importers.smoother import smooth
from twbal.io.importers.tilt_by_gyro import tilt_by_gyro
from twbal.planar.parameters import planar_parameters
from twbal.sysid.model import Data, Model
from twbal.sysid.noise import NoiseModel

FRICTION = {"coulomb_friction": {"torque": 0.1}}
NOISE = NoiseModel(np.array([0.0035, 0.02, 0.002, 0.05]), np.array([0.01, 0.01]))


def settings(choice, *more):
    with composing():
        return instantiate(compose("diagnose", ["episodes=e", f"diagnosis={choice}", *more]).diagnosis)


def without_rates(recording):
    """The recording of a robot without gyro and without wheel rates: they are worked out of the angles."""
    measured = recording.measured.copy()
    for angle, rate in ((0, 1), (2, 3)):
        measured[:, rate] = smooth(measured[:, angle], recording.period).rate
    return replace(recording, measured=measured, sensed=np.array([True, False, True, False]))


@pytest.mark.slow
def test_friction_is_named_without_a_gyro(paper):
    recording = without_rates(synthetic_recording(paper, FRICTION, seed=31, periods=1000))
    found = name_effects([recording], paper, {}, candidates_for(paper), settings("default"))
    assert found.verdict is Verdict.NAMED
    (effect,) = found.named_effects
    estimate = effect.parameters["torque"]
    assert "coulomb_friction" in (effect.name, *effect.equivalents)
    assert estimate.low95 < 0.1 < estimate.high95
    assert [each.channel for each in found.autocorrelation] == ["tilt", "wheel_angle"]
    assert set(found.noise) == {"tilt", "wheel_angle"}


@pytest.mark.slow
def test_friction_and_delay_are_named_without_a_tilt_as_surely_as_with_one(paper):
    true = {**FRICTION, "actuation_delay": {"delay": 0.02}, "gyro_bias": {"rate": 0.05}}
    whole = synthetic_recording(paper, true, seed=37, periods=1000)
    measured = whole.measured.copy()
    measured[:, 0] = tilt_by_gyro({"tilt_rate": measured[:, 1]}, whole.period)
    without = replace(whole, measured=measured, sensed=np.array([False, True, True, True]))
    widths = []
    for recording in (whole, without):
        found = name_effects([recording], paper, {}, candidates_for(paper), settings("default"))
        assert {effect.name for effect in found.named_effects} == set(true)
        sizes = {effect.name: next(iter(effect.parameters.values())) for effect in found.named_effects}
        for name, values in true.items():
            assert sizes[name].low95 < next(iter(values.values())) < sizes[name].high95
        widths.append([sizes[name].high95 - sizes[name].low95 for name in true])
    assert widths[1] == pytest.approx(widths[0], rel=0.3)


@pytest.mark.slow
def test_nothing_is_missed_of_a_clean_robot_without_a_gyro(paper):
    recording = without_rates(synthetic_recording(paper, {}, seed=32, periods=1000))
    found = name_effects([recording], paper, {}, candidates_for(paper), settings("default"))
    assert found.verdict in (Verdict.NONE, Verdict.UNDECIDED)


@pytest.mark.slow
def test_the_tilt_may_be_off_by_another_constant_in_each_log(paper):
    offsets = (0.03, -0.02)
    recordings = []
    for seed, offset in zip((33, 34), offsets, strict=True):
        recording = synthetic_recording(paper, FRICTION, seed=seed, periods=600, tolerance=0.0)
        recordings.append(replace(recording, measured=recording.measured + offset * np.eye(4)[0]))
    plain = settings("default")
    told = replace(plain, tolerances=replace(plain.tolerances, tilt_offset=0.03))
    found = name_effects(recordings, paper, {}, candidates_for(paper), told)
    assert [effect.name for effect in found.named_effects] == ["coulomb_friction"]
    assert [each.tilt for each in found.named.offsets] == pytest.approx(offsets, abs=0.002)
    assert [each.tilt for each in found.nominal.offsets] == pytest.approx(offsets, abs=0.01)


def test_no_sensor_is_finer_than_its_steps(paper):
    recording = synthetic_recording(paper, {}, seed=35, periods=1000)
    fine = Data([recording], 10).resolution
    assert (fine < 0.5 * NOISE.sensors).all()
    step = 0.05
    measured = recording.measured.copy()
    measured[:, 2] = step * np.round(measured[:, 2] / step)
    assert Data([replace(recording, measured=measured)], 10).resolution[2] == pytest.approx(step / np.sqrt(12))


@pytest.mark.parametrize(("candidate", "is_steady"), [("coulomb_friction", True), ("viscous_friction", False)])
def test_an_effect_of_the_wrong_form_is_not_of_one_size(paper, candidate, is_steady):
    data = Data([synthetic_recording(paper, FRICTION, seed=36, periods=1000)], 10)
    always = always_free(settings("default").tolerances, planar_parameters(paper, {}), 1)
    (chosen,) = [c for c in candidates_for(paper) if c.name == candidate]
    weighed = fit_hypothesis(data, Model(planar_parameters(paper, {}), 0.0, NOISE), always, [chosen], 6)
    found = inconstant_effects(data, weighed, 0.3)
    assert (found == ()) is is_steady
    if not is_steady:
        assert ("viscous_friction", "speed") in [(each.effect, each.axis) for each in found]
        assert all(each.share < 0 for each in found if each.axis == "speed")  # less for each rad/s, where they are many


def test_a_negative_size_is_larger_where_it_is_further_from_none(paper):
    halves = [
        synthetic_recording(paper, {"com_offset": {"angle": angle}}, seed=41 + k, periods=400)
        for k, angle in enumerate((-0.01, -0.03))
    ]
    first, second = halves
    measured = np.concatenate([first.measured, second.measured[1:]])
    joined = replace(
        first,
        commands=np.concatenate([first.commands, second.commands]),
        measured=measured,
        yaw_rate=np.zeros(len(measured)),
        usable=np.ones(len(measured), bool),
    )
    data = Data([joined], 10)
    always = always_free(settings("default").tolerances, planar_parameters(paper, {}), 1)
    (chosen,) = [c for c in candidates_for(paper) if c.name == "com_offset"]
    fitted = fit_hypothesis(data, Model(planar_parameters(paper, {}), 0.0, NOISE), always, [chosen], 6)
    shares = [each.share for each in inconstant_effects(data, fitted, 0.3) if each.axis == "time"]
    assert shares and shares[0] > 0.5


@pytest.mark.slow
def test_many_effects_at_once_are_found_with_their_values(paper):
    hidden = {
        "actuation_delay": {"delay": 0.03},
        "dead_zone": {"width": 0.8},
        "coulomb_friction": {"torque": 0.4},
        "com_offset": {"angle": 0.05},
    }
    recordings = [synthetic_recording(paper, hidden, seed=s, periods=250) for s in (37, 38)]
    found = name_effects(recordings, paper, {}, candidates_for(paper), settings("default"))
    assert found.verdict is Verdict.NAMED
    values = {effect.name: next(iter(effect.parameters.values())).value for effect in found.named_effects}
    assert set(hidden) <= set(values)
    for name, parameters in hidden.items():
        assert values[name] == pytest.approx(next(iter(parameters.values())), rel=0.2)


FOLDER = Path(__file__).resolve().parents[3] / "shared" / "measured" / "regbot"
LOGS = sorted(FOLDER.glob("test[34]*.txt"))
IN_AIR = sorted(FOLDER.glob("test0*.txt"))


@pytest.mark.slow
@pytest.mark.skipif(not IN_AIR, reason="the logs of the real robot are not here")
def test_wheels_in_the_air_tell_the_same_friction_and_no_more(tmp_path):
    imported, out = tmp_path / "imported", tmp_path / "out"
    assert main(["import-log", "import=regbot", f"files={IN_AIR[0]}", "robot=regbot", f"hydra.run.dir={imported}"]) == 0
    words = ["robot=regbot", "sim=regbot", "diagnosis=real_logs", f"hydra.run.dir={out}"]
    assert main(["diagnose", f"episodes={imported}", *words]) == 0
    found = json.loads((out / "diagnosis.json").read_text())
    (effect,) = found["effects"]
    assert {effect["name"], *effect["equivalents"]} == {"coulomb_friction", "viscous_friction", "dead_zone"}
    estimate = effect["parameters"]["torque"]
    assert estimate["low95"] < 0.0229 < estimate["high95"]  # of the upright logs


@pytest.mark.slow
@pytest.mark.skipif(not LOGS, reason="the logs of the real robot are not here")
@pytest.mark.parametrize("log", LOGS, ids=lambda path: path.stem[:6])
def test_the_real_robots_friction_is_named_on_each_log_alone(log, tmp_path):
    imported, out = tmp_path / "imported", tmp_path / "out"
    robot = ["robot=regbot", f"hydra.run.dir={imported}"]
    assert main(["import-log", "import=regbot", f"files={log}", *robot]) == 0
    words = ["robot=regbot", "sim=regbot", "diagnosis=real_logs", f"hydra.run.dir={out}"]
    assert main(["diagnose", f"episodes={imported}", *words]) == 0
    found = json.loads((out / "diagnosis.json").read_text())
    assert found["verdict"] == "named"
    (named,) = [effect for effect in found["effects"] if effect["is_named"]]
    assert named["name"] == "coulomb_friction"
    estimate = named["parameters"]["torque"]
    assert estimate["low95"] < 0.0229 < estimate["high95"]  # between what each of the two logs says
    gaps = [gap for gap in found["gap"]["all"] if gap["channel"] == "wheel_angle"]
    (path,) = [gap for gap in gaps if gap["horizon"] == pytest.approx(0.15)]
    assert path["after"] < 0.5 * path["before"]
    assert path["after"] < path["refitted"]


@pytest.mark.skipif(not LOGS, reason="the logs of the real robot are not here")
@pytest.mark.parametrize("log", LOGS, ids=lambda path: path.stem[:6])
def test_the_import_of_a_real_log_raises_no_false_alarm(log, tmp_path, capsys):
    words = ["import=regbot", f"files={log}", "robot=regbot", f"hydra.run.dir={tmp_path}"]
    assert main(["import-log", *words]) == 0
    assert "WARNING" not in capsys.readouterr().out


def friction_of_a_wheel(effect):
    """The torque of Coulomb friction, or of a dead zone, which is that of both wheels."""
    if effect["name"] == "coulomb_friction":
        return effect["parameters"]["torque"]
    assert effect["name"] == "dead_zone" and "coulomb_friction" in effect["equivalents"]
    return {end: 0.5 * effect["parameters"]["width"][end] for end in ("value", "low95", "high95")}


@pytest.mark.slow
@pytest.mark.skipif(len(LOGS) < 2, reason="the logs of the real robot are not here")
def test_the_real_robots_friction_is_found_on_both_logs_together_and_nothing_absurd_with_it(tmp_path):
    found = {}
    for name, logs in {"one": LOGS[:1], "other": LOGS[1:], "both": LOGS}.items():
        imported, out = tmp_path / f"imported_{name}", tmp_path / name
        files = ",".join(f"'{log}'" for log in logs)
        robot = ["robot=regbot", f"hydra.run.dir={imported}"]
        assert main(["import-log", "import=regbot", f"files=[{files}]", *robot]) == 0
        words = ["robot=regbot", "sim=regbot", "diagnosis=real_logs", f"hydra.run.dir={out}"]
        assert main(["diagnose", f"episodes={imported}", *words]) == 0
        found[name] = json.loads((out / "diagnosis.json").read_text())
    named = {name: [effect for effect in each["effects"] if effect["is_named"]] for name, each in found.items()}
    assert all(len(effects) == 1 for effects in named.values())
    torque = {name: friction_of_a_wheel(effects[0]) for name, effects in named.items()}
    width = {name: each["high95"] - each["low95"] for name, each in torque.items()}
    assert width["both"] < min(width["one"], width["other"])
    for each in ("one", "other"):
        assert torque["both"]["low95"] < torque[each]["value"] < torque["both"]["high95"]
    for each in found.values():
        assert max(abs(shift["sigmas"]) for shift in each["data_sheet"]) < 2.0
        (path,) = [
            gap
            for gap in each["gap"]["all"]
            if gap["channel"] == "wheel_angle" and gap["horizon"] == pytest.approx(0.15)
        ]
        assert path["after"] <= 0.25 * path["before"]
