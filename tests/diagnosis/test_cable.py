"""A cable that is tied to a place, in recordings of a robot that turns and of one that does not."""

import numpy as np
import pytest
from hydra.utils import instantiate
from omegaconf import OmegaConf
from synthetic_recordings import NOISE, excitation, regulator, synthetic_recording

from twbal.cli.conf_folder import conf_folder
from twbal.diagnosis.effect_candidates import candidates_for
from twbal.diagnosis.filter_result import filter_recordings
from twbal.diagnosis.name import name_effects
from twbal.diagnosis.record import Verdict
from twbal.planar.actuation import EVEN
from twbal.planar.constants import constants
from twbal.planar.parameters import planar_parameters
from twbal.planar.planar_plant import hold, standing
from twbal.planar.planar_state import turning_at
from twbal.planar.sensing import imu_settled, read_sensors
from twbal.sysid.noise import NoiseModel
from twbal.sysid.recording import MEASURED, Recording

SETTINGS = instantiate(OmegaConf.load(conf_folder() / "groups" / "diagnosis.yaml").default)
CABLE = {"stiffness": 4.0, "anchor_x": 0.2, "anchor_y": -0.3}
TURN, SUBSTEPS = 0.5, 80  # largest yaw rate [rad/s]
ALIKE = ("cable_spring", "ground_slope", "com_offset", "gyro_scale", "rolling_viscous", "coulomb_friction")


def turning_recording(robot, effects, seed, periods):
    """A recording, at finer steps than the estimator's, of a robot that drives curves; and its places (T + 1, 2)."""
    rng, h = np.random.default_rng(seed), robot.control_period / SUBSTEPS
    planar = planar_parameters(robot, effects)
    k, time = constants(planar, h), robot.control_period * np.arange(periods + 1)
    yaw_rate = TURN * np.sin(2.0 * np.pi * time / 11.0) + TURN * np.sign(np.sin(2.0 * np.pi * time / 23.0)) / 2.0
    heading = np.concatenate([[0.0], np.cumsum(0.5 * robot.control_period * (yaw_rate[:-1] + yaw_rate[1:]))])
    levels = np.array([NOISE[name] for name in MEASURED])
    gain, (extra, speeds) = regulator(robot), excitation(robot, periods, rng)
    s, commands, rows, places = standing(k, 0.02, 0.0, 0.0, 0.0), np.zeros(periods), [], []
    imu = imu_settled(k, s, 2 * SUBSTEPS)
    for n in range(periods + 1):
        rows.append(np.array(read_sensors(planar, k, s, imu, n * SUBSTEPS, 0.0, 0.0)) + levels * rng.standard_normal(4))
        places.append([s.x, s.y])
        if n < periods:
            tilt, rate, _, wheel_rate = rows[-1]
            speed = robot.wheel_radius * (wheel_rate + rate)
            commands[n] = extra[n] - gain @ [tilt, rate, speed - speeds[n]]
            turning = turning_at(0.5 * (yaw_rate[n] + yaw_rate[n + 1]), heading[n])
            s = hold(planar, k, s, commands, n, SUBSTEPS, turning, imu, EVEN)
    usable = np.ones(periods + 1, bool)
    recording = Recording(
        f"turning {seed}", robot.control_period, commands, np.array(rows), yaw_rate, usable, np.ones(4, bool)
    )
    return recording, np.array(places)


@pytest.fixture(scope="module")
def turning(paper):
    return turning_recording(paper, {"cable_spring": CABLE}, seed=5, periods=1500)


def diagnose(robot, recordings):
    candidates = [each for each in candidates_for(robot) if each.name in ALIKE]
    return name_effects(recordings, robot, {}, candidates, SETTINGS)


def test_the_filter_follows_the_place_of_a_robot_that_turns(paper, turning):
    recording, places = turning
    levels = np.array([NOISE[name] for name in MEASURED])
    noise = NoiseModel(levels, np.array([0.01, 0.01]))
    found = filter_recordings(paper, {"cable_spring": CABLE}, noise, 0.0, [recording], 10).trajectories[0]
    assert np.ptp(places, axis=0).min() > 0.5
    np.testing.assert_allclose(np.column_stack([found.x, found.y]), places, atol=0.01)


def test_a_cable_is_found_with_its_place_where_the_robot_turns(paper, turning):
    found = diagnose(paper, [turning[0]])
    assert found.verdict is Verdict.NAMED
    (effect,) = found.named_effects
    assert effect.name == "cable_spring"
    for name, true in CABLE.items():
        estimate = effect.parameters[name]
        assert estimate.value == pytest.approx(true, abs=0.3 if name == "stiffness" else 0.05)
        assert estimate.low95 < true < estimate.high95


def test_the_place_beside_a_robot_that_never_turns_is_as_unsure_as_before(paper):
    recording = synthetic_recording(paper, {"cable_spring": {"stiffness": 4.0}}, seed=6, periods=1500)
    (effect,) = diagnose(paper, [recording]).named_effects
    assert effect.name == "cable_spring"
    assert effect.parameters["stiffness"].value == pytest.approx(4.0, rel=0.15)
    beside = effect.parameters["anchor_y"]
    assert beside.value == 0.0
    assert beside.high95 == -beside.low95 == pytest.approx(1.96 * 0.5, rel=0.01)
