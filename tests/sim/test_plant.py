import pickle
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from twbal.core.engine import substeps
from twbal.core.errors import ConfigError, DataError
from twbal.core.start_pose import InitialState, StartPose
from twbal.core.streams import Stream, generator
from twbal.effects.actuation_delay import ActuationDelay
from twbal.effects.coulomb_friction import CoulombFriction
from twbal.effects.dead_zone import DeadZone
from twbal.effects.effect import assemble
from twbal.effects.flexible_frame import FlexibleFrame
from twbal.effects.motor_lag import MotorLag
from twbal.effects.sensor_noise import SensorNoise
from twbal.effects.wheel_slip import WheelSlip
from twbal.planar.planar_plant import PlanarPlant
from twbal.sim.bullet_plant import SimPlant
from twbal.sim.restart_state import RestartState
from twbal.sim.world import World

START = StartPose(-0.17, 0.02, 0.1, 0.1)
NOISE = SensorNoise(tilt=0.003, tilt_rate=0.02, acceleration=0.3, wheel_angle=0.001, wheel_rate=0.05, yaw_rate=0.02)
STATEFUL = [ActuationDelay(0.025), MotorLag(0.02), DeadZone(0.5), CoulombFriction(0.1), NOISE]


def plant(robot, effects=(), start=START, physics_step=0.001, seed=0):
    return SimPlant(robot=robot, effects=effects, start=start, physics_step=physics_step, seed=seed)


def drive(simulated, trial, commands):
    seen = [simulated.reset(trial)]
    seen += [simulated.step(u) for u in commands]
    return np.array(seen)


COMMANDS = 4 * np.sin(np.arange(15))


@pytest.mark.parametrize("effects", [(), STATEFUL], ids=["none", "stateful"])
def test_a_trial_is_the_same_bits_whatever_ran_before(paper, effects):
    with plant(paper, effects) as used, plant(paper, effects) as other, plant(paper, effects) as fresh:
        for trial in (0, 3, 1):
            drive(used, trial, 5 * COMMANDS[: 5 + trial])
        drive(used, 4, np.full(100, 8.0))  # until it lies on the floor
        other.reset(7)
        expected = drive(fresh, 2, COMMANDS)
        assert np.array_equal(drive(used, 2, COMMANDS), expected)
        assert np.array_equal(drive(used, 2, COMMANDS), expected)


def test_two_robots_in_one_process_do_not_meet(paper, regbot):
    with plant(paper) as alone:
        expected = drive(alone, 0, COMMANDS)
    with plant(regbot) as small, plant(paper) as big:
        small.reset(0)
        seen = [big.reset(0)]
        for u in COMMANDS:
            small.step(0.02 * u)
            seen.append(big.step(u))
    assert np.array_equal(np.array(seen), expected)


def test_trials_and_seeds_differ(paper):
    with plant(paper, seed=0) as one, plant(paper, seed=1) as other:
        tilts = {one.reset(0).tilt, one.reset(1).tilt, other.reset(0).tilt, other.reset(1).tilt}
    assert len(tilts) == 4


def test_the_first_observation_is_the_drawn_start(regbot):
    with plant(regbot, seed=5) as simulated:
        seen = simulated.reset(2)
    initial = START.draw(generator(Stream.START_POSE, 5, 2))
    assert seen.tilt == pytest.approx(initial.tilt, abs=1e-12)
    assert seen.tilt_rate == pytest.approx(initial.tilt_rate, abs=1e-12)
    assert regbot.wheel_radius * (seen.wheel_rate + seen.tilt_rate) == pytest.approx(initial.speed, abs=1e-9)
    assert (seen.time, seen.acceleration, seen.wheel_angle, seen.yaw_rate) == (0, 0, 0, 0)


