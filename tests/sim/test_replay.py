"""A replay from the middle of a rollout goes on as the rollout did."""

from dataclasses import replace

import numpy as np
import pytest
from hydra import compose
from hydra.utils import instantiate

from twbal.cli.composition import composing
from twbal.core.errors import DataError
from twbal.core.plant import Observation
from twbal.core.start_pose import InitialState, StartPose
from twbal.effects.actuation_delay import ActuationDelay
from twbal.effects.backlash import Backlash
from twbal.effects.backlash_behind_encoder import BacklashBehindEncoder
from twbal.effects.battery_sag import BatterySag
from twbal.effects.cable_spring import CableSpring
from twbal.effects.cogging import Cogging
from twbal.effects.coulomb_friction import CoulombFriction
from twbal.effects.effect import assemble
from twbal.effects.flexible_frame import FlexibleFrame
from twbal.effects.friction_feedforward import FrictionFeedforward
from twbal.effects.gear_efficiency import GearEfficiency
from twbal.effects.ground_slope import GroundSlope
from twbal.effects.gyro_bias import GyroBias
from twbal.effects.gyro_scale import GyroScale
from twbal.effects.imu_delay import ImuDelay
from twbal.effects.library import values_of
from twbal.effects.motor_lag import MotorLag
from twbal.effects.periodic_disturbance import PeriodicDisturbance
from twbal.effects.presliding import Presliding
from twbal.effects.rolling_resistance import RollingResistance
from twbal.effects.rotor_inertia import RotorInertia
from twbal.effects.stribeck_friction import StribeckFriction
from twbal.effects.tilt_filter import TiltFilter
from twbal.effects.torque_saturation import TorqueSaturation
from twbal.effects.viscous_friction import ViscousFriction
from twbal.effects.wheel_slip import WheelSlip
from twbal.planar.constants import constants
from twbal.planar.parameters import planar_parameters
from twbal.planar.planar_plant import PlanarPlant, drive_on, standing
from twbal.planar.planar_state import PlanarState
from twbal.planar.sensing import imu_settled
from twbal.sim.bullet_plant import SimPlant
from twbal.sim.gears import Gears
from twbal.sim.replay import ReplayStart, replay
from twbal.sim.restart_state import RestartState
from twbal.sim.world import World
from twbal.sysid.kalman_predictor import STATE_COLUMNS
from twbal.sysid.open_loop import EARLIEST, predict_open_loop
from twbal.sysid.recording import Recording

STEP = 0.001
SEEN = [Observation._fields.index(name) for name in ("tilt", "tilt_rate", "wheel_angle", "wheel_rate")]
COMMANDS = 6.0 * np.sin(np.arange(24))
FROM = 9
KINDS = {
    "nothing": [],
    "delay": [ActuationDelay(0.033)],
    "lag": [MotorLag(0.05)],
    "battery": [BatterySag(0.3)],
    "cogging": [Cogging(0.4, 12.0, 0.3)],
    "cable": [CableSpring(40.0)],
    "slope": [GroundSlope(0.05)],
    "disturbance": [PeriodicDisturbance(8.0, 2.0, 0.4)],
    "late IMU": [ImuDelay(0.033)],
    "filtered tilt": [TiltFilter(3.0, 0.02)],
    "filtered tilt of a gyro with errors": [TiltFilter(3.0, 0.02), GyroScale(1.1), GyroBias(0.05)],
    "filtered and late tilt": [TiltFilter(3.0, 0.02), ImuDelay(0.033)],
    "backlash": [Backlash(0.02)],
    "backlash of light rotors": [Backlash(0.02, 0.2)],
    "backlash of gears that bend": [Backlash(0.02, 0.5, 0.006, 0.3)],
    "backlash behind the encoder": [BacklashBehindEncoder(0.02, 0.5)],
}
SENSORS = ImuDelay | TiltFilter | GyroScale | GyroBias


@pytest.fixture(scope="module")
def robot():
    with composing():
        return instantiate(compose("sim_collect").robot)


