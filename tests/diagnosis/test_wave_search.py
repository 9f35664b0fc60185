"""The search for waves: means over control periods against quadrature, and poles of wheels that are out of step."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from synthetic_recordings import COLUMNS, NOISE, UNSEEN, excitation, regulator

import twbal
from twbal.core.start_pose import StartPose
from twbal.diagnosis import wave_search
from twbal.diagnosis.effect_candidates import candidates_for
from twbal.diagnosis.wave_search import _Errors, _over_angle, _over_periods, _Waves, _within_periods, likeliest_wave
from twbal.effects.cogging import Cogging
from twbal.effects.library import effects_from
from twbal.planar.parameters import planar_parameters
from twbal.sim.bullet_plant import SimPlant
from twbal.sysid.model import Data, Model
from twbal.sysid.noise import NoiseModel
from twbal.sysid.prediction_error_fit import Fit
from twbal.sysid.recording import Recording


def test_waves_are_averaged_over_control_periods_and_both_wheels():
    """By 200 instants of a period and each wheel's own angle, for as many counts as a search tries together."""
    rng = np.random.default_rng(0)
    angles = np.cumsum(rng.uniform(-0.05, 0.1, 40))
    ahead = np.repeat(rng.uniform(-0.5, 0.5), 40)
    counts = np.arange(2.0, 6.0, 0.25)
    found = _over_periods(counts, _within_periods(angles), ahead, 2)
    shares = (np.arange(200) + 0.5) / 200
    between = angles[:-1, None] + shares * np.diff(angles)[:, None]
    for number, count in enumerate(counts):
        for part, wave in enumerate((np.sin, np.cos)):
            wheels = [wave(count * (between + sign * ahead[0])).mean(axis=1) for sign in (-1.0, 1.0)]
            np.testing.assert_allclose(found[:, part, number], np.mean(wheels, axis=0), atol=0.002)


def test_a_single_wave_needs_no_next_one():
    angles = np.linspace(0.0, 3.0, 11)
    found = _over_periods(np.ones(1), _within_periods(angles), np.zeros(11), 2)
    assert found.shape == (10, 2, 1)
    np.testing.assert_allclose(found[:, 0, 0], np.sin(0.5 * (angles[1:] + angles[:-1])), atol=0.005)


@pytest.mark.parametrize("grown", [np.inf, np.nan, 1e200])
def test_errors_that_grow_without_end_tell_of_no_wave(grown, monkeypatch):
    """A filter that does not hold them may be that of a fit which nothing else speaks against."""
    sums = np.full((2, 2), grown), np.full((2, 2, 2), grown * grown)
    monkeypatch.setattr(wave_search, "match_each", lambda *arguments: sums)
    waves = _Waves(0, [np.zeros(3)], [np.zeros(3)])
    linear = SimpleNamespace(F=None, C=None, B=np.zeros((2, 2)))
    errors = _Errors(linear, SimpleNamespace(gains=None, whiteners=None), [np.ones(3)], [np.ones((2, 4))])
    found = _over_angle(errors, waves, np.array([3.0, 4.0]))
    assert found.value == 3.0
    assert found.wave == 0.0


def turning_ride(robot, effects, periods=1200):
    """A ride in PyBullet that turns a third of a turn to each side and back."""
    gain, (extra, speeds) = regulator(robot), excitation(robot, periods, np.random.default_rng(3))
    yaw_rate = 0.9 * np.sin(0.01 * np.arange(periods + 1))
    noisy = [*effects, *effects_from({"sensor_noise": {**NOISE, **UNSEEN}})]
    rows, commands = [], []
    with SimPlant(robot=robot, effects=noisy, start=StartPose(0.0, 0.0, 0.0, 0.0), physics_step=0.001, seed=3) as plant:
        rows.append(plant.reset(0))
        for n, (torque, wanted) in enumerate(zip(extra, speeds, strict=True)):
            seen = rows[-1]
            speed = robot.wheel_radius * (seen.wheel_rate + seen.tilt_rate)
            commands.append(float(torque - gain @ [seen.tilt, seen.tilt_rate, speed - wanted]))
            plant._engine.turn_at(float(0.5 * (yaw_rate[n] + yaw_rate[n + 1])))
            rows.append(plant.step(commands[-1]))
    measured, all_count = np.array(rows)[:, COLUMNS], np.ones(periods + 1, dtype=bool)
    return Recording("ride", robot.control_period, np.array(commands), measured, yaw_rate, all_count, all_count[:4])


