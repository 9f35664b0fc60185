"""Robots of all sizes in MuJoCo that balance and write down what their sensors say, apart from all checks."""

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import mujoco
import numpy as np
from scipy.linalg import expm, solve_discrete_are

from twbal.core.gaussian import Array
from twbal.core.robot_parameters import GRAVITY, RobotParameters

PERIODS = (0.005, 0.008, 0.01, 0.0125, 1 / 70, 0.015, 0.02, 0.025, 0.03)  # s
_STEP = 0.001  # s, about
_RIDE = 18.0  # s
_TRIES = 40


@dataclass(frozen=True)
class Build:
    """One robot with its drive, its sensors and its way to drive. SI units."""

    sheet: RobotParameters  # nominal
    true: RobotParameters
    gain: float  # torque over command
    viscous: float  # of each joint
    dry: float  # of each joint
    delay: float  # periods from a command to when it acts
    is_filtered: bool  # tilt by a complementary filter, and not as it is
    fusion_time: float
    imu_lag: float
    tilt_noise: float
    gyro_noise: float
    gyro_bias: float
    gyro_scale: float
    ticks: int
    rate_window: int  # periods over which ticks are differenced
    driving: str  # stand, remote, dither
    slope: float
    seed: int


class Ride(NamedTuple):
    """What a robot saw and did: n rows each, the command of a row after its measurements."""

    build: Build
    tilt: Array
    tilt_rate: Array
    roll: Array
    roll_rate: Array
    yaw_rate: Array
    wheels: Array  # (n, 2) left, right
    wheel_rates: Array  # (n, 2)
    commands: Array  # (n, 2) left, right
    reference: Array  # speed asked for
    battery: Array
    felt: Array  # tilt by the direction that an accelerometer at the axle feels
    true_tilt: Array


def drawn(seed: int) -> Ride:
    """The first robot of a seed that balances."""
    for number in range(_TRIES):
        rng = np.random.default_rng([seed, number])
        build = _build(rng, seed)
        ride = _ride(build, rng)
        if ride is not None:
            return ride
    raise RuntimeError(f"No robot of seed {seed} balances.")


def _build(rng: np.random.Generator, seed: int) -> Build:
    height = float(np.exp(rng.uniform(np.log(0.05), np.log(0.3))))
    mass = 0.8 * (height / 0.08) ** 1.5 * rng.uniform(0.6, 1.6)
    radius = height * rng.uniform(0.25, 0.6) + 0.01
    wheel = mass * rng.uniform(0.02, 0.07)
    pitch = mass * height**2 * rng.uniform(0.15, 0.6)
    true = RobotParameters(
        name="drawn",
        body_mass=mass,
        com_height=height,
        com_offset=float(rng.uniform(-0.02, 0.02)),
        body_inertia_pitch=pitch,
        body_inertia_roll=1.2 * pitch,
        body_inertia_yaw=0.5 * pitch,
        wheel_mass=wheel,
        wheel_radius=radius,
        wheel_inertia=wheel * radius**2 * rng.uniform(0.5, 3.0),
        wheel_width=0.4 * radius,
        track=4.0 * radius,
        torque_limit=mass * GRAVITY * height * rng.uniform(0.5, 1.5),
        control_period=float(rng.choice(PERIODS)),
    )
    off = {name: getattr(true, name) * rng.uniform(0.88, 1.12) for name in ("body_mass", "com_height", "wheel_inertia")}
    sheet = replace(true, **off, com_offset=0.0, body_inertia_pitch=pitch * rng.uniform(0.9, 1.1))
    fall = np.sqrt(GRAVITY / height)
    damping = float(rng.choice([0.0, 0.05, 0.2])) * mass * GRAVITY * height / fall
    return Build(
        sheet=sheet,
        true=true,
        gain=float(rng.uniform(0.85, 1.15)),
        viscous=0.1 * damping,
        dry=float(rng.choice([0.0, 0.005, 0.02])) * mass * GRAVITY * height,
        delay=float(rng.choice([0.0, 0.2, 0.5, 1.0])),
        is_filtered=bool(rng.random() < 0.6),
        fusion_time=float(rng.uniform(0.7, 3.0)),
        imu_lag=float(rng.choice([0.0, 0.002, 0.004])),
        tilt_noise=float(rng.uniform(0.0003, 0.003)),
        gyro_noise=float(rng.uniform(0.002, 0.02)),
        gyro_bias=float(rng.normal(0.0, 0.01)),
        gyro_scale=float(rng.uniform(0.97, 1.03)),
        ticks=int(rng.choice([360, 720, 1320, 2000, 4096])),
        rate_window=int(rng.integers(1, 4)),
        driving=str(rng.choice(["stand", "remote", "remote", "dither"])),
        slope=float(rng.choice([0.0, 0.0, 0.02])),
        seed=seed,
    )


