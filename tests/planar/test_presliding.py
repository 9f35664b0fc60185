"""Dry friction that grows over an angle, against an integrator of its own and closed forms."""

from math import exp

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from test_motion import lagrange, swing

HANGING = {"tilt": np.pi + 0.02}  # a body that hangs, so that small differences stay small
ANGLE, BOUND, REST, FADE = 0.004, 0.15, 0.1, 2.0  # rad, N·m, N·m, rad/s
FRICTIONS = {
    "joint": {"coulomb_friction": {"torque": BOUND}},
    "ground": {"rolling_resistance": {"torque": BOUND}},
    "greater at rest": {"stribeck_friction": {"torque": BOUND, "breakaway": REST, "rate": FADE}},
    "both": {"coulomb_friction": {"torque": BOUND}, "rolling_resistance": {"torque": 0.5 * BOUND}},
}


def push(t):
    """Torque that turns the wheels back and forth [N·m]."""
    return 0.9 * np.sin(9.0 * t) + 0.5 * np.sin(31.0 * t)


@pytest.mark.parametrize("name", FRICTIONS)
def test_a_robot_moves_as_bristles_on_both_wheels_say(paper, name):
    effects, r = FRICTIONS[name], paper.wheel_radius
    joint = 0.0 if name == "ground" else BOUND
    more = REST if name == "greater at rest" else 0.0
    ground = {"ground": BOUND, "both": 0.5 * BOUND}.get(name, 0.0)

    def grown(torque, rate, bound, at_rest):
        return -at_rest / ANGLE * (rate + abs(rate) * torque / bound) if bound else 0.0

    def all_of(t, z):
        """Way, tilt, their rates, and the friction of a joint and of a wheel on the ground."""
        relative, turning = z[2] / r - z[3], z[2] / r
        in_joints, on_ground = 2.0 * z[4], 2.0 * z[5]
        pull = push(t) + in_joints
        moved = lagrange(paper, 0.0, lambda *_: np.array([(pull + on_ground) / r, -pull]))(t, z[:4])
        bound = joint + more * exp(-((relative / FADE) ** 2))
        return [*moved, grown(z[4], relative, bound, joint + more), grown(z[5], turning, ground, ground)]

    times = np.arange(0.0, 1.5, 0.05)
    true = solve_ivp(
        all_of, (0.0, 1.5), [0.0, HANGING["tilt"], 0.0, 0.0, 0.0, 0.0], t_eval=times, rtol=1e-8, atol=1e-10
    ).y
    step = 1e-4
    states = swing(paper, {**effects, "presliding": {"angle": ANGLE}}, HANGING, push, step, 1.5)
    found = np.array(
        [[s.position, s.tilt, r * s.wheel_speed, s.tilt_rate, s.left_joint, s.left_ground] for s in states]
    )
    found = found[np.round(times / step).astype(int)]
    size = np.maximum(np.ptp(true, axis=1), 1e-9)
    assert (np.abs(found.T - true).max(axis=1) < 0.01 * size).all()
    rigid = swing(paper, effects, HANGING, push, step, 1.5)
    assert abs(rigid[-1].tilt - found[-1, 1]) > 0.05 * size[1]  # so much does the angle matter


def test_wheels_of_a_robot_that_turns_bend_their_bristles_apart(paper):
    yaw_rate, seconds = 0.3, 0.02
    effects = {"coulomb_friction": {"torque": BOUND}, "presliding": {"angle": ANGLE}}
    last = swing(paper, effects, {}, 0.0, 1e-4, seconds, yaw_rate=yaw_rate)[-1]
    turned = 0.5 * paper.track / paper.wheel_radius * yaw_rate * seconds
    expected = BOUND * (1.0 - exp(-turned / ANGLE))  # a robot that turns to the left is faster on the right
    assert (last.left_joint, last.right_joint) == pytest.approx((expected, -expected), rel=0.01)
    assert (last.left_ground, last.right_ground) == (0.0, 0.0)


def test_a_tiny_angle_is_rigid_friction(paper):
    effects = {"coulomb_friction": {"torque": BOUND}}
    rigid, tiny = (
        swing(paper, {**effects, **more}, HANGING, push, 1e-3, 1.0) for more in ({}, {"presliding": {"angle": 1e-6}})
    )
    off = np.array([[a.tilt - b.tilt, a.wheel - b.wheel] for a, b in zip(rigid, tiny, strict=True)])
    assert (np.abs(off).max(axis=0) < 0.01 * np.ptp([[s.tilt, s.wheel] for s in rigid], axis=0)).all()


def test_without_dry_friction_it_does_nothing(paper):
    both = (swing(paper, more, HANGING, push, 1e-3, 0.5)[-1] for more in ({}, {"presliding": {"angle": ANGLE}}))
    assert len({*both}) == 1


def test_it_slips_tyres_as_it_rolls_them_where_these_hold(paper):
    friction = {"coulomb_friction": {"torque": BOUND}, "rolling_resistance": {"torque": 0.5 * BOUND}}
    rolled, slid = (
        swing(paper, {**friction, "presliding": {"angle": ANGLE}, **more}, HANGING, push, 1e-3, 1.0)[-1]
        for more in ({}, {"wheel_slip": {"friction": 5.0, "creep": 0.0}})
    )
    assert (slid.tilt, slid.wheel) == pytest.approx((rolled.tilt, rolled.wheel), abs=1e-4)
    assert (slid.left_joint, slid.right_ground) == pytest.approx((rolled.left_joint, rolled.right_ground), abs=1e-3)