def driven(robot, effects, commands=COMMANDS):
    """The observations of a rollout."""
    start = StartPose(-0.02, 0.0, 0.0, 0.0)
    with SimPlant(robot=robot, effects=effects, start=start, physics_step=STEP, seed=0) as plant:
        return np.array([plant.reset(0), *(plant.step(u) for u in commands)])


def start_at(robot, truth, t, commands=COMMANDS):
    """The start that a perfect filter would find, with the rotors in the middle of a backlash."""
    _, tilt, rate, _, angle, wheel_rate, _ = truth[t]
    r = robot.wheel_radius
    rolled = r * (truth[:, 4] + truth[:, 1] - truth[0, 4] - truth[0, 1])
    initial = InitialState(tilt, rate, r * (wheel_rate + rate))
    past = np.column_stack([truth[:t, [1, 2]], r * (truth[:t, 5] + truth[:t, 2])])
    return ReplayStart(initial, RestartState(angle, position=rolled[t], x=rolled[t]), commands[:t], past)


@pytest.mark.parametrize("kind", KINDS)
def test_a_replay_goes_on_as_the_rollout_did(kind, robot):
    effects = KINDS[kind]
    truth = driven(robot, [effect for effect in effects if not isinstance(effect, SENSORS)])
    shown = driven(robot, effects)
    (found,) = replay(robot, effects, STEP, [start_at(robot, truth, FROM)], COMMANDS[None, FROM:])
    error, moved = found[:, SEEN] - shown[FROM:, SEEN], np.ptp(shown[FROM:, SEEN], axis=0)
    if "backlash" in kind:  # rotors that meet rigid gears at other instants differ in single rates
        assert (np.sqrt(np.mean(error**2, axis=0)) < 0.1 * moved).all()
    else:
        assert (np.abs(error).max(axis=0) < 0.01 * moved).all()


@pytest.mark.parametrize("kind", ["nothing", "delay", "saturation", "viscous friction"])
def test_commands_of_parts_of_a_period_act_as_those_of_a_faster_loop(kind, robot):
    kinds = {**KINDS, "saturation": [TorqueSaturation(3.0)], "viscous friction": [ViscousFriction(0.3)]}
    fast, commands = replace(robot, control_period=robot.control_period / 4), 6.0 * np.sin(np.arange(96.0))
    truth = driven(fast, kinds[kind], commands)
    start = start_at(fast, truth, 4 * FROM, commands)
    parts = replace(start, past_commands=commands[: 4 * FROM].reshape(-1, 4))
    (found,) = replay(robot, kinds[kind], STEP, [parts], commands[None, 4 * FROM :].reshape(1, -1, 4))
    error, moved = found[:, SEEN] - truth[4 * FROM :: 4, SEEN], np.ptp(truth[:, SEEN], axis=0)
    assert (np.abs(error).max(axis=0) < 1e-3 * moved).all()


def test_rotors_that_turn_with_the_gears_feel_friction_from_the_first_step_on(regbot):
    effects = [RotorInertia(0.96), ViscousFriction(0.0034), CoulombFriction(0.022)]
    commands = np.full(24, 0.12)
    truth = driven(regbot, effects, commands)
    (found,) = replay(regbot, effects, STEP, [start_at(regbot, truth, FROM, commands)], commands[None, FROM:])
    error = np.abs(found[:, SEEN] - truth[FROM:, SEEN]).max(axis=0)
    assert (error < 0.002 * np.ptp(truth[FROM:, SEEN], axis=0)).all()