def _xml(robot: RobotParameters, slope: float, step: float) -> str:
    across = 0.5 * robot.wheel_inertia + robot.wheel_mass * robot.wheel_width**2 / 12
    wheel = "".join(
        f"""<body pos="0 {side * robot.track / 2} 0"><joint type="hinge" axis="0 1 0"/>
        <inertial pos="0 0 0" mass="{robot.wheel_mass}" diaginertia="{across} {robot.wheel_inertia} {across}"/>
        <geom type="sphere" size="{robot.wheel_radius}"/></body>"""
        for side in (1, -1)
    )
    x, z = robot.com_height * np.sin(robot.com_offset), robot.com_height * np.cos(robot.com_offset)
    inertia = f"{robot.body_inertia_roll} {robot.body_inertia_pitch} {robot.body_inertia_yaw}"
    return f"""<mujoco><option timestep="{step}" gravity="{-GRAVITY * np.sin(slope)} 0 {-GRAVITY * np.cos(slope)}"
      integrator="implicitfast" cone="elliptic" impratio="50"/>
      <default><geom solref="0.004 1" friction="1 0 0" condim="3"/></default>
      <worldbody><geom type="plane" size="0 0 1"/><body name="robot" pos="0 0 {robot.wheel_radius}"><freejoint/>
      <inertial pos="{x} 0 {z}" mass="{robot.body_mass}" diaginertia="{inertia}"/>{wheel}</body></worldbody></mujoco>"""


def _gains(robot: RobotParameters, dt: float) -> Array:
    """A linear-quadratic regulator of (path, speed, tilt, tilt rate), by the data sheet: what its owner would do."""
    m, length, r = robot.body_mass, robot.com_height, robot.wheel_radius
    inertia = np.array(
        [
            [m + 2 * robot.wheel_mass + 2 * robot.wheel_inertia / r**2, m * length],
            [m * length, robot.body_inertia_pitch + m * length**2],
        ]
    )
    by_tilt = np.linalg.solve(inertia, [0.0, m * GRAVITY * length])
    by_torque = np.linalg.solve(inertia, [1 / r, -1.0])
    A = np.zeros((5, 5))
    A[0, 1] = A[2, 3] = 1.0
    A[1, 2], A[3, 2] = by_tilt
    A[1, 4], A[3, 4] = by_torque
    whole = expm(A * dt)
    fall = np.sqrt(GRAVITY / length)
    unit = m * GRAVITY * length
    Q = np.diag([2.0 / length**2, 2.0 / (length * fall) ** 2, 40.0, 2.0 / fall**2])
    P = solve_discrete_are(whole[:4, :4], whole[:4, 4:], Q, np.array([[20.0 / unit**2]]))
    B = whole[:4, 4:]
    return np.linalg.solve(20.0 / unit**2 + B.T @ P @ B, B.T @ P @ whole[:4, :4])[0]


def _speeds(build: Build, rng: np.random.Generator, count: int, dt: float) -> Array:
    """The speed and the turning rate that are asked for, (n, 2)."""
    asked = np.zeros((count, 2))
    if build.driving == "remote":
        pace = 0.35 * np.sqrt(GRAVITY * build.true.com_height)
        ends = np.sort(rng.choice(count, 8, replace=False))
        for begin, end in pairwise(ends):
            asked[begin:end] = rng.uniform(-pace, pace), rng.uniform(-1.5, 1.5)
    share = min(1.0, dt / 0.3)
    for k in range(1, count):
        asked[k] = asked[k - 1] + share * (asked[k] - asked[k - 1])
    return asked


