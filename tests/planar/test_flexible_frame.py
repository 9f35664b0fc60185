"""A frame that yields: the planar model against Lagrange's equations of three bodies, which it does not use."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from twbal.core.errors import ConfigError
from twbal.core.robot_parameters import GRAVITY
from twbal.core.start_pose import InitialState, StartPose
from twbal.core.swinging_part import swinging_part, without_part
from twbal.effects.effect import assemble
from twbal.effects.flexible_frame import FlexibleFrame
from twbal.effects.library import effects_from
from twbal.planar.constants import constants
from twbal.planar.motion import step
from twbal.planar.parameters import planar_parameters
from twbal.planar.planar_plant import PlanarPlant
from twbal.planar.planar_state import STRAIGHT, PlanarState, turning_at
from twbal.sim.restart_state import RestartState
from twbal.sim.world import World

FRAME = {"share": 0.1, "frequency": 5.0, "damping": 0.05, "height": 1.8}
SEEN = ("tilt", "wheel", "tilt_rate", "wheel_speed", "sway", "sway_rate")
START = {"tilt": 0.1, "wheel_speed": 1.0, "tilt_rate": -0.5, "sway": 0.002}


def course(robot, effects, start, torque, physics_step, seconds):
    """States (N, 6) of the planar model, a torque [N·m] being a function of time."""
    planar = planar_parameters(robot, effects)
    k = constants(planar, physics_step)
    state = PlanarState(*(0.0,) * len(PlanarState._fields))._replace(**start)
    state = state._replace(rotor=state.wheel, rotor_speed=state.wheel_speed)
    states = [state]
    for i in range(round(seconds / physics_step)):
        states.append(step(planar, k, states[-1], torque(i * physics_step), i * physics_step, STRAIGHT))
    return np.array([[getattr(state, name) for name in SEEN] for state in states])


def three_bodies(robot, frame, start, torque, seconds, slope=0.0):
    """State (6,) at the end, of wheels, body and a point mass that slides on it, from energies in coordinates.

    Nothing but places and speeds of the three is written down; the equations come by numeric differentiation.
    """
    r, height, m = robot.wheel_radius, robot.com_height, robot.body_mass
    part, h = frame["share"] * m, frame["height"] * height
    rest = m - part
    low = (m * height - part * h) / rest
    inertia = robot.body_inertia_pitch + m * height**2 - part * h**2 - rest * low**2
    pace = 2.0 * np.pi * frame["frequency"]
    spring, damper = part * pace**2, 2.0 * frame["damping"] * part * pace

    def places(q):
        """Of axle, rest of the body, and part; x along the ground, z across it."""
        phi, theta, y = q
        lean = theta + slope + robot.com_offset
        up, ahead = np.array([np.sin(lean), np.cos(lean)]), np.array([np.cos(lean), -np.sin(lean)])
        axle = np.array([r * phi, 0.0])
        return np.concatenate([axle, axle + low * up, axle + h * up + y * ahead])

    masses = np.repeat([2.0 * robot.wheel_mass, rest, part], 2)

    def inertias(q):
        e = 1e-6
        J = np.array([(places(q + n) - places(q - n)) / (2 * e) for n in e * np.eye(3)]).T
        return J.T @ (masses[:, None] * J) + np.diag([2.0 * robot.wheel_inertia, inertia, 0.0])

    def potential(q):
        down = np.tile([np.sin(slope), np.cos(slope)], 3)
        return GRAVITY * float((masses * down) @ places(q)) + 0.5 * spring * q[2] ** 2

    def motion(t, z):
        q, v, e = z[:3], z[3:], 1e-4
        nudges = e * np.eye(3)
        dM = np.array([(inertias(q + n) - inertias(q - n)) / (2 * e) for n in nudges])
        dV = np.array([(potential(q + n) - potential(q - n)) / (2 * e) for n in nudges])
        quadratic = np.einsum("kij,k,j->i", dM, v, v) - 0.5 * np.einsum("ijk,j,k->i", dM, v, v)
        forces = np.array([torque(t), -torque(t), -damper * v[2]])
        return np.concatenate([v, np.linalg.solve(inertias(q), forces - quadratic - dV)])

    first = [start.get(name, 0.0) for name in ("wheel", "tilt", "sway", "wheel_speed", "tilt_rate", "sway_rate")]
    phi, theta, y, rate, leans, sways = solve_ivp(motion, (0.0, seconds), first, rtol=1e-9, atol=1e-10).y[:, -1]
    return np.array([theta, phi, leans, rate, y, sways])


@pytest.mark.parametrize(
    ("slope", "effects"), [(0.0, {}), (0.1, {"ground_slope": {"angle": 0.1}}), (0.0, {"wheel_slip": {"friction": 9.0}})]
)
def test_it_swings_as_three_bodies_do(paper, slope, effects):
    def torque(t):
        return 3.0 * np.sin(20.0 * t)

    true = three_bodies(paper, FRAME, START, torque, 0.3, slope)
    moved = np.ptp(course(paper, {**effects, "flexible_frame": FRAME}, START, torque, 1e-4, 0.3), axis=0)
    coarse, fine = (
        np.abs(course(paper, {**effects, "flexible_frame": FRAME}, START, torque, h, 0.3)[-1] - true) / moved
        for h in (2e-4, 2.5e-5)
    )
    assert (fine < 5e-3).all() and fine.max() < coarse.max()


def test_a_robot_that_turns_throws_its_part_outwards(paper):
    """Beside the physics engine, in which the part is a body of its own."""
    frame, yaw, seconds, h = {"share": 0.2, "frequency": 2.0, "damping": 0.05, "height": 1.9}, 4.0, 0.2, 2.5e-4
    tilts = {}
    for name, effects in (("rigid", {}), ("frame", {"flexible_frame": frame})):
        planar = planar_parameters(paper, effects)
        k, state = constants(planar, h), PlanarState(*(0.0,) * len(PlanarState._fields))._replace(tilt=0.1)
        model = assemble(paper, effects_from(effects))
        world, acting = World(model, h), model.start(h, np.random.default_rng(0))
        world.reset(InitialState(0.1, 0.0, 0.0))
        world.resume(RestartState(0.0, yaw_rate=yaw), 0.0)
        for i in range(round(seconds / h)):
            turning = turning_at(world.motion().yaw_rate, 0.0)  # as the engine has it: it changes as the body leans
            world.advance(0.0, acting, 1)
            state = step(planar, k, state, 0.0, i * h, turning)
        tilts[name] = world.motion().tilt, state.tilt
        world.close()
    moved = tilts["frame"][0] - tilts["rigid"][0]
    assert tilts["frame"][1] - tilts["rigid"][1] == pytest.approx(moved, rel=0.25)
    assert tilts["frame"][1] == pytest.approx(tilts["frame"][0], rel=0.02)


def test_a_part_that_leaves_no_body_is_refused_before_it_moves(paper):
    with pytest.raises(ConfigError, match="flexible_frame"):
        PlanarPlant(
            robot=paper,
            effects=[FlexibleFrame(0.5, 5.0, 0.05, 3.0)],
            start=StartPose(0.0, 0.0, 0.0, 0.0),
            physics_step=0.001,
            seed=0,
        )


def test_a_part_without_mass_and_a_stiff_spring_are_a_rigid_frame(paper):
    def torque(t):
        return 2.0

    start = {"tilt": 0.1, "wheel_speed": 1.0}
    rigid = course(paper, {}, start, torque, 5e-4, 0.2)
    none = course(paper, {"flexible_frame": {**FRAME, "share": 0.0}}, start, torque, 5e-4, 0.2)
    stiff = course(paper, {"flexible_frame": {**FRAME, "frequency": 24.0, "damping": 0.9}}, start, torque, 5e-4, 0.2)
    assert np.array_equal(none, rigid)
    assert np.abs(stiff - rigid)[-1, :4] == pytest.approx(0.0, abs=0.04)
    assert np.abs(stiff[:, 4]).max() < 1e-3


def test_a_fit_finds_no_frame_that_leaves_no_body(paper):
    """Within the ranges of a diagnosis, where the body's inertia is less than its sheet says: nothing is predicted."""
    frame = {"share": 0.2, "frequency": 5.0, "damping": 0.05, "height": 2.0}
    light = {"flexible_frame": frame, "body_inertia": {"factor": 0.5}}
    assert np.isfinite(constants(planar_parameters(paper, {"flexible_frame": frame}), 1e-3).swing.stiffness)
    assert np.isnan(constants(planar_parameters(paper, light), 1e-3).swing.stiffness)
    model = assemble(paper, effects_from(light))
    with pytest.raises(ConfigError, match="no body"):
        without_part(model.robot, swinging_part(model))