def test_wheels_that_slip_go_on_slipping(robot):
    """The truth is the world itself, which knows its speed over ground."""
    model = assemble(robot, [WheelSlip(0.1)])
    world, effect_state = World(model, STEP), model.start(STEP, np.random.default_rng(0))
    world.reset(InitialState(0.3, 0.0, 0.0))
    motions = [world.motion()]
    for _ in range(12):
        world.advance(8.0, effect_state, round(robot.control_period / STEP))
        motions.append(world.motion())
    world.close()
    at = motions[6]
    rolling = robot.wheel_radius * (at.wheel_rate + at.tilt_rate)
    slips = at.speed - rolling
    assert abs(slips) > 0.2 * abs(rolling)
    initial, past = InitialState(at.tilt, at.tilt_rate, at.speed), np.zeros((0, 3))
    starts = [ReplayStart(initial, RestartState(at.wheel_angle, slip=s), np.full(6, 8.0), past) for s in (slips, 0.0)]
    slipping, gripping = replay(robot, [WheelSlip(0.1)], STEP, starts, np.full((2, 6), 8.0))
    truth = np.array([[m.tilt, m.tilt_rate, m.wheel_angle, m.wheel_rate] for m in motions[6:]])
    moved = np.ptp(truth, axis=0)
    assert (np.abs(slipping[:, SEEN] - truth).max(axis=0) < 0.02 * moved).all()
    assert (np.abs(gripping[:, SEEN] - truth).max(axis=0) > 0.05 * moved)[3]


def test_a_robot_that_turns_goes_on_turning(robot):
    """Nearly upright, nothing slows its turning, and the wheels' mean rolls as before."""
    straight = ReplayStart(InitialState(0.01, 0.0, 0.3), RestartState(1.0), np.zeros(0), np.zeros((0, 3)))
    turning = replace(straight, restart=RestartState(1.0, heading=0.3, yaw_rate=1.2))
    before, after = replay(robot, [], STEP, [straight, turning], np.zeros((2, 5)))
    yaw = Observation._fields.index("yaw_rate")
    assert np.abs(before[:, yaw]).max() < 1e-3
    np.testing.assert_allclose(after[:, yaw], 1.2, rtol=0.01)
    assert (np.abs(after - before)[:, SEEN] < 0.05 * np.abs(before).max(axis=0)[SEEN]).all()


@pytest.mark.parametrize("friction", [CoulombFriction(0.4), RollingResistance(0.4)])
def test_friction_that_has_grown_goes_on_from_there(robot, friction):
    """What it has come to is told by the planar model, under commands that it nearly holds."""
    effects, commands = [friction, Presliding(0.02)], 0.6 * np.sin(0.7 * np.arange(24.0))
    truth = driven(robot, effects, commands)
    start = StartPose(-0.02, 0.0, 0.0, 0.0)
    with PlanarPlant(robot=robot, effects=effects, start=start, physics_step=STEP, seed=0) as plant:
        plant.reset(0)
        for command in commands[:FROM]:
            plant.step(float(command))
        state = plant._state
    without = start_at(robot, truth, FROM, commands)
    grown = {"joints": (state.left_joint, state.right_joint), "ground": (state.left_ground, state.right_ground)}
    remembering = replace(without, restart=without.restart._replace(**grown))
    held = commands[None, FROM:]
    found = replay(robot, effects, STEP, [remembering, without], np.repeat(held, 2, axis=0))
    errors = np.abs(found[:, :, SEEN] - truth[FROM:, SEEN]).max(axis=1)
    moved = np.ptp(truth[FROM:, SEEN], axis=0)
    assert (errors[0] < 0.02 * moved).all()
    assert (errors[1] > 5.0 * errors[0]).all()


def test_poles_that_the_wheels_meet_apart_cancel(robot):
    """With the wheels a quarter of a pole ahead and behind, one pulls as hard as the other pushes."""
    start = start_at(robot, driven(robot, []), FROM)
    heading = 0.5 * np.pi / 12 * robot.wheel_radius / (0.5 * robot.track)
    apart = replace(start, restart=start.restart._replace(heading=heading))
    held = COMMANDS[None, FROM : FROM + 6]
    none, cogging = (replay(robot, effects, STEP, [apart], held) for effects in ([], [Cogging(0.4, 12.0, 0.3)]))
    (together,) = replay(robot, [Cogging(0.4, 12.0, 0.3)], STEP, [start], held)
    least = np.abs(cogging[0] - none[0])[:, SEEN].max()
    assert least < 0.02 * np.abs(together - none[0])[:, SEEN].max()


