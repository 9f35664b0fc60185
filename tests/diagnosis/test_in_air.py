"""Wheels that turn in the air, driven by a law of motion of their own: I φ'' = u / 2 - b φ' - c sign φ' each."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from diagnosis_settings import SETTINGS
from scipy.integrate import solve_ivp

from twbal.cli.main import main
from twbal.core.channels import Channels
from twbal.core.episode import Episode, Outcome, Provenance
from twbal.core.errors import DataError
from twbal.core.plant import Observation
from twbal.diagnosis.wheel_friction import _least_gain, _standard_error
from twbal.diagnosis.wheel_turns import turned_angle
from twbal.diagnosis.wheels_off_ground import held, held_upright, wheels_in_air
from twbal.io.logs import write_episode
from twbal.planar.constants import constants
from twbal.planar.parameters import planar_parameters
from twbal.planar.planar_plant import drive_on, standing
from twbal.planar.sensing import imu_settled

LIES = 3.05  # rad
SPEEDS = np.repeat([10.0, -6.0, 20.0, -15.0, 4.0], 60)  # rad/s that a controller holds for 0.9 s each


def spun(robot, speeds, coulomb=0.0, viscous=0.0034, strength=1.0, tilt=LIES):
    """A recording of wheels that a controller brings to speeds; its commands are seen with noise."""
    rng = np.random.default_rng(1)
    period, state, rows, commands = robot.control_period, np.array([0.0, speeds[0]]), [], []
    for k, wanted in enumerate([*speeds, 0.0]):
        count = 0.0133 * np.round(state[0] / 0.0133)
        rows.append(Observation(k * period, tilt, 0.0, 0.0, count, state[1] + 0.2 * rng.standard_normal(), 0.0))
        if k == len(speeds):
            break
        u = np.clip(0.004 * (wanted - state[1]) + 0.0068 * wanted + 0.02 * np.sign(wanted), -0.49, 0.49)

        def motion(_, y, u=u):
            friction = viscous * y[1] + coulomb * np.tanh(y[1] / 0.05)
            return y[1], (0.5 * strength * u - friction) / robot.wheel_inertia

        state = solve_ivp(motion, (0.0, period), state, rtol=1e-8, atol=1e-9).y[:, -1]
        commands.append(u + 0.003 * rng.standard_normal())
    observations = np.array(rows)
    channels = Channels(("tilt", "tilt_rate", "speed"), robot.wheel_radius)
    return Episode(
        channels=channels.names,
        control_period=period,
        observations=observations,
        states=channels.states(observations, np.array(commands)),
        commands=np.array(commands),
        outcome=Outcome.COMPLETED,
        provenance=Provenance(robot.name, "robot"),
    )


@pytest.fixture
def diagnosed(tmp_path, capsys):
    """Diagnose an episode at the command line."""

    def run(episode, *words):
        write_episode(tmp_path / "log.mcap", episode)
        out = tmp_path / "out"
        told = ["robot=regbot", "sim=regbot", "diagnosis=real_logs", f"hydra.run.dir={out}", *words]
        assert main(["diagnose", f"episodes={tmp_path / 'log.mcap'}", *told]) == 0
        return json.loads((out / "diagnosis.json").read_text()), capsys.readouterr().out

    return run


@pytest.mark.slow
def test_friction_is_named_from_several_speeds(regbot, diagnosed):
    found, said = diagnosed(spun(regbot, SPEEDS, coulomb=0.02))
    assert found["verdict"] == "named"
    (effect,) = found["effects"]
    estimate = effect["parameters"]["torque"]
    assert effect["name"] == "coulomb_friction"
    assert "viscous_friction" not in effect["equivalents"]
    assert estimate["low95"] < 0.02 < estimate["high95"] < 0.03
    assert "So would motors" not in said
    (gap,) = [g for g in found["gap"]["all"] if g["channel"] == "wheel_angle" and g["horizon"] == pytest.approx(0.3)]
    assert gap["closed"] > 0.8
    assert "in the air" in said


@pytest.mark.slow
def test_more_of_a_drag_that_is_there_already_is_named(regbot, diagnosed):
    found, _ = diagnosed(spun(regbot, SPEEDS, viscous=0.006))
    assert [effect["name"] for effect in found["effects"]] == ["viscous_friction"]
    estimate = found["effects"][0]["parameters"]["coefficient"]
    assert found["effects"][0]["equivalents"] == []
    assert estimate["low95"] < 0.006 < estimate["high95"]


@pytest.mark.slow
def test_one_steady_speed_tells_no_forms_apart(regbot, diagnosed):
    found, said = diagnosed(spun(regbot, np.full(170, 10.0), coulomb=0.02))
    (effect,) = found["effects"]
    assert {effect["name"], *effect["equivalents"]} == {"coulomb_friction", "viscous_friction", "dead_zone"}
    assert "both ways" in effect["separate_by"]
    assert "Each of these alone would do" in said


def test_nothing_is_named_where_nothing_is_missing(regbot, diagnosed):
    found, _ = diagnosed(spun(regbot, SPEEDS))
    assert found["verdict"] == "none"
    assert all(effect["probability"] < 0.5 for effect in found["effects"])


@pytest.mark.slow
def test_motors_far_off_their_data_sheet_are_said_to_do_as_well_as_drag(regbot, diagnosed):
    """At steady speeds weak motors are the same as more drag; the data sheet's tolerance speaks for drag."""
    found, said = diagnosed(spun(regbot, SPEEDS, strength=0.4))
    assert [effect["name"] for effect in found["effects"]] == ["viscous_friction"]
    (strength,) = map(float, re.findall(r"So would motors of (\S+) times the simulation's torque do", said))
    assert strength == pytest.approx(0.4, abs=0.03)