def test_wheels_roll_without_slip_and_acceleration_is_the_change_of_speed(paper):
    with plant(paper) as simulated:
        seen = drive(simulated, 0, COMMANDS[:5])
    speed = paper.wheel_radius * (seen[:, 5] + seen[:, 2])
    np.testing.assert_allclose(seen[1:, 3], np.diff(speed) / paper.control_period, atol=5e-3)
    np.testing.assert_allclose(np.diff(seen[:, 0]), paper.control_period, rtol=1e-12)


def test_positive_command_drives_the_wheels_forward_and_the_body_back(paper):
    with plant(paper, start=StartPose(0, 0, 0, 0)) as simulated:
        seen = drive(simulated, 0, [3.0] * 5)[-1]
    assert seen[2] < 0 < seen[3]
    assert seen[1] < 0 < seen[4]


def test_commands_are_cut_at_the_torque_limit(paper):
    with plant(paper) as simulated:
        assert np.array_equal(drive(simulated, 0, [1e6, -1e6]), drive(simulated, 0, [20, -20]))


@pytest.mark.parametrize("kind", [SimPlant, PlanarPlant])
@pytest.mark.parametrize("command", [np.nan, np.inf, -np.inf])
def test_a_command_that_is_no_finite_torque_is_refused_and_harms_nothing(paper, kind, command):
    settings = {"robot": paper, "effects": (), "start": START, "physics_step": 0.001, "seed": 0}
    with kind(**settings) as simulated, kind(**settings) as fresh:
        simulated.reset(0)
        simulated.step(1.0)
        with pytest.raises(DataError, match="must be a finite torque"):
            simulated.step(command)
        assert np.array_equal(simulated.step(2.0), drive(fresh, 0, [1.0, 2.0])[-1])
        assert np.array_equal(drive(simulated, 1, COMMANDS), drive(fresh, 1, COMMANDS))


def test_a_world_whose_robot_was_lost_begins_anew(paper):
    """A motion that is no number any more stays in its rollout; PyBullet itself would let the robot fall for good."""
    model, initial = assemble(paper, []), InitialState(0.05, 0.0, 0.0)
    nothing = model.start(0.001, np.random.default_rng(0))
    lost, fresh = World(model, 0.001), World(model, 0.001)
    lost.reset(initial)
    lost.advance(np.nan, nothing, 3)
    assert np.isnan(lost.motion().tilt)
    for world in (lost, fresh):
        world.reset(initial)
        world.advance(1.0, nothing, 50)
    assert lost.motion() == fresh.motion()
    for world in (lost, fresh):
        world.close()


def test_a_wheel_that_spins_gets_as_fast_as_the_torque_makes_it(paper):
    """On ice, the torque τ turns both wheels of the inertia I_w alone, at τ t / 2 I_w: to 240 rad/s and more."""
    torque, seconds = 20.0, 0.3
    model = assemble(paper, [WheelSlip(0.005)])
    world, nothing = World(model, 0.001), model.start(0.001, np.random.default_rng(0))
    for _ in range(2):  # what PyBullet saves does not bring its own bound back
        world.reset(InitialState(0.0, 0.0, 0.0))
        world.advance(torque, nothing, round(seconds / 0.001))
        motion = world.motion()
        free = torque * seconds / (2 * paper.wheel_inertia)
        assert motion.wheel_rate + motion.tilt_rate == pytest.approx(free, rel=0.01)
    assert free > 200.0
    world.close()


def test_numbers_of_numpy_make_the_same_robot(paper):
    """PyBullet would read `np.float64(0.1)` in a robot's file as no number, and wheels without inertia stand still."""
    numbers = {"body_mass": np.float64(paper.body_mass), "wheel_inertia": np.float64(paper.wheel_inertia)}
    frame = [FlexibleFrame(*map(np.float64, (0.3, 8.0, 0.1, 1.5)))]
    with plant(replace(paper, **numbers), frame) as one, plant(paper, [FlexibleFrame(0.3, 8.0, 0.1, 1.5)]) as other:
        assert np.array_equal(drive(one, 0, COMMANDS), drive(other, 0, COMMANDS))