def _ride(build: Build, rng: np.random.Generator) -> Ride | None:
    """Drive a robot; None where it falls."""
    robot, dt = build.true, build.true.control_period
    steps = round(dt / _STEP)
    step = dt / steps
    model = mujoco.MjModel.from_xml_string(_xml(robot, build.slope, step))
    model.dof_damping[6:8] = build.viscous
    model.dof_frictionloss[6:8] = build.dry
    data = mujoco.MjData(model)
    gains, count = _gains(build.sheet, dt), round(_RIDE / dt)
    asked = _speeds(build, rng, count, dt)
    unit = robot.body_mass * GRAVITY * robot.com_height
    rows, acting = [], np.zeros(2)
    estimate, heading, path, lagged = 0.0, 0.0, 0.0, np.zeros(4)
    last_speed, ticks_before = 0.0, [np.zeros(2)] * (build.rate_window + 1)
    tick = 2 * np.pi / build.ticks
    tap = 0.0
    for k in range(count):
        tilt, roll = _angles(data.qpos[3:7])
        speed = _speed(data.qvel[:2], heading)
        heading = _heading(data.qpos[3:7])
        felt = tilt - np.arctan((speed - last_speed) / dt / GRAVITY) + 0.02 * rng.standard_normal()
        last_speed = speed
        now = np.array([tilt, data.qvel[4], data.qvel[3], data.qvel[5]])
        lagged = lagged + (now - lagged) * (1.0 if build.imu_lag == 0 else 1 - np.exp(-dt / build.imu_lag))
        noise = build.gyro_noise * rng.standard_normal(3)
        gyro = build.gyro_scale * lagged[1] + build.gyro_bias + noise[0]
        if build.is_filtered:
            estimate = felt if k == 0 else estimate + dt * gyro
            estimate += dt / build.fusion_time * (felt - estimate)
        else:
            estimate = lagged[0] + build.tilt_noise * rng.standard_normal()
        counts = np.floor(data.qpos[7:9] / tick)
        ticks_before = [*ticks_before[1:], counts]
        rates = (counts - ticks_before[0]) * tick / (build.rate_window * dt)
        if abs(tilt) > 0.7:
            return None
        moved = robot.wheel_radius * (0.5 * rates.sum() + gyro)
        path += dt * asked[k, 0]
        way = robot.wheel_radius * (0.5 * counts.sum() * tick + estimate)
        # u = -K x; near the balance it must drive after the tilt
        torque = float(-gains @ [way - path, moved - asked[k, 0], estimate, gyro])
        if build.driving == "dither":
            torque += 0.08 * unit * rng.standard_normal()
        turn = 0.15 * unit * np.sqrt(robot.com_height / GRAVITY) * (asked[k, 1] - lagged[3])
        command = 0.5 * torque + np.array([-0.5, 0.5]) * turn
        command = np.clip(command, -0.5 * robot.torque_limit, 0.5 * robot.torque_limit)
        battery = 11.8 - 0.01 * k * dt - 0.1 * abs(torque) / unit + 0.01 * rng.standard_normal()
        roll_rate, yaw_rate = lagged[2] + noise[1], lagged[3] + noise[2]
        seen = (estimate, gyro, roll + 0.001 * rng.standard_normal(), roll_rate, yaw_rate)
        rows.append([*seen, *(counts * tick), *rates, *command, asked[k, 0], battery, felt, tilt])
        if build.driving == "stand" and k % round(2.0 / dt) == 0:
            tap = float(rng.normal(0.0, 0.25)) * robot.body_mass * GRAVITY
        for number in range(steps):
            now_acting = command if number >= build.delay * steps else acting
            data.qfrc_applied[6:8] = build.gain * now_acting
            data.xfrc_applied[1, 0] = tap if k % round(2.0 / dt) < 0.06 / dt else 0.0
            mujoco.mj_step(model, data)
        acting = command
    return _from_rows(build, np.array(rows[round(0.5 / dt) :]))


def _from_rows(build: Build, rows: Array) -> Ride:
    """What a robot saw and did, of one row for each period."""
    columns = rows.T
    return Ride(
        build,
        *columns[:5],
        columns[5:7].T,
        columns[7:9].T,
        columns[9:11].T,
        *columns[11:15],
    )


def _angles(q: Array) -> tuple[float, float]:
    """Tilt about the axle and roll of a body."""
    a, b, c, d = q
    forward_z, left_z, up_z = 2 * (b * d - a * c), 2 * (c * d + a * b), 1 - 2 * (b * b + c * c)
    return float(np.arctan2(-forward_z, up_z)), float(np.arcsin(left_z))


def _speed(velocity: Array, heading: float) -> float:
    """Of a body that drives forth or back, (2,) being its velocity over the ground."""
    return float(np.hypot(*velocity) * np.sign(velocity[0] * np.cos(heading) + velocity[1] * np.sin(heading)))


def _heading(q: Array) -> float:
    a, b, c, d = q
    return float(np.arctan2(-2 * (b * c - a * d), 1 - 2 * (b * b + d * d)))
