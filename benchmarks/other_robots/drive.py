"""One rollout: a loop of a firmware around the mechanics, which RK4 integrates between its instants."""

from math import atan2, cos, exp, floor, log1p, pi, sin, tanh
from typing import NamedTuple

import numba
import numpy as np

from benchmarks.other_robots.mechanics import (
    GRAVITY,
    LEFT,
    RIGHT,
    ROTOR_L,
    ROTOR_RATE_L,
    SIZE,
    SPIN_L,
    SPIN_R,
    TORQUE_L,
    TORQUE_R,
    Q,
    V,
    W,
    bristles,
    derivative,
    tilt,
)

STEP = 0.00025  # of the physics [s]
CHANNELS = 7  # time, tilt, tilt rate, acceleration, wheel angle, wheel rate, yaw rate
TRUTH = 5  # tilt, tilt rate, speed, wheel angle, way


class Sensors(NamedTuple):
    """What the robot measures by.

    Attributes:
        tilt, gyro, wheel_rate, acceleration: standard deviations of white noise.
        tilt_constant: time constant of the complementary filter that makes the tilt [s]; 0: the tilt is measured.
        height: of the IMU over the axle [m].
        ticks: of an encoder in a turn of the wheel.
        differenced: 1 if wheel rates are differences of angles, 0 if timers measure them.
        on_shaft: 1 if the encoders sit on the motors' shafts, 0 on the wheels.
        gyro_bias, gyro_scale: of the tilt rate. mount: angle by which the IMU is askew. delay: of the IMU [s].
        bow: error of the tilt over its square [1/rad].
    """

    tilt: float
    gyro: float
    wheel_rate: float
    acceleration: float
    tilt_constant: float
    height: float
    ticks: float
    differenced: float
    on_shaft: float
    gyro_bias: float = 0.0
    gyro_scale: float = 1.0
    mount: float = 0.0
    delay: float = 0.0
    bow: float = 0.0


class Law(NamedTuple):
    """A controller: u = k_tilt (tilt - asked tilt) + k_rate tilt_rate + k_speed (speed - asked speed) + disturbance.

    Attributes:
        tilt, rate, speed: gains.
        lean, lean_integral: asked tilt over the speed that is lacking, and over its integral; 0 for a regulator.
        most_lean: largest asked tilt.
        smooth: time constant of the low pass of the speed [s].
        turn: difference of torques over the yaw rate that is lacking.
        limit: of the command. radius: of the wheels, as the data sheet says. fade: tilt where disturbances have faded.
    """

    tilt: float
    rate: float
    speed: float
    lean: float
    lean_integral: float
    most_lean: float
    smooth: float
    turn: float
    limit: float
    radius: float
    fade: float


@numba.njit(error_model="numpy")
def _softplus(x):
    return x if x > 30.0 else (0.0 if x < -30.0 else log1p(exp(x)))


@numba.njit(error_model="numpy")
def motor(asked, rate, side, time, m):
    """Torque that one motor is to give for what is asked of it: zone, limit, gain and battery."""
    u = asked
    if m.compensation > 0.0:
        u += m.compensation * tanh(rate / 0.3)
    if m.dead_zone > 0.0:
        edge = 0.02 * m.dead_zone
        forth, back = 0.5 * m.dead_zone * (1.0 + m.skew), 0.5 * m.dead_zone * (1.0 - m.skew)
        u = edge * (_softplus((u - forth) / edge) - _softplus((-u - back) / edge))
    if m.limit < 1e9:
        most = 0.5 * m.limit
        over = max(abs(u) - 0.9 * most, 0.0)
        if over > 0.0:
            u = (1.0 if u > 0 else -1.0) * (0.9 * most + 0.1 * most * tanh(over / (0.1 * most)))
    u += m.one_sided * abs(u)
    return u * m.gain * (1.0 + (m.uneven if side else -m.uneven)) / (1.0 + m.sag * time)


@numba.njit(error_model="numpy")
def _paced(target, now, m):
    """Rate of a motor's torque, by its lag and its slew limit; half a step is the least lag that RK4 bears well."""
    change = (target - now) / max(m.lag, 0.5 * STEP)
    return min(max(change, -0.5 * m.slew), 0.5 * m.slew) if m.slew > 0.0 else change


@numba.njit(error_model="numpy")
def _rates(y, time, asked_l, asked_r, bent, elapsed, m, dy):
    left, right = motor(asked_l, y[SPIN_L] - y[Q], 0, time, m), motor(asked_r, y[SPIN_R] - y[Q], 1, time, m)
    dy[TORQUE_L] = dy[TORQUE_R] = 0.0
    if m.lag > 0.0 or m.slew > 0.0:
        dy[TORQUE_L], dy[TORQUE_R] = _paced(left, y[TORQUE_L], m), _paced(right, y[TORQUE_R], m)
        left, right = y[TORQUE_L], y[TORQUE_R]
    derivative(y, time, left, right, bent, elapsed, m, dy)