GAIN = "++sim.effects.torque_gain={_target_:twbal.effects.torque_gain.TorqueGain,gain:0.7}"


@pytest.mark.slow
def test_motors_as_strong_as_the_simulation_has_them_are_nothing_new(regbot, diagnosed):
    found, _ = diagnosed(spun(regbot, SPEEDS, strength=0.7), GAIN)
    assert found["verdict"] == "none"
    (shift,) = found["data_sheet"]
    assert shift["factor"] == pytest.approx(1.0, abs=0.03)


@pytest.mark.slow
def test_a_simulation_with_more_drag_than_robots_usually_have_is_diagnosed(regbot, diagnosed):
    strong = "sim.effects.viscous_friction.coefficient=0.02"
    found, _ = diagnosed(spun(regbot, 0.5 * SPEEDS, viscous=0.02), strong)
    assert found["verdict"] == "none"


@pytest.mark.slow
def test_a_control_period_of_no_whole_milliseconds_is_diagnosed(regbot, diagnosed, tmp_path, capsys):
    """And the simulation that is written down runs as it is."""
    period = "robot.control_period=0.0142857142857"
    found, _ = diagnosed(spun(replace(regbot, control_period=1 / 70), SPEEDS, coulomb=0.02), period)
    assert found["verdict"] == "named"
    words = ["robot=regbot", period, f"sim={tmp_path / 'out' / 'augmented.yaml'}", "rollouts=1", "steps=20"]
    assert main(["sim-collect", *words, f"hydra.run.dir={tmp_path / 'collected'}"]) == 0


def hung(robot, speeds):
    """A recording of a robot whose body hangs below its axle and rings as a pendulum while its wheels turn."""
    recording = spun(robot, speeds, tilt=np.pi)
    inertia = robot.body_inertia_pitch + robot.body_mass * robot.com_height**2
    stiffness = 9.81 * robot.body_mass * robot.com_height / inertia
    times = robot.control_period * np.arange(len(recording.observations))
    ring = solve_ivp(
        lambda t, y: (y[1], -stiffness * np.sin(y[0]) - 0.5 * y[1]), times[[0, -1]], [0.08, 0.0], t_eval=times
    ).y
    seen = recording.observations.copy()
    seen[:, 1:3] += ring.T
    return replace(recording, observations=seen)


def test_a_robot_that_hangs_below_its_axle_is_not_one_that_lies(regbot, tmp_path, capsys):
    hanging = hung(regbot, 0.2 * SPEEDS)
    assert np.ptp(np.quantile(hanging.observations[:, 1], [0.025, 0.975])) < 0.2
    with pytest.raises(DataError, match="hangs from its axle"):
        wheels_in_air([hanging], 0.7)
    assert wheels_in_air([spun(regbot, 0.2 * SPEEDS)], 0.7)
    write_episode(tmp_path / "log.mcap", hanging)
    told = ["robot=regbot", f"hydra.run.dir={tmp_path / 'out'}"]
    assert main(["diagnose", f"episodes={tmp_path / 'log.mcap'}", *told]) == 1
    assert "never upright (tilt 3.14 rad)" in capsys.readouterr().err