@pytest.mark.parametrize("off", [0.0, 0.06, -0.08])
def test_poles_of_wheels_that_turn_apart_are_found_where_the_track_is_not_known(paper, off):
    """Each wheel has a phase of its own, and the tyres touch the ground further apart, or less, than the sheet says."""
    (candidate,) = (each for each in candidates_for(paper) if each.name == "cogging")
    poles = {"torque": 0.15, "count": 14.0, "phase": 0.7, "difference": 2.4}
    made = turning_ride(replace(paper, track=(1.0 + off) * paper.track), [Cogging(**poles)])
    data = Data([made], 10)
    model = Model(planar_parameters(paper, {}), 0.0, NoiseModel(np.array([*NOISE.values()]), np.array([0.1, 0.1])))
    kalman = data.filter(model)
    found = likeliest_wave(data, Fit(model, (), 0.0, kalman, data.white(model, kalman)), candidate)
    assert found["cogging_count"] == pytest.approx(14.0, abs=0.25)
    assert found["cogging_turning"] == pytest.approx(off, abs=0.02)
    assert found["cogging_torque"] == pytest.approx(0.15, rel=0.3)
    ahead = np.angle(np.exp(1j * (found["cogging_difference"] - 2.4)))
    assert abs(ahead) < 0.6


@pytest.mark.parametrize("name", ["paper", "esp32"])
@pytest.mark.parametrize(
    ("effect", "size", "others"),
    [
        ("cogging", "torque", {"count": 14.0, "phase": 0.7, "difference": 2.4}),
        ("ground_waves", "slope", {"waves": 1.5, "phase": 0.5}),
    ],
)
def test_the_size_of_a_wave_is_found_on_a_heavy_and_on_a_light_robot(name, effect, size, others):
    """By how much a torque of 1 N·m would move a robot does not matter."""
    robot = twbal.robot(name)
    given = {size: 0.03 * robot.torque_limit if effect == "cogging" else 0.02, **others}
    (candidate,) = (each for each in candidates_for(robot) if each.name == effect)
    data = Data([turning_ride(robot, effects_from({effect: given}))], 10)
    levels = NoiseModel(np.array([*NOISE.values()]), np.full(2, 0.01 * robot.torque_limit))
    model = Model(planar_parameters(robot, {}), 0.0, levels)
    kalman = data.filter(model)
    found = likeliest_wave(data, Fit(model, (), 0.0, kalman, data.white(model, kalman)), candidate)
    assert found[f"{effect}_{size}"] == pytest.approx(given[size], rel=0.2)


def test_a_disturbance_is_found_in_a_recording_of_more_instants_than_frequencies():
    """Of 60 s at 200 Hz, all instants count, and neighbouring frequencies are as close as these tell them apart."""
    robot = replace(twbal.robot("paper"), control_period=0.005)
    force = {"force": 0.4, "frequency": 1.3, "phase": 0.7}
    made = turning_ride(robot, effects_from({"periodic_disturbance": force}), periods=12000)
    (candidate,) = (each for each in candidates_for(robot) if each.name == "periodic_disturbance")
    data = Data([made], 5)
    model = Model(planar_parameters(robot, {}), 0.0, NoiseModel(np.array([*NOISE.values()]), np.array([0.1, 0.1])))
    kalman = data.filter(model)
    found = likeliest_wave(data, Fit(model, (), 0.0, kalman, data.white(model, kalman)), candidate)
    assert found["periodic_disturbance_frequency"] == pytest.approx(1.3, abs=0.25 / 60.0)
    assert found["periodic_disturbance_force"] == pytest.approx(0.4, rel=0.2)


@pytest.mark.parametrize("effect", ["cogging", "ground_waves"])
def test_counts_are_tried_so_closely_that_a_long_way_misses_none(paper, effect):
    (candidate,) = (each for each in candidates_for(paper) if each.name == effect)
    angles = [np.linspace(0.0, 2.0 * np.pi * 30.0, 500), np.zeros(50)]
    grid = wave_search._grid(candidate.counter, 0.25, angles)
    assert np.diff(grid).max() <= 0.5 / 30.0 + 1e-12
    assert np.diff(wave_search._grid(candidate.counter, 0.25, [np.zeros(50)])).max() == pytest.approx(0.25)