@numba.njit(error_model="numpy")
def advance(y, time, asked_l, asked_r, bent, m, work):
    """One step of RK4, in place; bristles move by the mean of their rates.

    Args:
        y: state.
        time: since the rollout began.
        asked_l, asked_r: of the motors [N·m].
        bent: (4,) of the bristles.
        m: the machine.
        work: (5, SIZE) of scratch; the first row is left with the rates at the beginning.
    """
    before = (y[SPIN_L] - y[Q], y[SPIN_R] - y[Q], y[SPIN_L], y[SPIN_R])
    at = work[4]
    for i in range(SIZE):
        at[i] = y[i]
    for stage in range(4):
        elapsed = STEP * (0.0, 0.5, 0.5, 1.0)[stage]
        _rates(at, time + elapsed, asked_l, asked_r, bent, elapsed, m, work[stage])
        ahead = STEP * (0.5, 0.5, 1.0, 0.0)[stage]
        for i in range(SIZE):
            at[i] = y[i] + ahead * work[stage, i]
    for i in range(SIZE):
        y[i] += STEP / 6.0 * (work[0, i] + 2.0 * work[1, i] + 2.0 * work[2, i] + work[3, i])
    after = (y[SPIN_L] - y[Q], y[SPIN_R] - y[Q], y[SPIN_L], y[SPIN_R])
    for i in range(4):
        mean = 0.5 * (before[i] + after[i])
        kinetic, static, fade = (m.kinetic, m.static, m.fade) if i < 2 else (m.ground_kinetic, m.ground_kinetic, 1.0)
        bent[i], _ = bristles(bent[i], mean, STEP, kinetic, static, fade, m.bristle)


@numba.njit(error_model="numpy")
def _wheel(y, side, sensors):
    """Angle and rate that the encoder of one wheel sees."""
    if sensors.on_shaft > 0.0:
        return y[ROTOR_L + side], y[ROTOR_RATE_L + side]
    return y[LEFT + side], y[SPIN_L + side] - y[Q]


@numba.njit(error_model="numpy")
def _encoders(y, sensors):
    """Mean angle and mean rate that the encoders of both wheels see."""
    unit = 2.0 * pi / sensors.ticks
    angles, rates = 0.0, 0.0
    for side in range(2):
        angle, rate = _wheel(y, side, sensors)
        angles += 0.5 * unit * floor(angle / unit + 0.37 + 0.31 * side)
        rates += 0.5 * rate
    return angles, rates


@numba.njit(error_model="numpy")
def _fused(before, gyro, lean, ahead, above, elapsed, sensors):
    """The complementary filter's next tilt.

    Args:
        before: its last one.
        gyro: the tilt rate as it is measured.
        lean: tilt at which the accelerometer stands.
        ahead, above: what that feels along the ground and upwards [m/s²].
        elapsed: since the last tilt [s].
        sensors: of the robot.
    """
    along, across = ahead * cos(lean) - above * sin(lean), ahead * sin(lean) + above * cos(lean)
    share = elapsed / (sensors.tilt_constant + elapsed)
    return (1.0 - share) * (before + elapsed * gyro) + share * atan2(-along, across)


@numba.njit(error_model="numpy")
def _command(law, memory, seen, asked, elapsed, is_first):
    """The command that a controller gives, and by how much it turns the robot [N·m].

    Args:
        law: the controller.
        memory: (2,) low-passed speed and the integral of the speed that is lacking; they move on.
        seen: (CHANNELS,) what the robot measures.
        asked: (3,) speed, yaw rate and disturbance.
        elapsed: since the last instant [s].
        is_first: whether there was none.
    """
    lean, gyro = seen[1], seen[2]
    speed = law.radius * (seen[5] + gyro)
    memory[0] = speed if is_first else memory[0] + (speed - memory[0]) * elapsed / (law.smooth + elapsed)
    lacking = asked[0] - memory[0]
    integral = min(max(memory[1] + law.lean_integral * lacking * elapsed, -law.most_lean), law.most_lean)
    memory[1] = integral
    leaning = min(max(law.lean * lacking + integral, -law.most_lean), law.most_lean)
    fade = min(max(2.0 - 2.0 * abs(lean) / law.fade, 0.0), 1.0)
    u = law.tilt * (lean - leaning) + law.rate * gyro - law.speed * lacking + fade * asked[2]
    turn = min(max(law.turn * (asked[1] - seen[6]), -0.05 * law.limit), 0.05 * law.limit)
    return min(max(u, -law.limit), law.limit), turn