def test_too_short_a_recording_is_refused(regbot, tmp_path, capsys):
    write_episode(tmp_path / "log.mcap", spun(regbot, np.full(60, 10.0)))
    told = ["robot=regbot", f"hydra.run.dir={tmp_path / 'out'}"]
    assert main(["diagnose", f"episodes={tmp_path / 'log.mcap'}", *told]) == 1
    assert "Record for longer" in capsys.readouterr().err


def test_a_held_body_does_not_move_and_carries_nothing(regbot):
    sheet = held(regbot)
    assert sheet.body_inertia_pitch > 1e5 * regbot.wheel_inertia
    assert (sheet.body_mass + 2 * sheet.wheel_mass) * regbot.wheel_radius**2 < 0.01 * regbot.wheel_inertia


def test_a_robot_that_lies_still_is_told_from_one_that_stands_or_falls(regbot):
    lying = spun(regbot, np.full(60, 10.0))
    standing = spun(regbot, np.full(60, 10.0), tilt=0.01)
    falling = replace(lying, observations=lying.observations + np.linspace(0, 3, 61)[:, None] * np.eye(7)[1])
    assert wheels_in_air([lying, lying], 0.7)
    assert not wheels_in_air([lying, standing], 0.7)
    assert not wheels_in_air([falling], 0.7)
    assert not wheels_in_air([], 0.7)
    assert (held_upright(lying).tilt == 0.0).all()


@pytest.mark.parametrize("windows", [4, 6, 12, 40])
def test_intervals_of_few_windows_hold_as_often_as_those_of_many(windows):
    """Monte Carlo of a straight line whose slope is nearly known: the offset's interval, as a friction's is made."""
    rng = np.random.default_rng(windows)
    rates, slope_sd, held = np.linspace(1.0, 3.0, windows), 0.02, []
    for _ in range(2000):
        slope = slope_sd * rng.standard_normal()
        seen = slope * rates + 0.3 * rng.standard_normal(windows)
        prior = np.array([[1.0 / slope_sd, 0.0]])
        sigma = 0.3
        for _ in range(4):
            J = np.vstack([np.column_stack([rates, np.ones(windows)]) / sigma, prior])
            found = np.linalg.lstsq(J, np.append(seen / sigma, 0.0), rcond=None)[0]
            sigma = np.sqrt(np.mean((seen - found[0] * rates - found[1]) ** 2))
        held.append(abs(found[1]) < 1.96 * _standard_error(J))
    assert 0.93 < np.mean(held) < 0.985


@pytest.mark.parametrize("windows", [12, 40])
def test_chance_alone_gains_enough_as_often_as_a_false_alarm_may_be(windows):
    """By regressions of white errors on the motors' strength and on each of three forms of drag."""
    likely = replace(SETTINGS.thresholds, false_alarm_probability=0.1)
    least = _least_gain(windows, replace(SETTINGS, thresholds=likely, temperature=1.0))
    rng, alarms, draws = np.random.default_rng(8), 0, 3000
    strength, *forms = rng.normal(size=(4, windows))

    def misfit(y, *regressors):
        left = y - np.stack(regressors, axis=1) @ np.linalg.lstsq(np.stack(regressors, axis=1), y, rcond=None)[0]
        return windows * np.log(left @ left)

    for y in rng.normal(size=(draws, windows)):
        gain = misfit(y, strength) - min(misfit(y, strength, form) for form in forms)
        alarms += gain - np.log(windows) > least
    assert 0.06 < alarms / draws < 0.1 + 3.0 * np.sqrt(0.09 / draws)


@pytest.mark.parametrize("kind", ["backlash", "backlash_behind_encoder"])
def test_wheels_turn_by_what_their_encoders_show(paper, kind):
    planar, commands, substeps = planar_parameters(paper, {kind: {"gap": 0.1, "rotor_share": 0.3}}), np.full(6, 0.5), 10
    k = constants(planar, paper.control_period / substeps)
    state = standing(k, 0.0, 0.0, 0.0, 0.2)
    imu = imu_settled(k, state, 2 * substeps)
    for n in range(6):
        state, shown = drive_on(planar, k, state, commands, n, substeps, imu)
    turned = turned_angle(planar, k, commands, 0, 6, substeps, 0.2, 0.0)
    assert turned == pytest.approx(shown.wheel_angle, abs=1e-12)
    assert abs(state.rotor - state.wheel) > 0.01  # so that the side on which an encoder sits matters