def test_a_robot_turns_as_it_was_measured_to(robot):
    """Poles of both wheels move against each other as it turns; the planar model takes the turning for known."""
    effects, periods = [Cogging(1.0, 12.0, 0.3)], 12
    yaw_rates = 1.5 * np.sin(0.4 * np.arange(EARLIEST + periods + 1))
    commands = 2.0 * np.cos(np.arange(EARLIEST + periods))
    seen = np.ones(4, dtype=bool)
    ride = Recording(
        "ride",
        robot.control_period,
        commands,
        np.zeros((len(yaw_rates), 4)),
        yaw_rates,
        np.ones(len(yaw_rates), dtype=bool),
        seen,
    )
    states = np.zeros((len(yaw_rates), STATE_COLUMNS))
    start, off = np.array([EARLIEST]), np.zeros((1, 8))
    planar = planar_parameters(robot, values_of(effects))
    substeps = round(robot.control_period / STEP)
    expected = predict_open_loop(planar, ride, substeps, states, start, off, periods, np.inf).readings[0]
    restart = RestartState(0.0, heading=float(ride.heading[EARLIEST]))
    free = ReplayStart(InitialState(0.0, 0.0, 0.0), restart, np.zeros(EARLIEST), np.zeros((0, 3)))
    turned = replace(free, yaw_rates=yaw_rates[EARLIEST:])
    held = np.repeat(commands[None, EARLIEST:], 2, axis=0)
    found, straight = replay(robot, effects, STEP, [turned, free], held)[:, 1:][:, :, SEEN]
    moved = np.ptp(expected, axis=0)
    assert (np.abs(found - expected).max(axis=0) < 0.02 * moved).all()
    assert (np.abs(straight - expected).max(axis=0) > 0.1 * moved).any()


TURNING = {
    "friction by the rate of each wheel": [StribeckFriction(0.05, 0.4, 2.0)],
    "friction that bends first": [StribeckFriction(0.05, 0.4, 2.0), Presliding(0.005)],
    "rolling resistance": [RollingResistance(0.1)],
    "slope": [GroundSlope(0.08)],
}


def turned(robot, effects, commands, rate, turning):
    """Courses of a robot that turns: in the physics engine, there without turning, and of the planar model."""
    periods = len(commands)
    yaw_rates, held = np.full(EARLIEST + periods + 1, turning), np.concatenate([np.zeros(EARLIEST), commands])
    measured, known = np.zeros((len(yaw_rates), 4)), np.ones(len(yaw_rates), dtype=bool)
    ride = Recording("ride", robot.control_period, held, measured, yaw_rates, known, np.ones(4, dtype=bool))
    states = np.zeros((len(yaw_rates), STATE_COLUMNS))
    states[:, PlanarState._fields.index("wheel_speed")] = rate
    planar, start, off = planar_parameters(robot, values_of(effects)), np.array([EARLIEST]), np.zeros((1, 8))
    substeps = round(robot.control_period / STEP)
    expected = predict_open_loop(planar, ride, substeps, states, start, off, periods, np.inf).readings[0]
    restart = RestartState(0.0, heading=float(ride.heading[EARLIEST]), yaw_rate=turning)
    initial = InitialState(0.0, 0.0, robot.wheel_radius * rate)
    turns = ReplayStart(initial, restart, np.zeros(EARLIEST), np.zeros((0, 3)), yaw_rates[EARLIEST:])
    straight = replace(turns, yaw_rates=np.zeros(periods + 1), restart=restart._replace(yaw_rate=0.0))
    found, alike = replay(robot, effects, STEP, [turns, straight], np.array([commands, commands]))[:, 1:][:, :, SEEN]
    return found, alike, expected


@pytest.mark.parametrize("kind", TURNING)
def test_a_robot_that_turns_moves_as_the_planar_model_says(robot, kind):
    turning = 1.5 if kind == "slope" else 0.8
    apart = 0.5 * robot.track * turning / robot.wheel_radius
    rate = 0.5 * apart if kind == "rolling resistance" else apart + 2.0  # else no wheel rolls backward
    found, alike, expected = turned(robot, TURNING[kind], np.full(20, 0.3), rate, turning)
    off, moved = np.abs(found - expected).max(axis=0), np.ptp(expected, axis=0)
    assert (off < 0.03 * moved).all()
    assert (np.abs(alike - expected).max(axis=0) > 5.0 * off).all()


