"""One control period of the robot: drives, surroundings, MuJoCo's steps and the sensors' filters. Compiled."""

import sys
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

from twbal.core.compiled import foreign_function, kernel
from twbal.core.gaussian import Array
from twbal.core.robot_parameters import GRAVITY
from twbal.virtual_robot.robot_constants import Memory, RobotConstants
from twbal.virtual_robot.wheel_drive import drive_motor, hinge_torque, queued, supply

_FILE = {"darwin": "libmujoco.{}.dylib", "win32": "mujoco.dll"}.get(sys.platform, "libmujoco.so.{}")
_LIBRARY = Path(mujoco.__file__).parent / _FILE.format(mujoco.mj_versionString())
_mj_step = foreign_function("mj_step", _LIBRARY, pointers=2)  # called from Python, each step would cost twice as much

_SCRUB_RATE = 0.5  # yaw rate at which a tyre's scrubbing is about fully there [rad/s]


class BodyMotion(NamedTuple):
    """How the robot stands and moves.

    Attributes:
        tilt: from the vertical [rad].
        tilt_rate: about the axle [rad/s].
        heading: on the ground [rad].
        yaw_rate: about the vertical [rad/s].
        speed: of the axle, forward along the ground [m/s].
    """

    tilt: float
    tilt_rate: float
    heading: float
    yaw_rate: float
    speed: float


class Buffers(NamedTuple):
    """MuJoCo's model and data: their addresses, and what of the data is read and written."""

    model: int
    data: int
    qpos: Array
    qvel: Array
    qfrc_applied: Array
    xfrc_applied: Array


@kernel(is_kept=False)
def motion(q: Array, v: Array, slope: float) -> BodyMotion:
    """From a free joint's position (x, y, z, quaternion) and velocity (the angular one in the body's axes)."""
    a, b, c, d = q[3], q[4], q[5], q[6]
    forward_x, forward_z = 1.0 - 2.0 * (c * c + d * d), 2.0 * (b * d - a * c)
    left_x, left_y, left_z = 2.0 * (b * c - a * d), 1.0 - 2.0 * (b * b + d * d), 2.0 * (c * d + a * b)
    up_x, up_z = 2.0 * (b * d + a * c), 1.0 - 2.0 * (b * b + c * c)
    sine, cosine = np.sin(slope), np.cos(slope)
    forward = sine * forward_x + cosine * forward_z  # parts of the vertical along the body's axes
    left = sine * left_x + cosine * left_z
    up = sine * up_x + cosine * up_z
    heading = np.arctan2(-left_x, left_y)
    return BodyMotion(
        tilt=np.arctan2(-forward, up),
        tilt_rate=v[4],
        heading=heading,
        yaw_rate=forward * v[3] + left * v[4] + up * v[5],
        speed=v[0] * np.cos(heading) + v[1] * np.sin(heading),
    )


@kernel(is_kept=False)
def surround(c: RobotConstants, b: Buffers, now: BodyMotion, push: float) -> None:
    """Forces from outside: waves of the ground and the push at the axle, drag and scrubbing tyres on the body.

    On waves the ground's normal force leans by their slope, so that the robot's weight pushes its axle.
    """
    b.qfrc_applied[0] = push * np.cos(now.heading) - c.wave_force * np.sin(c.wave_number * b.qpos[0] + c.wave_phase)
    b.qfrc_applied[1] = push * np.sin(now.heading)
    speed = now.speed + c.com_height * np.cos(now.tilt) * now.tilt_rate
    drag = -c.drag * speed * abs(speed)
    b.xfrc_applied[1, 0] = drag * np.cos(now.heading)
    b.xfrc_applied[1, 1] = drag * np.sin(now.heading)
    b.xfrc_applied[1, 5] = -c.scrub * np.tanh(now.yaw_rate / _SCRUB_RATE)


@kernel(is_kept=False)
def filter_imu(c: RobotConstants, m: Memory, now: BodyMotion, bias: float) -> None:
    """Complementary filter of gyro and accelerometer, which takes an accelerating robot for a leaning one; low-pass."""
    acceleration = (now.speed - m.imu[0]) / c.step
    m.imu[0] = now.speed
    gyro = now.tilt_rate + bias
    if c.fusion_rate > 0.0:
        felt = now.tilt - np.arctan(acceleration / GRAVITY)
        m.imu[1] += c.step * (gyro + c.fusion_rate * (felt - m.imu[1]))
    else:
        m.imu[1] = now.tilt
    m.imu[2] += c.filter_share * (m.imu[1] - m.imu[2])
    m.imu[3] += c.filter_share * (gyro - m.imu[3])


@kernel(is_kept=False)
def encoder(c: RobotConstants, m: Memory, q: Array, wheel: int) -> float:
    """Angle that an encoder shows [rad]."""
    angle = m.rotor[wheel] if c.is_encoder_on_motor and c.rotor > 0.0 else q[7 + wheel]
    return float(np.floor(angle / c.tick) * c.tick) if c.tick > 0.0 else float(angle)


@kernel()
def drive_steps(
    c: RobotConstants, m: Memory, b: Buffers, number: int, begin: int, end: int, bias: float, push: float
) -> BodyMotion:
    """Drive through a part of control period `number`, and return the motion at the end of it.

    Args:
        begin, end: of that part, from its first physics step to the one behind its last.
        bias: of the gyro [rad/s].
        push: force at the axle, forward [N].
    """
    steps = round(c.period / c.step)
    for step in range(begin, end):
        if step == steps - c.window:
            m.counted[0], m.counted[1] = encoder(c, m, b.qpos, 0), encoder(c, m, b.qpos, 1)
        half_sum = 0.5 * queued(c, m, m.commands, m.earlier_commands, number * steps + step)
        half_difference = 0.5 * queued(c, m, m.differences, m.earlier_differences, number * steps + step)
        voltage = supply(c, m)
        for wheel in range(2):
            drive_motor(c, m, wheel, half_sum + (2 * wheel - 1) * half_difference, voltage)
            b.qfrc_applied[6 + wheel] = hinge_torque(c, m, wheel, b.qpos[7 + wheel], b.qvel[6 + wheel])
        surround(c, b, motion(b.qpos, b.qvel, c.slope), push)
        _mj_step(b.model, b.data)
        filter_imu(c, m, motion(b.qpos, b.qvel, c.slope), bias)
    return motion(b.qpos, b.qvel, c.slope)


@kernel()
def present_motion(b: Buffers, slope: float) -> BodyMotion:
    """How the robot moves now."""
    return motion(b.qpos, b.qvel, slope)


@kernel()
def encoders(c: RobotConstants, m: Memory, q: Array) -> tuple[float, float]:
    """Angles that both encoders show [rad]."""
    return encoder(c, m, q, 0), encoder(c, m, q, 1)