@numba.njit(error_model="numpy")
def _acting(sent, instants, acting, last, step, delay):
    """The command that acts in a step of the physics: the last one that is older than the delay.

    It may change within a step.

    Args:
        sent: (T, 2) halves of each command.
        instants: (T + 1,) at which they are given, in steps.
        acting: number of the command that acted in the step before; -1: none yet.
        last: number of the last one that was given.
        step: of the physics.
        delay: [s].

    Returns:
        Number of the command, and torques of both motors.
    """
    share = 1.0
    while acting < last and STEP * instants[acting + 1] + delay < STEP * (step + 1) - 1e-12:
        acting += 1
        share = STEP * (step + 1) - (STEP * instants[acting] + delay)
        share = min(share / STEP, 1.0)
    left = right = 0.0
    if acting >= 0:
        left, right = share * sent[acting, 0], share * sent[acting, 1]
        if share < 1.0 and acting > 0:
            left += (1.0 - share) * sent[acting - 1, 0]
            right += (1.0 - share) * sent[acting - 1, 1]
    return acting, left, right


@numba.njit(error_model="numpy")
def drive(start, m, sensors, law, instants, asked, noise, drift, lost, fallen):
    """A rollout.

    Args:
        start: (SIZE,) state.
        m: the machine. sensors: what it measures by. law: that drives it.
        instants: (T + 1,) of the loop, in steps of the physics.
        asked: (T + 1, 3) speed [m/s], yaw rate [rad/s] and disturbance of the torque [N·m].
        noise: (T + 1, 6) standard normals.
        drift: (T + 1,) by which the gyro's bias has walked [rad/s].
        lost: (T + 1,) whether the command of an instant never arrives.
        fallen: tilt that ends it [rad].

    Returns:
        Number of commands N, observations (N + 1, CHANNELS), commands (N,), truth (N + 1, TRUTH), largest traction of
        the tyres over the load in each period (N,).
    """
    periods = len(instants) - 1
    seen, truth = np.zeros((periods + 1, CHANNELS)), np.zeros((periods + 1, TRUTH))
    commands, gripped = np.zeros(periods), np.zeros(periods)
    sent = np.zeros((periods, 2))  # halves of the command that arrived
    y, work, bent = start.copy(), np.zeros((5, SIZE)), np.zeros(4)
    late = round(sensors.delay / STEP) + 1
    past = np.zeros((late, 2))
    for i in range(late):
        past[i, 0], past[i, 1] = tilt(y, m), y[Q]
    memory = np.zeros(2)  # of the controller
    filtered = angle_before = 0.0
    forth_before = down_before = speed_before = 0.0
    acting, step = -1, 0
    for k in range(periods + 1):
        elapsed = STEP * (instants[k] - instants[k - 1]) if k else STEP * (instants[1] - instants[0])
        now, upright = past[(step + 1) % late], tilt(y, m)
        # What the accelerometer feels: means over the period, of the point where the IMU sits.
        forth, down = y[V] + sensors.height * y[Q] * cos(upright), -sensors.height * y[Q] * sin(upright)
        ahead = (forth - forth_before) / elapsed if k else 0.0
        above = GRAVITY + ((down - down_before) / elapsed if k else 0.0)
        acceleration = (y[V] - speed_before) / elapsed if k else 0.0
        forth_before, down_before, speed_before = forth, down, y[V]
        gyro = sensors.gyro_scale * now[1] + sensors.gyro_bias + drift[k] + sensors.gyro * noise[k, 1]
        lean = now[0] + sensors.bow * now[0] ** 2 + sensors.mount + sensors.tilt * noise[k, 0]
        if sensors.tilt_constant > 0.0:
            filtered = lean = _fused(filtered, gyro, lean, ahead, above, elapsed, sensors) if k else lean
        angles, rates = _encoders(y, sensors)
        rate = rates + sensors.wheel_rate * noise[k, 3]
        if sensors.differenced > 0.0:
            rate = (angles - angle_before) / elapsed if k else 0.0
        angle_before = angles
        seen[k, 0], seen[k, 1], seen[k, 2] = STEP * instants[k], lean, gyro
        seen[k, 3], seen[k, 4], seen[k, 5] = acceleration + sensors.acceleration * noise[k, 2], angles, rate
        seen[k, 6] = y[W] + sensors.gyro * noise[k, 4]
        truth[k, 0], truth[k, 1], truth[k, 2] = upright, y[Q], y[V]
        truth[k, 3], truth[k, 4] = 0.5 * (y[LEFT] + y[RIGHT]), y[3]
        if k == periods or abs(upright) > fallen:
            return k, seen[: k + 1], commands[:k], truth[: k + 1], gripped[:k]

        u, turn = _command(law, memory, seen[k], asked[k], elapsed, k == 0)
        commands[k] = u
        sent[k, 0], sent[k, 1] = 0.5 * u - turn, 0.5 * u + turn
        if lost[k] and k:
            sent[k, 0], sent[k, 1] = sent[k - 1, 0], sent[k - 1, 1]
        while step < instants[k + 1]:
            acting, left, right = _acting(sent, instants, acting, k, step, m.delay)
            advance(y, STEP * step, left, right, bent, m, work)
            step += 1
            past[step % late, 0], past[step % late, 1] = tilt(y, m), y[Q]
            force = abs((m.mass + 2.0 * m.wheel_mass) * work[0, V] + m.mass * m.height * work[0, Q])
            gripped[k] = max(gripped[k], force / m.load)
    return 0, seen, commands, truth, gripped
