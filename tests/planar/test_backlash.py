"""Rotors that meet the wheels of bending gears, against an integrator of its own and closed forms."""

from dataclasses import replace
from math import exp, pi, sqrt

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from test_motion import lagrange, swing

from twbal.core.play import CONTACT_STEP
from twbal.core.robot_parameters import GRAVITY
from twbal.planar.joint_damping import joint_damping_rate
from twbal.planar.parameters import planar_parameters

HANGING = {"tilt": np.pi + 0.02}  # a body that hangs, so that small differences stay small
GAP, SHARE, TIME, DAMPING = 0.03, 0.4, 0.006, 0.3
EFFECT = {"gap": GAP, "rotor_share": SHARE, "contact_time": TIME, "contact_damping": DAMPING}


def push(t):
    """Torque that drives the rotors from one end of the gap to the other [N·m]."""
    return 0.8 * np.sin(40.0 * t) + 0.5 * np.sin(95.0 * t)


def held(t):
    """The same, for 2 ms each."""
    return push(0.002 * np.floor(t / 0.002 + 1e-9))


def rotors_on_springs(robot, torque=push):
    """Motion of way, tilt, angle of the rotors in space, and their rates."""
    rotors, r = 2.0 * SHARE * robot.wheel_inertia, robot.wheel_radius
    without = replace(robot, wheel_inertia=(1.0 - SHARE) * robot.wheel_inertia)
    stiffness, damping = rotors * (pi / TIME) ** 2, 2.0 * DAMPING * rotors * pi / TIME

    def motion(t, z):
        ahead, faster = z[2] - z[0] / r, z[5] - z[3] / r
        beyond = ahead - np.clip(ahead, -0.5 * GAP, 0.5 * GAP)
        pull = stiffness * beyond + damping * faster
        pull = pull if pull * beyond > 0.0 else 0.0
        moved = lagrange(without, 0.0, lambda *_: np.array([pull / r, -torque(t)]))(t, z[[0, 1, 3, 4]])
        return np.array([z[3], z[4], z[5], moved[2], moved[3], (torque(t) - pull) / rotors])

    return motion


def test_a_robot_moves_as_rotors_on_springs_say(paper):
    """Over some ten impacts. Rotors that stick to rigid gears end elsewhere."""
    times = np.arange(0.0, 0.4, 0.01)
    start = [0.0, HANGING["tilt"], 0.0, 0.0, 0.0, 0.0]
    true = solve_ivp(rotors_on_springs(paper), (0.0, 0.4), start, t_eval=times, max_step=2e-4, rtol=1e-7).y
    step, r = 1e-4, paper.wheel_radius
    states, rigid = (
        swing(paper, {"backlash": values}, HANGING, push, step, 0.4)
        for values in (EFFECT, {**EFFECT, "contact_time": 0})
    )
    ahead = np.array([s.rotor - s.wheel for s in states])
    assert np.sum(np.diff((np.abs(ahead) > 0.5 * GAP).astype(int)) > 0) >= 8  # impacts
    at = np.round(times / step).astype(int)
    found, other = (
        np.array([[s.position, s.tilt, s.rotor, r * s.wheel_speed, s.tilt_rate, s.rotor_speed] for s in each])[at].T
        for each in (states, rigid)
    )
    size = np.ptp(true, axis=1)
    error = np.sqrt(np.mean((found - true) ** 2, axis=1))
    assert (error < 0.05 * size).all()
    assert (np.sqrt(np.mean((other - true) ** 2, axis=1)) > 4.0 * error).all()


def test_a_long_physics_step_holds_impacts_that_are_shorter(paper):
    """Rates after 0.2 s and more, with steps of up to a third of an impact, against an integrator of its own."""
    times, start = np.arange(0.2, 0.4, 0.01), [0.0, HANGING["tilt"], 0.0, 0.0, 0.0, 0.0]
    motion = rotors_on_springs(paper, held)
    true = solve_ivp(motion, (0.0, 0.4), start, t_eval=times, max_step=2e-4, rtol=1e-7).y[3:]

    def error(step):
        states = swing(paper, {"backlash": EFFECT}, HANGING, held, step, 0.4)
        at = np.round(times / step).astype(int)
        found = np.array([[paper.wheel_radius * s.wheel_speed, s.tilt_rate, s.rotor_speed] for s in states])[at].T
        return np.sqrt(np.mean((found - true) ** 2, axis=1)) / np.ptp(true, axis=1)

    fine = error(CONTACT_STEP)
    assert (fine < 0.05).all()
    for step in (0.001, 0.002):
        assert (error(step) < 1.2 * fine).all()


def rebound(robot, share, damping, step):
    """Rate of the rotors after an impact on wheels that hardly give way, over the rate before it."""
    effect = {"gap": 0.2, "rotor_share": share, "contact_time": 0.01, "contact_damping": damping}
    states = swing(robot, {"backlash": effect}, {"tilt": np.pi}, lambda t: 0.1 if t < 0.006 else 0.0, step, 0.16)
    faster = np.array([s.rotor_speed - s.wheel_speed for s in states])
    return -faster[faster < 0.0].min() / faster.max()


@pytest.mark.parametrize(
    ("damping", "step", "close"),
    [(0.1, 1e-4, 0.03), (0.3, 1e-4, 0.03), (0.1, 1e-3, 0.06), (0.3, 1e-3, 0.06), (0.3, 2e-3, 0.12)],
)
def test_a_light_rotor_is_thrown_back_as_a_damped_spring_does_it(paper, damping, step, close):
    """In steps of a fifth of the impact, too.

    Teeth that never pull let go where the spring would hold back: the rest of its swing is not damped.

    With x' = -1 at first, x'' + 2ζ x' + x = 0 has its force x + 2ζ x' at 0 before x is, when x' is exp(-ζ t) of before
    with tan(t √(1 - ζ²)) = -2ζ √(1 - ζ²) / (1 - 2ζ²).
    """
    root = sqrt(1.0 - damping**2)
    until = (pi - np.arctan2(2.0 * damping * root, 1.0 - 2.0 * damping**2)) / root
    true = exp(-damping * until)
    assert rebound(paper, 0.02, damping, step) == pytest.approx(true, abs=close)


