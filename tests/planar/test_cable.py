"""A cable that is tied to a place: the planar model against an integrator of its own and against the physics engine."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from twbal.core.robot_model import AxleMotion
from twbal.core.robot_parameters import GRAVITY
from twbal.core.start_pose import InitialState
from twbal.effects.cable_spring import CableSpring
from twbal.effects.effect import assemble
from twbal.planar.actuation import EVEN
from twbal.planar.constants import constants
from twbal.planar.motion import step
from twbal.planar.parameters import planar_parameters
from twbal.planar.planar_plant import hold
from twbal.planar.planar_state import PlanarState, turning_at
from twbal.planar.sensing import imu_settled
from twbal.sim.replay import ReplayStart, replay
from twbal.sim.restart_state import RestartState
from twbal.sim.world import World

CABLE = {"stiffness": 30.0, "anchor_x": 0.2, "anchor_y": -0.3}
REST = PlanarState(*(0.0,) * len(PlanarState._fields))


def test_it_pulls_towards_its_place_and_not_across_the_heading():
    cable, (x, y), heading = CableSpring(**CABLE), (0.7, 0.4), 0.9
    ahead = np.array([np.cos(heading), np.sin(heading)])
    at = AxleMotion(5.0, 0.0, 0.0, 100.0, x=x, y=y, cosine=ahead[0], sine=ahead[1])
    pull = 30.0 * (np.array([0.2, -0.3]) - [x, y])
    assert cable.push(1.0, at) == pytest.approx(1.0 + pull @ ahead)


def on_the_plane(robot, yaw_rate, start, torque, seconds):
    """x, y, tilt and speed of a robot on a cable whose heading changes at a constant rate."""
    m, l, r = robot.body_mass, robot.com_height, robot.wheel_radius
    a, b = (m + 2 * robot.wheel_mass) * r**2 + 2 * robot.wheel_inertia, m * l * r
    c = robot.body_inertia_pitch + m * l**2
    turn = robot.body_inertia_roll - robot.body_inertia_yaw + m * l**2

    def motion(t, z):
        x, y, tilt, speed, rate = z
        ahead = np.array([np.cos(yaw_rate * t), np.sin(yaw_rate * t)])
        pull = 30.0 * (np.array([0.2, -0.3]) - [x, y]) @ ahead
        forces = [
            b * np.sin(tilt) * (rate**2 + yaw_rate**2) + torque(t) + r * pull,
            m * GRAVITY * l * np.sin(tilt) + turn * yaw_rate**2 * np.sin(tilt) * np.cos(tilt) - torque(t),
        ]
        spin, lean = np.linalg.solve([[a, b * np.cos(tilt)], [b * np.cos(tilt), c]], forces)
        return [*(speed * ahead), rate, r * spin, lean]

    return solve_ivp(motion, (0, seconds), start, rtol=1e-9, atol=1e-11).y[:4, -1]


@pytest.mark.parametrize("tyres", [{}, {"wheel_slip": {"friction": 10.0}}])
def test_a_robot_that_turns_follows_mechanics_and_errs_in_proportion_to_the_step(paper, tyres):
    yaw_rate, seconds, speed = 2.5, 0.4, 0.8
    truth = on_the_plane(paper, yaw_rate, [0.0, 0.0, 0.05, speed, 0.0], lambda t: 2.0 * np.sin(15.0 * t), seconds)
    gaps, planar = [], planar_parameters(paper, {"cable_spring": CABLE, **tyres})
    for h in (1e-3, 5e-4):
        k, s = constants(planar, h), REST._replace(tilt=0.05, wheel_speed=speed / paper.wheel_radius)
        for i in range(round(seconds / h)):
            s = step(planar, k, s, 2.0 * np.sin(15.0 * (i + 0.5) * h), i * h, turning_at(yaw_rate, i * h * yaw_rate))
        gaps.append(np.array([s.x, s.y, s.tilt, paper.wheel_radius * s.wheel_speed]) - truth)
    assert abs(truth[1]) > 0.05
    assert np.abs(gaps[1]).max() < 2e-3
    big = np.abs(gaps[0]) > 1e-4
    assert (gaps[0] / gaps[1])[big] == pytest.approx(2, rel=0.15)


def test_a_control_period_turns_as_its_physics_steps_do(paper):
    planar, h, rate, heading = planar_parameters(paper, {"cable_spring": CABLE}), 1e-3, 3.0, 0.4
    k, start = constants(planar, h), REST._replace(tilt=0.02, wheel_speed=8.0, x=0.5, y=0.1)
    s = start
    for i in range(20):
        s = step(planar, k, s, 1.0, i * h, turning_at(rate, heading + i * h * rate))
    held = hold(planar, k, start, np.ones(1), 0, 20, turning_at(rate, heading), imu_settled(k, start, 40), EVEN)
    assert held[:4] == pytest.approx(s[:4], abs=1e-12)
    assert (held.x, held.y) == pytest.approx((s.x, s.y), abs=1e-12)


def test_a_robot_that_drives_straight_is_at_its_position(paper):
    planar = planar_parameters(paper, {})
    k, s = constants(planar, 1e-3), REST._replace(wheel_speed=3.0)
    s = hold(planar, k, s, np.ones(1), 0, 20, turning_at(0.0, 0.0), imu_settled(k, s, 40), EVEN)
    assert (s.x, s.y) == (s.position, 0.0)


def turning_world(robot, effects, initial, restart, steps, h):
    """Motions and poses of a robot in the physics engine, from the middle of a rollout on, without torque."""
    model = assemble(robot, effects)
    world, acting = World(model, h), model.start(h, np.random.default_rng(0))
    world.reset(initial, restart.heading)
    world.resume(restart, 0.0)
    found = [(world.motion(), world.pose())]
    for _ in range(steps):
        world.advance(0.0, acting, 1)
        found.append((world.motion(), world.pose()))
    world.close()
    return found


def test_the_physics_engine_pulls_a_robot_that_turns_as_the_planar_model_does(paper):
    """From the middle of a rollout on; the planar model has the yaw rate of the engine, in which it changes."""
    h, seconds, tilt, speed = 2.5e-4, 0.4, 0.05, 0.6
    restart = RestartState(0.0, heading=0.7, yaw_rate=2.0, position=3.0, x=0.6, y=-0.8)
    moved = []
    for effects in ({}, {"cable_spring": CABLE}):
        cables = [CableSpring(**values) for values in effects.values()]
        found = turning_world(paper, cables, InitialState(tilt, 0.0, speed), restart, round(seconds / h), h)
        planar = planar_parameters(paper, effects)
        k = constants(planar, h)
        s = REST._replace(tilt=tilt, wheel=tilt, wheel_speed=speed / paper.wheel_radius, x=0.6, y=-0.8)
        for i, ((before, pose), (after, _)) in enumerate(pairwise(found)):
            turning = turning_at(0.5 * (before.yaw_rate + after.yaw_rate), 0.7 + pose.heading)
            s = step(planar, k, s, 0.0, i * h, turning)
        motion, pose = found[-1]
        ahead, left = np.array([[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]]) @ [pose.x, pose.y]
        engine = [0.6 + ahead, -0.8 + left, motion.tilt, motion.speed]
        moved.append(np.array([engine, [s.x, s.y, s.tilt, paper.wheel_radius * s.wheel_speed]]))
    (engine, planar), (free, _) = moved[1], moved[0]
    assert (np.abs(engine - free) > [0.01, 0.01, 0.01, 0.1]).all()
    assert (np.abs(engine - planar) < 0.02 * np.abs(engine - free)).all()


def test_a_replay_from_the_middle_of_a_turn_pulls_to_the_same_place(paper):
    h, periods, effects = 5e-4, 8, [CableSpring(**CABLE)]
    each = round(paper.control_period / h)
    found = turning_world(paper, effects, InitialState(0.05, 0.0, 0.6), RestartState(0.0, yaw_rate=2.0), 16 * each, h)
    now, pose = found[8 * each]
    restart = RestartState(now.wheel_angle, pose.heading, yaw_rate=now.yaw_rate, x=pose.x, y=pose.y)
    initial, past = InitialState(now.tilt, now.tilt_rate, now.speed), np.zeros((0, 3))
    starts = [ReplayStart(initial, at, np.zeros(0), past) for at in (restart, restart._replace(x=0.0, y=0.0))]
    there, elsewhere = replay(paper, effects, h, starts, np.zeros((2, periods)))
    truth = np.array([[m.tilt, m.tilt_rate, m.wheel_angle, m.wheel_rate] for m, _ in found[8 * each :: each]])
    columns, moved = [1, 2, 4, 5], np.ptp(truth, axis=0)
    assert (np.abs(there[:, columns] - truth).max(axis=0) < 0.01 * moved).all()
    assert (np.abs(elsewhere[:, columns] - truth).max(axis=0) > 0.05 * moved).all()