IN_THE_GEARS = {
    "cogging": [Backlash(0.05, 0.4), Cogging(0.3, 12.0, 0.5)],
    "a loss of torque": [Backlash(0.05, 0.4), GearEfficiency(0.5)],
}


@pytest.mark.parametrize("beside", IN_THE_GEARS)
def test_what_is_beside_play_acts_where_the_planar_model_has_it(robot, beside):
    """Torques of the joints act on the wheels, whatever the play."""
    commands, step = [2.0] * 3 + [-2.0] * 3, 1e-4
    settings = {"robot": robot, "effects": IN_THE_GEARS[beside], "start": StartPose(0.0, 0.0, 0.0, 0.0), "seed": 0}
    courses = []
    for simulation in (PlanarPlant, SimPlant):
        with simulation(physics_step=step, **settings) as plant:
            courses.append(np.array([plant.reset(0), *(plant.step(u) for u in commands)])[:, SEEN])
    moved = np.ptp(courses[0], axis=0)
    assert (np.abs(courses[1] - courses[0]).max(axis=0) < 0.05 * moved).all()


def test_rotors_behind_play_have_their_share_of_geared_rotors_too(robot):
    """Rotors sit on the motors' side of the play: as much of the geared inertia as there can be is there.

    Of 0.9 of the wheels' inertia, 0.4 is behind the play, which is all of that; 0.5 turns with the wheels' side, and
    0.1 is the wheels' own. With all 0.9 on the wheels' side, of which that has but 0.6, the wheels would have -0.3.
    """
    effects = [Backlash(0.03, 0.4), RotorInertia(0.9)]
    planar = constants(planar_parameters(robot, values_of(effects)), STEP)
    gears, whole = Gears(assemble(robot, effects), STEP), 2 * robot.wheel_inertia
    assert gears._rotors._play.rotors == pytest.approx(planar.play.rotors)
    assert planar.play.rotors == pytest.approx(0.4 * whole)
    assert planar.geared_rotors == gears._carried == 1.0
    assert planar.geared == pytest.approx(gears._coupling) == pytest.approx(0.5 * whole)


def test_what_firmware_adds_to_wheels_that_turn_opposite_ways_cancels(robot):
    """One motor is helped forward and the other backward; only where both turn the same way is the robot pushed."""
    firmware = [FrictionFeedforward(1.0, 0.5)]
    spinning = ReplayStart(InitialState(0.0, 0.0, 0.0), RestartState(0.0, yaw_rate=1.5), np.zeros(0), np.zeros((0, 3)))
    rolling = replace(spinning, initial=InitialState(0.0, 0.0, 0.4), restart=RestartState(0.0))
    nudged = replace(spinning, initial=InitialState(0.0, 0.0, 0.02))
    turned, pushed, other = replay(robot, firmware, STEP, [spinning, rolling, nudged], np.zeros((3, 6)))[:, :, SEEN]
    straight = replay(robot, firmware, STEP, [replace(nudged, restart=RestartState(0.0))], np.zeros((1, 6)))[0, :, SEEN]
    moved = np.ptp(pushed[:, 1])
    assert moved > 0.1
    assert np.ptp(turned[:, 1]) < 0.05 * moved
    assert np.ptp(other[:, 1]) < 0.3 * np.ptp(straight[1])  # a little more forward than backward


def test_a_robot_that_looks_across_a_slope_stands_on_level_ground(robot):
    start = ReplayStart(InitialState(0.02, 0.0, 0.0), RestartState(0.0), np.zeros(0), np.zeros((0, 3)))
    across, back = (replace(start, restart=RestartState(0.0, heading=turn)) for turn in (0.5 * np.pi, np.pi))
    held = np.zeros((1, 8))
    (level,) = replay(robot, [], STEP, [start], held)
    (aside,) = replay(robot, [GroundSlope(0.05)], STEP, [across], held)
    (down,) = replay(robot, [GroundSlope(0.05)], STEP, [back], held)
    (fall,) = replay(robot, [GroundSlope(-0.05)], STEP, [start], held)
    moved = np.ptp(down, axis=0)[SEEN]
    assert (np.abs(aside - level)[:, SEEN].max(axis=0) < 0.03 * moved).all()
    assert (np.abs(down - fall)[:, SEEN].max(axis=0) < 0.01 * moved).all()