def test_gears_that_hardly_bend_are_rigid_ones(paper):
    values = {"gap": GAP, "rotor_share": SHARE}
    ends = [
        swing(paper, {"backlash": {**values, "contact_time": time}}, HANGING, push, CONTACT_STEP, 0.2)[-1]
        for time in (0.0, 1e-6)
    ]
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-5)


def test_play_behind_encoders_bends_alike(paper):
    """What differs is what the encoders see, not how the robot moves."""
    one, other = (
        swing(paper, {name: EFFECT}, HANGING, push, 1e-3, 0.2)[-1] for name in ("backlash", "backlash_behind_encoder")
    )
    np.testing.assert_array_equal(one, other)


def geared_rotors_on_springs(robot, share, geared):
    """Motion of wheels, body and rotors in space, φ, θ and ρ, and their rates: Lagrange's equations of all three.

    Of the wheels' inertia, `share` is J of the rotors, and `geared` turns relative to the body. That is J_g of J, with
    the energy ½ J_g (ρ̇ - θ̇)², and what is left of it, g, with ½ g (φ̇ - θ̇)².
    """
    m, l, r, spin = robot.body_mass, robot.com_height, robot.wheel_radius, 2.0 * robot.wheel_inertia
    rotors, behind = share * spin, min(share, geared) * spin
    beside = geared * spin - behind
    stiffness, damping = rotors * (pi / TIME) ** 2, 2.0 * DAMPING * rotors * pi / TIME
    wheels, body = (m + 2.0 * robot.wheel_mass) * r**2 + spin - rotors, robot.body_inertia_pitch + m * l**2

    def motion(t, z):
        tilt, rate = z[1], z[4]
        beyond = z[2] - z[0] - np.clip(z[2] - z[0], -0.5 * GAP, 0.5 * GAP)
        pull = stiffness * beyond + damping * (z[5] - z[3])
        pull = pull if pull * beyond > 0.0 else 0.0
        tied = m * l * r * np.cos(tilt) - beside
        inertia = np.array([[wheels, tied, 0.0], [tied, body + geared * spin, -behind], [0.0, -behind, rotors]])
        weight = m * GRAVITY * l * np.sin(tilt)
        forces = np.array([pull + m * l * r * np.sin(tilt) * rate**2, weight - push(t), push(t) - pull])
        return np.concatenate([z[3:], np.linalg.solve(inertia, forces)])

    return motion


@pytest.mark.parametrize("kind", ["backlash", "backlash_behind_encoder"])
@pytest.mark.parametrize(("share", "geared"), [(0.4, 0.3), (0.4, 0.9), (0.9, 0.5), (0.9, 0.9)])
def test_geared_rotors_behind_play_are_those_of_three_bodies(paper, kind, share, geared):
    seconds, step = 0.15, 5e-5
    start = [0.0, HANGING["tilt"], 0.0, 0.0, 0.0, 0.0]
    motion = geared_rotors_on_springs(paper, share, geared)
    true = solve_ivp(motion, (0.0, seconds), start, max_step=2e-4, rtol=1e-8, atol=1e-10).y[3:, -1]
    effects = {kind: {**EFFECT, "rotor_share": share}, "rotor_inertia": {"share": geared}}
    end = swing(paper, effects, HANGING, lambda t: push(t + 0.5 * step), step, seconds)[-1]
    found = np.array([end.wheel_speed, end.tilt_rate, end.rotor_speed])
    assert np.abs(found - true).max() < 0.05 * np.abs(true).max()


@pytest.mark.parametrize("share", [0.2, 0.8])
def test_a_body_does_not_feel_motors_that_turn_geared_rotors_alone(paper, share):
    """Their rates relative to the body grow by τ / J, and what turns them and what they push back cancel in it."""
    torque, gap, step = 0.5, 0.2, 1e-4
    effects = {"backlash": {"gap": gap, "rotor_share": share}, "rotor_inertia": {"share": 0.9}}
    inertia = share * 2.0 * paper.wheel_inertia
    crossing = np.sqrt(gap * inertia / torque)
    states = swing(paper, effects, {"tilt": 0.0}, torque, step, 0.9 * crossing)
    assert abs(states[-1].tilt_rate) + abs(states[-1].wheel_speed) < 1e-9
    assert states[-1].rotor_speed == pytest.approx(torque * (len(states) - 1) * step / inertia, rel=1e-9)
    after = swing(paper, effects, {"tilt": 0.0}, torque, step, 1.2 * crossing)[-1]
    assert after.tilt_rate < 0.0 < after.wheel_speed


def test_joints_beside_geared_rotors_behind_play_are_damped_as_the_motion_says(paper):
    """Between impacts, by how far a step of viscous friction slows wheels and body down against each other."""
    effects = {
        "backlash": {"gap": 0.3, "rotor_share": 0.4},
        "rotor_inertia": {"share": 0.9},
        "viscous_friction": {"coefficient": 0.05},
    }
    step, rate = 1e-6, 1.0
    first, last = swing(paper, effects, {"tilt": 0.0, "wheel_speed": rate}, 0.0, step, step)
    slowed = (first.wheel_speed - first.tilt_rate - last.wheel_speed + last.tilt_rate) / step
    assert joint_damping_rate(planar_parameters(paper, effects)) == pytest.approx(slowed / rate, rel=1e-6)
