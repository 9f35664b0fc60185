"""The planar model's physics step against closed forms, balances of energy, and an integrator of its own."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from twbal.core.robot_parameters import GRAVITY
from twbal.planar.constants import constants
from twbal.planar.motion import step
from twbal.planar.parameters import planar_parameters
from twbal.planar.planar_state import PlanarState, turning_at

REST = PlanarState(*(0.0,) * len(PlanarState._fields))


def swing(robot, effects, start, torque, physics_step, seconds, yaw_rate=0.0, heading=0.0):
    """States from `start` on; `torque` is a number or a function of time."""
    planar = planar_parameters(robot, effects)
    k = constants(planar, physics_step)
    state = REST._replace(**start)
    state = state._replace(rotor=state.wheel, rotor_speed=state.wheel_speed)
    states = [state]
    for i in range(round(seconds / physics_step)):
        time = i * physics_step
        pull = torque(time) if callable(torque) else torque
        state = step(planar, k, state, pull, time, turning_at(yaw_rate, heading + time * yaw_rate))
        states.append(state)
    return states


def lagrange(robot, slope, forces, offset=0.0):
    """Right side of the equations of motion from the Lagrangian, by numeric differentiation of it; q = (x, tilt).

    x is the way along the ground; `forces(t, q, v)` gives the generalised forces on x and tilt.
    """
    m, h, r = robot.body_mass, robot.com_height, robot.wheel_radius
    total, spin = m + 2 * robot.wheel_mass, 2 * robot.wheel_inertia / r**2

    def mass(q):
        mixed = m * h * np.cos(q[1] + offset + slope)
        return np.array([[total + spin, mixed], [mixed, robot.body_inertia_pitch + m * h**2]])

    def potential(q):
        return total * GRAVITY * np.sin(slope) * q[0] + m * GRAVITY * h * np.cos(q[1] + offset)

    def motion(t, z):
        q, v, e = z[:2], z[2:], 1e-6
        nudges = e * np.eye(2)
        dM = np.array([(mass(q + n) - mass(q - n)) / (2 * e) for n in nudges])  # (2, 2, 2), by q first
        dV = np.array([(potential(q + n) - potential(q - n)) / (2 * e) for n in nudges])
        quadratic = np.einsum("kij,k,j->i", dM, v, v) - 0.5 * np.einsum("ijk,j,k->i", dM, v, v)
        return np.concatenate([v, np.linalg.solve(mass(q), forces(t, q, v) - quadratic - dV)])

    return motion


_WEIGHT = 117.72  # of the robot of the paper [N]
CASES = {
    "com_offset": ({"com_offset": {"angle": 0.1}}, lambda t, x, v, r: (0.0, 0.0)),
    "ground_slope": ({"ground_slope": {"angle": 0.2}}, lambda t, x, v, r: (0.0, 0.0)),
    "viscous_friction": (
        {"viscous_friction": {"coefficient": 0.05}},
        lambda t, x, v, r: (-0.1 * (v[0] / r - v[1]) / r, 0.1 * (v[0] / r - v[1])),
    ),
    "rolling_viscous": ({"rolling_viscous": {"coefficient": 0.2}}, lambda t, x, v, r: (-0.4 * v[0] / r**2, 0.0)),
    "cable_spring": ({"cable_spring": {"stiffness": 30.0}}, lambda t, x, v, r: (-30.0 * x[0], 0.0)),
    "periodic_disturbance": (
        {"periodic_disturbance": {"force": 5.0, "frequency": 2.0, "phase": 0.7}},
        lambda t, x, v, r: (5.0 * np.sin(4 * np.pi * t + 0.7), 0.0),
    ),
    "friction_feedforward": (
        {"friction_feedforward": {"torque": 0.2, "rate": 0.5}},
        lambda t, x, v, r: (
            0.4 * np.tanh((v[0] / r - v[1]) / 0.5) / r,
            -0.4 * np.tanh((v[0] / r - v[1]) / 0.5),
        ),
    ),
    "quadratic_drag": (
        {"quadratic_drag": {"coefficient": 20.0}},
        lambda t, x, v, r: (-20.0 * v[0] * abs(v[0]), 0.0),
    ),
    "eccentric_wheel": (
        {"eccentric_wheel": {"eccentricity": 0.05, "phase": 0.6}},
        lambda t, x, v, r: (-0.05 * _WEIGHT * (1.0 + v[0] ** 2 / (r * GRAVITY)) * np.sin(x[0] / r + 0.6), 0.0),
    ),
    "cogging": (
        {"cogging": {"torque": 0.3, "count": 12.0, "phase": 0.4}},
        lambda t, x, v, r: (
            0.6 * np.sin(12 * (x[0] / r - x[1]) + 0.4) / r,
            -0.6 * np.sin(12 * (x[0] / r - x[1]) + 0.4),
        ),
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_it_follows_lagranges_equations_and_errs_in_proportion_to_the_step(paper, name):
    effects, extra = CASES[name]
    r, seconds = paper.wheel_radius, 0.3

    def torque(t):
        return 2 * np.sin(15 * t)

    def forces(t, q, v):
        more = extra(t, q, v, r)
        return np.array([torque(t) / r + more[0], -torque(t) + more[1]])

    offset = effects.get("com_offset", {}).get("angle", 0.0)
    slope = effects.get("ground_slope", {}).get("angle", 0.0)
    start = [0.0, 0.1, 0.4, -0.5]
    truth = solve_ivp(lagrange(paper, slope, forces, offset), (0, seconds), start, rtol=1e-9, atol=1e-11).y[:, -1]
    gaps = []
    for h in (1e-3, 5e-4):
        begin = {"tilt": 0.1, "wheel": 0.0, "tilt_rate": -0.5, "wheel_speed": 0.4 / r}
        end = swing(paper, effects, begin, lambda t, h=h: torque(t + h / 2), h, seconds)[-1]
        gaps.append(np.array([end.position, end.tilt, r * end.wheel_speed, end.tilt_rate]) - truth)
    assert np.abs(gaps[1]).max() < 1e-2
    big = np.abs(gaps[0]) > 1e-5
    assert (gaps[0] / gaps[1])[big] == pytest.approx(2, rel=0.1)


def kinetic(robot, s):
    """Energy of the motion and height."""
    m, h, r = robot.body_mass, robot.com_height, robot.wheel_radius
    a = (m + 2 * robot.wheel_mass) * r**2 + 2 * robot.wheel_inertia
    mixed = m * h * r * np.cos(s.tilt)
    c = robot.body_inertia_pitch + m * h**2
    moving = 0.5 * (a * s.wheel_speed**2 + c * s.tilt_rate**2) + mixed * s.wheel_speed * s.tilt_rate
    return moving + m * GRAVITY * h * np.cos(s.tilt)


FRICTIONS = {
    "coulomb_friction": ({"torque": 0.005}, lambda s: 0.005 * np.sign(s.wheel_speed - s.tilt_rate), True),
    "viscous_friction": ({"coefficient": 0.001}, lambda s: 0.001 * (s.wheel_speed - s.tilt_rate), True),
    "stribeck_friction": (
        {"torque": 0.003, "breakaway": 0.004, "rate": 3.0},
        lambda s: (
            (0.003 + 0.004 * np.exp(-(((s.wheel_speed - s.tilt_rate) / 3.0) ** 2)))
            * np.sign(s.wheel_speed - s.tilt_rate)
        ),
        True,
    ),
    "rolling_resistance": ({"torque": 0.004}, lambda s: 0.004 * np.sign(s.wheel_speed), False),
}


@pytest.mark.parametrize("name", FRICTIONS)
def test_friction_takes_away_as_much_energy_as_it_does_work(regbot, name):
    h = 1e-5
    values, resisting, at_joint = FRICTIONS[name]
    states = swing(regbot, {name: values}, {"tilt": 0.3, "tilt_rate": -0.5, "wheel_speed": 2.0}, 0.0, h, 0.03)
    rates = [s.wheel_speed - s.tilt_rate if at_joint else s.wheel_speed for s in states]
    work = h * sum(2 * resisting(s) * rate for s, rate in zip(states, rates, strict=True))
    assert kinetic(regbot, states[0]) - kinetic(regbot, states[-1]) == pytest.approx(work, rel=3e-2)


def test_dry_friction_holds_the_wheel_to_the_body_where_less_is_asked(paper):
    for name in ("coulomb_friction", "stribeck_friction"):
        states = swing(paper, {name: {"torque": 5.0}}, {"tilt": 0.1}, 1.0, 1e-3, 0.1)
        assert states[-1].wheel_speed - states[-1].tilt_rate == pytest.approx(0, abs=1e-12)
        assert states[-1].tilt_rate > 0.05


def test_joint_and_rolling_friction_together_hold_both_at_rest(paper):
    effects = {"coulomb_friction": {"torque": 5.0}, "rolling_resistance": {"torque": 5.0}}
    end = swing(paper, effects, {"tilt": 0.02}, 1.0, 1e-3, 0.1)[-1]
    assert abs(end.wheel_speed) < 1e-4
    assert abs(end.tilt_rate) < 1e-4


def momentum(robot, s):
    """Of wheels and body on φ and θ without rotors apart."""
    m, h, r = robot.body_mass, robot.com_height, robot.wheel_radius
    return m * h * r * np.cos(s.tilt), (m + 2 * robot.wheel_mass) * r**2 + 2 * robot.wheel_inertia


@pytest.mark.parametrize("share", [0.2, 0.5, 0.8])
def test_a_rotor_crosses_its_gap_alone_and_then_takes_the_wheel_along(paper, share):
    gap, torque, h = 0.02, 0.5, 1e-4
    states = swing(paper, {"backlash": {"gap": gap, "rotor_share": share}}, {}, torque, h, 0.06)
    inertia = share * 2.0 * paper.wheel_inertia
    gaps = np.array([s.rotor - s.wheel for s in states])
    free = np.flatnonzero(gaps < 0.5 * gap - 1e-9)
    crossing = free[-1] * h
    body = paper.body_inertia_pitch + paper.body_mass * paper.com_height**2
    assert crossing == pytest.approx(np.sqrt(gap * inertia / torque), rel=0.2 * inertia / body + 0.1)
    assert gaps.max() <= 0.5 * gap + 1e-12
    after = states[free[-1] + 2]
    assert after.rotor_speed == pytest.approx(after.wheel_speed, abs=1e-9)


def test_an_engaged_backlash_is_no_backlash(paper):
    start = {"tilt": 0.05, "wheel_speed": 1.0}
    plain = swing(paper, {}, start, 3.0, 1e-3, 0.1)[-1]
    geared = swing(paper, {"backlash": {"gap": 1e-9}}, start, 3.0, 1e-3, 0.1)[-1]
    np.testing.assert_allclose(geared[:4], plain[:4], rtol=1e-5, atol=1e-7)


def test_tyres_with_grip_enough_roll_as_wheels_that_cannot_slip(paper):
    start = {"tilt": 0.05, "wheel_speed": 1.0}
    effects = {
        "coulomb_friction": {"torque": 0.1},
        "ground_slope": {"angle": 0.1},
        "rolling_viscous": {"coefficient": 0.1},
    }
    plain = swing(paper, effects, start, 3.0, 1e-3, 0.2)[-1]
    gripping = swing(paper, {**effects, "wheel_slip": {"friction": 10.0}}, start, 3.0, 1e-3, 0.2)[-1]
    np.testing.assert_allclose(gripping[:4], plain[:4], rtol=1e-4, atol=1e-5)


def test_on_ice_the_wheels_spin_and_the_axle_feels_the_bound_alone(paper):
    mu, torque, h = 0.02, 15.0, 1e-4
    end = swing(paper, {"wheel_slip": {"friction": mu}}, {"tilt": 0.0}, torque, h, 0.01)[-1]
    weight = (paper.body_mass + 2 * paper.wheel_mass) * GRAVITY
    spin = (torque - mu * weight * paper.wheel_radius) / (2 * paper.wheel_inertia)
    assert end.wheel_speed == pytest.approx(0.01 * spin, rel=1e-2)
    assert end.slip < 0


@pytest.mark.parametrize("share", [0.0, 0.8])  # of the wheels' inertia that is geared rotors'
@pytest.mark.parametrize("most", [4.0, 40.0])  # of the torque: the tyres creep, or slide at times [N·m]
def test_tyres_that_creep_are_those_of_the_brush_model(paper, most, share):
    """Against axle, body and wheels on their own, with the traction of Pacejka's brush model (2012, chapter 3).

    Rotors turn with the wheels relative to the body, and have ½ g (φ̇ - θ̇)² of the energy.
    """
    friction, creep, seconds = 0.4, 0.06, 0.15
    m, l, r = paper.body_mass, paper.com_height, paper.wheel_radius
    total, g = m + 2 * paper.wheel_mass, 2 * share * paper.wheel_inertia
    spin, pitch = 2 * paper.wheel_inertia, paper.body_inertia_pitch + m * l**2 + g

    def torque(t):
        return most * np.cos(300.0 * t)

    def motion(t, z):
        tilt, tilt_rate, speed, wheel_rate = z
        sliding = (r * wheel_rate - speed) / creep  # rises to 1, from which on all of the contact slides
        gripped = np.sign(sliding) * (1.0 - (1.0 - min(abs(sliding), 1.0)) ** 3)
        traction = friction * gripped * total * GRAVITY
        tied = m * l * np.cos(tilt)
        mass = np.array([[total, tied, 0.0], [tied, pitch, -g], [0.0, -g, spin]])
        on_axle, on_body = m * l * np.sin(tilt) * tilt_rate**2, m * GRAVITY * l * np.sin(tilt)
        pushed, leans, spins = np.linalg.solve(
            mass, [traction + on_axle, on_body - torque(t), torque(t) - r * traction]
        )
        return [tilt_rate, leans, pushed, spins]

    truth = solve_ivp(motion, (0.0, seconds), [0.0, 0.0, 0.0, 0.0], method="Radau", rtol=1e-8, atol=1e-10)
    effects = {"wheel_slip": {"friction": friction, "creep": creep}, "rotor_inertia": {"share": share}}
    states = swing(paper, effects, {"tilt": 0.0}, torque, 2e-5, seconds)
    end = states[-1]
    assert (max(abs(state.slip) for state in states) > creep) == (most > 10.0)
    found = [end.tilt, end.tilt_rate, end.slip + r * end.wheel_speed, end.wheel_speed]
    np.testing.assert_allclose(found, truth.y[:, -1], rtol=0.02, atol=1e-3)


def test_turning_pulls_the_body_over(paper):
    quick = swing(paper, {}, {"tilt": 0.2}, 0.0, 1e-4, 0.1, yaw_rate=3.0)[-1]
    slow = swing(paper, {}, {"tilt": 0.2}, 0.0, 1e-4, 0.1)[-1]
    assert quick.tilt - slow.tilt > 5e-3


@pytest.mark.parametrize("heading", [np.pi / 2, np.pi])
def test_a_robot_that_looks_elsewhere_meets_another_slope(paper, heading):
    begin, slope = {"tilt": 0.1, "wheel_speed": 1.0}, 0.05
    turned = swing(paper, {"ground_slope": {"angle": slope}}, begin, 1.0, 1e-3, 0.2, heading=heading)[-1]
    met = {"ground_slope": {"angle": slope * np.cos(heading)}}
    straight = swing(paper, met, begin, 1.0, 1e-3, 0.2)[-1]
    assert turned._replace(x=straight.x, y=straight.y) == pytest.approx(straight, abs=1e-12)


@pytest.mark.parametrize("difference", [0.0, 1.1])
def test_cogging_of_a_turned_robot_is_that_of_its_two_wheels(paper, difference):
    """The right one is ahead where the robot looks to the left."""
    values, heading, h = {"torque": 0.4, "count": 12.0, "phase": 0.3, "difference": difference}, 0.7, 1e-3
    ahead = heading * paper.track / (2 * paper.wheel_radius)

    def push(effects, torque, heading):
        first, last = swing(paper, effects, {"wheel": 0.2}, torque, h, h, heading=heading)
        return (last.wheel_speed - first.wheel_speed) / h

    both = sum(0.4 * np.sin(12.0 * (0.2 + side * ahead) + 0.3 + side * 0.5 * difference) for side in (1, -1))
    assert push({"cogging": values}, 0.0, heading) == pytest.approx(push({}, both, 0.0), rel=1e-9)


@pytest.mark.parametrize("effect", ["coulomb_friction", "rolling_resistance"])
def test_dry_friction_of_a_turning_robot_is_that_of_its_two_wheels(paper, effect):
    """Against both wheels on their own, with friction that is smooth about rest."""
    torque, yaw_rate, seconds = 0.4, 0.8, 0.4
    apart = yaw_rate * paper.track / (2 * paper.wheel_radius)
    m, l, r = paper.body_mass, paper.com_height, paper.wheel_radius
    a, b, c = (
        (m + 2 * paper.wheel_mass) * r**2 + 2 * paper.wheel_inertia,
        m * l * r,
        paper.body_inertia_pitch + m * l**2,
    )
    turn = paper.body_inertia_roll - paper.body_inertia_yaw + m * l**2

    def motion(t, z):
        tilt, _, rate, wheel = z
        sliding = wheel - rate if effect == "coulomb_friction" else wheel
        rub = -sum(torque * np.tanh((sliding + side * apart) / 1e-3) for side in (1, -1))
        on_body = -rub if effect == "coulomb_friction" else 0.0
        forces = [
            b * np.sin(tilt) * (rate**2 + yaw_rate**2) + rub,
            m * GRAVITY * l * np.sin(tilt) + turn * yaw_rate**2 * np.sin(tilt) * np.cos(tilt) + on_body,
        ]
        wheel_acc, tilt_acc = np.linalg.solve([[a, b * np.cos(tilt)], [b * np.cos(tilt), c]], forces)
        return [rate, wheel, tilt_acc, wheel_acc]

    start = {"tilt": 0.02, "wheel_speed": 4.0}
    truth = solve_ivp(motion, (0, seconds), [0.02, 0.0, 0.0, 4.0], method="LSODA", rtol=1e-8, atol=1e-10).y[:, -1]
    end = swing(paper, {effect: {"torque": torque}}, start, 0.0, 1e-4, seconds, yaw_rate)[-1]
    without = swing(paper, {}, start, 0.0, 1e-4, seconds, yaw_rate)[-1]
    does = abs(without.wheel_speed - truth[3])
    assert does > 1.0
    assert abs(end.wheel_speed - truth[3]) < 0.01 * does
    straight = swing(paper, {effect: {"torque": torque}}, start, 0.0, 1e-4, seconds)[-1]
    assert abs(straight.wheel_speed - truth[3]) > 0.02 * does  # so the test would see a model that only goes straight