def test_a_replay_with_another_effect_goes_another_way(robot):
    truth = driven(robot, [])
    start = start_at(robot, truth, FROM)
    late, prompt = (replay(robot, e, STEP, [start], COMMANDS[None, FROM:])[0] for e in ([ActuationDelay(0.02)], []))
    assert np.abs(late - prompt)[:, 1].max() > 20 * np.abs(prompt - truth[FROM:])[:, 1].max()


@pytest.mark.parametrize(
    "effects", [[MotorLag(0.05)], [ActuationDelay(0.033), BatterySag(0.3)], [TiltFilter(3.0, 0.02)]]
)
def test_replays_do_not_depend_on_those_before(effects, robot):
    """Later and earlier starts of one recording, one under other commands than were recorded, and another recording."""
    others = -COMMANDS
    truth, other = driven(robot, effects), driven(robot, effects, others)
    starts = [start_at(robot, truth, t) for t in (3, 7, 7, 5)] + [start_at(robot, other, 7, others)]
    held = [COMMANDS[3:9], COMMANDS[7:13], np.zeros(6), COMMANDS[5:11], others[7:13]]
    together = replay(robot, effects, STEP, starts, np.array(held))
    alone = [replay(robot, effects, STEP, [start], each[None])[0] for start, each in zip(starts, held, strict=True)]
    assert np.array_equal(together, alone)
    assert not np.array_equal(together[1], together[2])


def test_each_start_needs_its_commands(robot):
    truth = driven(robot, [])
    with pytest.raises(DataError, match="each of 1 starts; found 2"):
        replay(robot, [], STEP, [start_at(robot, truth, 3)], np.zeros((2, 4)))


def test_what_swings_on_the_body_goes_on_swinging(robot):
    """The planar model tells where the part that swings is in the middle of the rollout."""
    effects, substeps = [FlexibleFrame(0.1, 4.0, 0.02, 1.8)], round(robot.control_period / STEP)
    truth = driven(robot, effects)
    planar = planar_parameters(robot, values_of(effects))
    k = constants(planar, STEP)
    state = standing(k, -0.02, 0.0, 0.0, 0.0)
    imu = imu_settled(k, state, 2 * substeps)
    for n in range(FROM):
        state = drive_on(planar, k, state, COMMANDS, n, substeps, imu).state
    start = start_at(robot, truth, FROM)
    swinging = replace(start, restart=start.restart._replace(sway=state.sway, sway_rate=state.sway_rate))
    right, still = (replay(robot, effects, STEP, [s], COMMANDS[None, FROM:])[0] for s in (swinging, start))
    moved = np.ptp(truth[FROM:, SEEN], axis=0)
    assert (np.abs(right[:, SEEN] - truth[FROM:, SEEN]).max(axis=0) < 0.01 * moved).all()
    assert (np.abs(still[:, SEEN] - truth[FROM:, SEEN]).max(axis=0) > 0.03 * moved).any()


def test_an_encoder_behind_the_motor_shows_a_rotor_that_is_faster_than_its_wheel(robot):
    start = ReplayStart(
        InitialState(0.0, 0.0, 0.0),
        RestartState(0.3, rotor_ahead=0.01, rotor_faster=2.0),
        np.zeros(0),
        np.zeros((0, 3)),
    )
    shown, wheel = (
        replay(robot, [effect], STEP, [start], np.zeros((1, 1)))[0, :, SEEN]
        for effect in (BacklashBehindEncoder(0.1, 0.5), Backlash(0.1, 0.5))
    )
    assert shown[2:, 0] - wheel[2:, 0] == pytest.approx([0.01, 2.0], abs=1e-6)
    assert shown[2, 1] - shown[2, 0] == pytest.approx(2.0 * robot.control_period, rel=0.05)