def test_it_keeps_straight_ahead_and_on_the_ground(paper):
    with plant(paper) as simulated:
        seen = drive(simulated, 0, COMMANDS)
    assert np.abs(seen[:, 6]).max() < 1e-5


def test_halving_the_physics_step_changes_little(paper):
    with plant(paper) as coarse, plant(paper, physics_step=0.0005) as fine:
        gap = np.abs(drive(coarse, 0, COMMANDS[:8]) - drive(fine, 0, COMMANDS[:8])).max(0)
    assert 0 < gap[1] < 1e-3
    assert gap[2] < 1e-2


def test_a_physics_step_that_rolls_wrongly_is_refused(paper):
    with pytest.raises(ConfigError, match=r"at most 0.001 s; found 0.002 s"):
        plant(paper, physics_step=0.002)


def test_a_recipe_for_a_plant_travels_between_processes(paper):
    recipe = partial(SimPlant, robot=paper, effects=STATEFUL, start=START, physics_step=0.001, seed=3)
    with recipe() as here, pickle.loads(pickle.dumps(recipe))() as there:
        assert np.array_equal(drive(here, 1, COMMANDS), drive(there, 1, COMMANDS))


def test_closing_twice_is_safe(paper):
    simulated = plant(paper)
    simulated.reset(0)
    simulated.stop()
    simulated.close()
    simulated.close()


def test_the_true_pose_is_where_wheels_that_roll_have_brought_the_axle(paper):
    """Without slip and noise odometry tells it to 0.2 %, which halves with the physics step.

    The sensors' noise does not reach the pose.
    """
    swing = 3 * np.sin(0.4 * np.arange(15))
    with plant(paper) as quiet, plant(paper, [NOISE]) as noisy:
        for simulated in (quiet, noisy):
            simulated.reset(1)
            assert simulated.pose()[:3] == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
        for u in swing:
            seen, _ = quiet.step(u), noisy.step(u)
            assert quiet.pose() == noisy.pose()
            assert quiet.pose().tilt == pytest.approx(seen.tilt)
            rolled = paper.wheel_radius * (seen.wheel_angle + seen.tilt - quiet_start(paper))
            assert quiet.pose().x == pytest.approx(rolled, rel=2e-3, abs=2e-4)
            assert quiet.pose()[1:3] == pytest.approx((0.0, 0.0), abs=1e-6)
    assert abs(rolled) > 0.02


def quiet_start(paper):
    """Wheel angle + tilt at the start of trial 1."""
    with plant(paper) as simulated:
        seen = simulated.reset(1)
    return seen.wheel_angle + seen.tilt


def test_the_heading_of_a_pose_is_how_far_it_has_turned_to_the_left(paper):
    model = assemble(paper, [])
    world = World(model, 0.001)
    world.reset(InitialState(0.0, 0.0, 0.0))
    world.resume(RestartState(wheel_angle=0.0, yaw_rate=2.0), 0.0)
    turned = 0.0
    for _ in range(100):
        world.advance(0.0, model.start(0.001, np.random.default_rng(0)), 1)
        turned += 0.001 * world.motion().yaw_rate
    assert world.pose().heading == pytest.approx(turned, rel=1e-3)
    assert turned > 0.1
    world.close()


@pytest.mark.parametrize("period", [0.0166667, 0.0143, 0.05000000074505806])
def test_the_physics_step_is_an_upper_bound(paper, period):
    """A bound of a millisecond is the same to the bit as the longest step that divides the period."""
    robot = replace(paper, control_period=period)

    def after(step):
        with plant(robot, physics_step=step) as simulated:
            return drive(simulated, 0, [1.0, -1.0, 2.0])[-1]

    assert np.array_equal(after(0.001), after(period / substeps(period, 0.001)))
