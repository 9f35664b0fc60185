r"""A two-wheeled inverted pendulum that drives about a plane, by Lagrange's equations in quasi-velocities.

Velocities are v of the axle's middle along the heading, q of the body about the axle, w about the plane's normal and,
where tyres slip, the spins of both wheels. With a the angle of the centre of mass from the normal, l its distance from
the axle, and J(p) = I_yaw cos² p + I_roll sin² p at the pitch p, the kinetic energy is

    T = ½ m ((v + l q cos a)² + (w l sin a)² + (l q sin a)²) + ½ I_pitch q² + ½ J(p) w²
        + Σ ½ m_w (v ∓ w b)² + ½ I_d w² + ½ I_w spin².

Momenta along the heading and across it turn with the robot, which gives the terms in w v and w² (Boltzmann-Hamel; J. I.
Neimark, N. A. Fufaev: Dynamics of Nonholonomic Systems, 1972). Wheels that roll have spin = (v ∓ b w) / r.
"""

from math import atan2, cos, exp, expm1, pi, sin, sqrt, tanh
from typing import NamedTuple

import numba

GRAVITY = 9.81

X, Y, HEADING, WAY, PITCH, LEFT, RIGHT, V, Q, W, SPIN_L, SPIN_R, ROTOR_L, ROTOR_R, ROTOR_RATE_L, ROTOR_RATE_R = range(
    16
)
TORQUE_L, TORQUE_R, MAST, MAST_RATE, SIZE = range(16, 21)
"""Places in the state; angles of wheels and rotors are relative to the body."""

_DAMPED = 0.002  # s; damping of bristles over their stiffness
_SLOW = 0.02  # m/s; over which creep becomes sliding, at least
_STIFFEST = 3000.0  # 1/s; pace of a wheel that stops sliding, at most
_FAST = 600.0  # rad/s; at which a rotor rings on the flank of its gear
_RINGING = 0.3  # damping ratio of that


class Machine(NamedTuple):
    """What a robot and the ground under it are made of, in SI units; 0 means that there is none, but for `grip`.

    Attributes:
        mass: of the body. height: of its centre of mass over the axle. offset: angle by which that lies in front.
        pitch_inertia, roll_inertia, yaw_inertia: of the body about its centre of mass.
        wheel_mass, wheel_inertia: of each wheel with its rotor. radius, half_track: of the wheels.
        rotor_share: of a wheel's inertia that is its rotor's. geared: 1 if that turns relative to the body, 0 in space.
        gap: full width of the play between rotor and wheel, as an angle of the wheel.
        viscous, kinetic, static, fade, bristle: friction of each joint; the latter three of LuGre's form: at rest, the
            rate over which it fades, and the angle by which bristles bend.
        ground_viscous, ground_kinetic: the same between wheel and ground.
        cog_torque, cog_count, cog_left, cog_right: pull of the poles, with a phase of each wheel.
        slope: of the ground, rising towards +x. wave_slope, waves, wave_phase: of its waves along the way.
        cable, cable_x, cable_y: stiffness of a cable, and where it is tied.
        force, frequency, force_phase: of a push at the axle. drag: over the square of the speed.
        grip: dry friction of the tyres; infinite where they roll. load: weight on the wheels [N].
        mast_mass, mast_height, mast_stiffness, mast_damping: part of the body that swings fore and aft on a spring.
        mast_hardening: share by which that spring is stiffer, over the square of how far it is bent [1/m²].
        dead_zone, skew: half width of the driver's zone in both motors together, and by which it is wider forth.
        limit: of both motors together. gain: of torque. uneven: by which the right motor is stronger. sag: of the
            torque in a second. lag: time constant. slew: largest rate of both torques together. compensation: torque
            that the firmware adds against friction.
        delay: from command to driver.
        cubic: friction of each joint over the cube of its rate.
        notch, notch_at, notch_width: torque of each joint where its wheel stands about an angle, and for how far.
        stop, stop_at: stiffness of a spring at the axle that begins so far from the start, on either side.
        one_sided: share of a motor's torque that is added forth and taken away back.
        gust, gust_at: force at the axle that sets in within half a second, and when.
    """

    mass: float
    height: float
    offset: float
    pitch_inertia: float
    roll_inertia: float
    yaw_inertia: float
    wheel_mass: float
    wheel_inertia: float
    radius: float
    half_track: float
    rotor_share: float = 0.0
    geared: float = 0.0
    gap: float = 0.0
    viscous: float = 0.0
    kinetic: float = 0.0
    static: float = 0.0
    fade: float = 1.0
    bristle: float = 0.003
    ground_viscous: float = 0.0
    ground_kinetic: float = 0.0
    cog_torque: float = 0.0
    cog_count: float = 0.0
    cog_left: float = 0.0
    cog_right: float = 0.0
    slope: float = 0.0
    wave_slope: float = 0.0
    waves: float = 0.0
    wave_phase: float = 0.0
    cable: float = 0.0
    cable_x: float = 0.0
    cable_y: float = 0.0
    force: float = 0.0
    frequency: float = 0.0
    force_phase: float = 0.0
    drag: float = 0.0
    grip: float = float("inf")
    load: float = 0.0
    mast_mass: float = 0.0
    mast_height: float = 0.0
    mast_stiffness: float = 0.0
    mast_damping: float = 0.0
    mast_hardening: float = 0.0
    dead_zone: float = 0.0
    skew: float = 0.0
    limit: float = float("inf")
    gain: float = 1.0
    uneven: float = 0.0
    sag: float = 0.0
    lag: float = 0.0
    slew: float = 0.0
    compensation: float = 0.0
    delay: float = 0.0
    cubic: float = 0.0
    notch: float = 0.0
    notch_at: float = 0.0
    notch_width: float = 1.0
    stop: float = 0.0
    stop_at: float = 0.0
    one_sided: float = 0.0
    gust: float = 0.0
    gust_at: float = 0.0


@numba.njit(error_model="numpy")
def bristles(bent, rate, elapsed, kinetic, static, fade, bend):
    """Bend of LuGre's bristles after `elapsed` at one rate, and their torque (Canudas de Wit 1995)."""
    if static <= 0.0:
        return 0.0, 0.0
    stiffness = static / bend
    settled = (kinetic + (static - kinetic) * exp(-((rate / fade) ** 2))) / stiffness
    pace = abs(rate) / settled
    after = bent + rate * elapsed
    change = rate
    if pace > 0.0:
        end = settled if rate > 0 else -settled
        after = bent - (end - bent) * expm1(-pace * elapsed)
        change = pace * (end - after)
    return after, stiffness * (after + _DAMPED * change)


@numba.njit(error_model="numpy")
def contact(ahead, rate, m):
    """Torque of a flank of the gear, which pushes and never pulls."""
    beyond = ahead - min(max(ahead, -0.5 * m.gap), 0.5 * m.gap)
    if beyond == 0.0:
        return 0.0
    inertia = m.rotor_share * m.wheel_inertia
    torque = inertia * _FAST * (_FAST * beyond + 2.0 * _RINGING * rate)
    return max(torque, 0.0) if beyond > 0 else min(torque, 0.0)


@numba.njit(error_model="numpy")
def joint(y, side, motor, bent, elapsed, m):
    """Torque of one wheel's joint (0 left, 1 right) on the wheel, and what of it came through the gear."""
    angle, rate = y[LEFT + side], y[SPIN_L + side] - y[Q]
    driven = motor
    if m.gap > 0.0:
        driven = contact(y[ROTOR_L + side] - angle, y[ROTOR_RATE_L + side] - rate, m)
    _, dry = bristles(bent, rate, elapsed, m.kinetic, m.static, m.fade, m.bristle)
    cogging = m.cog_torque * sin(m.cog_count * angle + (m.cog_right if side else m.cog_left))
    if m.notch != 0.0:
        cogging += m.notch * exp((cos(angle - m.notch_at) - 1.0) / m.notch_width**2)
    return driven - m.viscous * rate - m.cubic * rate**3 - dry + cogging, driven


@numba.njit(error_model="numpy")
def ground(y, side, bent, elapsed, m):
    """Torque of the ground on one wheel."""
    rate = y[SPIN_L + side]
    _, dry = bristles(bent, rate, elapsed, m.ground_kinetic, m.ground_kinetic, 1.0, m.bristle)
    return -m.ground_viscous * rate - dry


@numba.njit(error_model="numpy")
def push(y, time, m):
    """Force at the axle along the heading, with the ground's slope in it."""
    weight = (m.mass + 2.0 * m.wheel_mass) * GRAVITY
    force = -weight * sin(m.slope) * cos(y[HEADING]) - m.drag * y[V] * abs(y[V])
    force -= weight * m.wave_slope * sin(2.0 * pi * m.waves * y[WAY] + m.wave_phase)
    force += m.force * sin(2.0 * pi * m.frequency * time + m.force_phase)
    if m.stop > 0.0:
        force -= m.stop * (y[WAY] - min(max(y[WAY], -m.stop_at), m.stop_at))
    if m.gust != 0.0:
        force += 0.5 * m.gust * (1.0 + tanh((time - m.gust_at) / 0.25))
    if m.cable > 0.0:
        away_x, away_y = y[X] - m.cable_x, y[Y] - m.cable_y
        force -= m.cable * (away_x * cos(y[HEADING]) + away_y * sin(y[HEADING]))
    return force


@numba.njit(error_model="numpy")
def _without_ground(y, time, joints, m):
    """Force along the heading, torque about the axle and torque that turns, but for what the ground does.

    Args:
        y: state.
        time: since the rollout began.
        joints: torque of both joints together.
        m: the machine.
    """
    v, q, w, pitch = y[V], y[Q], y[W], y[PITCH]
    s, c, height = sin(pitch + m.offset), cos(pitch + m.offset), m.height
    skewed = (m.roll_inertia - m.yaw_inertia) * sin(pitch) * cos(pitch)  # half of what J(p) grows by
    along = m.mass * height * s * (q * q + w * w) + push(y, time, m)
    about = -joints + m.mass * height * height * w * w * s * c + w * w * skewed
    about += m.mass * GRAVITY * height * (cos(m.slope) * s - sin(m.slope) * cos(y[HEADING]) * c)
    turn = -2.0 * q * w * (m.mass * height * height * s * c + skewed) - v * w * m.mass * height * s
    turn += m.mass * GRAVITY * height * s * sin(m.slope) * sin(y[HEADING])
    return along, about, turn


@numba.njit(error_model="numpy")
def _rotor_rates(y, left, right, leans, m, dy):
    """Rates of the motors' rotors.

    Args:
        y: state.
        left, right: torques that are left to them: of the motor, less of the gear.
        leans: acceleration of the body's pitch.
        m: the machine.
        dy: (SIZE,) of which those of the wheels are known.
    """
    dy[ROTOR_L], dy[ROTOR_R] = y[ROTOR_RATE_L], y[ROTOR_RATE_R]
    if m.gap > 0.0:
        rotor = m.rotor_share * m.wheel_inertia
        dy[ROTOR_RATE_L] = left / rotor - (1.0 - m.geared) * leans
        dy[ROTOR_RATE_R] = right / rotor - (1.0 - m.geared) * leans
    else:
        dy[ROTOR_L], dy[ROTOR_R] = dy[LEFT], dy[RIGHT]
        dy[ROTOR_RATE_L], dy[ROTOR_RATE_R] = dy[SPIN_L] - leans, dy[SPIN_R] - leans


@numba.njit(error_model="numpy")
def _swing(y, m, s):
    """Force on the mast across the body, by its spring and its weight; `s` is the sine of the body's lean."""
    spring = m.mast_stiffness * (1.0 + m.mast_hardening * y[MAST] ** 2) * y[MAST]
    return -spring - m.mast_damping * y[MAST_RATE] + m.mast_mass * GRAVITY * s


@numba.njit(error_model="numpy")
def derivative(y, time, motor_l, motor_r, bent, elapsed, m, dy):
    """Rates of the state under the motors' torques.

    Args:
        y: state.
        time: since the rollout began.
        motor_l, motor_r: torques of the motors.
        bent: (4,) bend of the bristles of both joints and of both wheels on the ground, `elapsed` ago.
        elapsed: since then.
        m: the machine.
        dy: (SIZE,) where the rates go; those of the motors' torques are left alone.
    """
    v, q, w, r, b = y[V], y[Q], y[W], m.radius, m.half_track
    lean, pitch = y[PITCH] + m.offset, y[PITCH]
    s, c, height = sin(lean), cos(lean), m.height
    rotor = m.rotor_share * m.wheel_inertia
    spin_inertia, relative = (m.wheel_inertia - rotor, 0.0) if m.gap > 0.0 else (m.wheel_inertia, rotor * m.geared)
    joint_l, driven_l = joint(y, 0, motor_l, bent[0], elapsed, m)
    joint_r, driven_r = joint(y, 1, motor_r, bent[1], elapsed, m)
    on_l, on_r = joint_l + ground(y, 0, bent[2], elapsed, m), joint_r + ground(y, 1, bent[3], elapsed, m)

    along, about, turn = _without_ground(y, time, joint_l + joint_r, m)
    if m.gap > 0.0:
        about -= (1.0 - m.geared) * (motor_l + motor_r - driven_l - driven_r)
    vv, vq = m.mass + 2.0 * m.wheel_mass, m.mass * height * c
    qq = m.mass * height * height + m.pitch_inertia + 2.0 * relative
    ww = m.mass * (height * s) ** 2 + m.yaw_inertia * cos(pitch) ** 2 + m.roll_inertia * sin(pitch) ** 2
    ww += 2.0 * m.wheel_mass * b * b + m.wheel_inertia
    slips = m.grip < 1e9
    traction_l = traction_r = 0.0
    if slips:
        half = 0.5 * m.grip * m.load
        slow = max(_SLOW, half * r * r / (spin_inertia * _STIFFEST))
        traction_l = half * tanh((r * y[SPIN_L] - v + b * w) / slow)
        traction_r = half * tanh((r * y[SPIN_R] - v - b * w) / slow)
        along += traction_l + traction_r
        turn += b * (traction_r - traction_l)
        qq -= 2.0 * relative * relative / spin_inertia
        about += relative * (on_l + on_r - r * (traction_l + traction_r)) / spin_inertia
    else:
        along += (on_l + on_r) / r
        turn += b * (on_r - on_l) / r
        vv += 2.0 * spin_inertia / (r * r)
        vq -= 2.0 * relative / r
        ww += 2.0 * spin_inertia * (b / r) ** 2
    swing = 0.0
    if m.mast_mass > 0.0:
        swing = _swing(y, m, s)
        about += m.mast_mass * GRAVITY * c * y[MAST] - m.mast_height * swing
        along -= c * swing
        vv -= m.mast_mass * c * c
        vq -= m.mast_mass * c * m.mast_height
        qq -= m.mast_mass * m.mast_height**2
    determinant = vv * qq - vq * vq
    speeds = (qq * along - vq * about) / determinant
    leans = (vv * about - vq * along) / determinant

    dy[X], dy[Y], dy[HEADING], dy[WAY], dy[PITCH] = v * cos(y[HEADING]), v * sin(y[HEADING]), w, v, q
    dy[LEFT], dy[RIGHT] = y[SPIN_L] - q, y[SPIN_R] - q
    dy[V], dy[Q], dy[W] = speeds, leans, turn / ww
    if slips:
        dy[SPIN_L] = (on_l - r * traction_l + relative * leans) / spin_inertia
        dy[SPIN_R] = (on_r - r * traction_r + relative * leans) / spin_inertia
    else:
        dy[SPIN_L], dy[SPIN_R] = (speeds - b * dy[W]) / r, (speeds + b * dy[W]) / r
    _rotor_rates(y, motor_l - driven_l, motor_r - driven_r, leans, m, dy)
    if m.mast_mass > 0.0:
        dy[MAST] = y[MAST_RATE]
        dy[MAST_RATE] = swing / m.mast_mass - c * speeds - m.mast_height * leans


@numba.njit(error_model="numpy")
def tilt(y, m):
    """Of the body from the vertical."""
    return y[PITCH] - atan2(sin(m.slope) * cos(y[HEADING]), cos(m.slope))


def energy(y, m: Machine) -> float:
    """Kinetic and potential energy of a robot without play and mast on wheels that roll."""
    lean, b = y[PITCH] + m.offset, m.half_track
    v, q, w = y[V], y[Q], y[W]
    forth, across, down = v + m.height * q * cos(lean), w * m.height * sin(lean), m.height * q * sin(lean)
    turning = m.yaw_inertia * cos(y[PITCH]) ** 2 + m.roll_inertia * sin(y[PITCH]) ** 2
    found = 0.5 * m.mass * (forth**2 + across**2 + down**2) + 0.5 * m.pitch_inertia * q**2 + 0.5 * turning * w**2
    relative = m.geared * m.rotor_share * m.wheel_inertia
    for side in (-1.0, 1.0):
        speed = v + side * b * w
        found += 0.5 * m.wheel_mass * speed**2 + 0.25 * m.wheel_inertia * w**2
        found += 0.5 * (m.wheel_inertia - relative) * (speed / m.radius) ** 2
        found += 0.5 * relative * (speed / m.radius - q) ** 2
    weight = (m.mass + 2.0 * m.wheel_mass) * GRAVITY
    high = m.mass * GRAVITY * m.height * cos(lean) * cos(m.slope)
    return (
        found
        + high
        + weight * y[X] * sin(m.slope)
        + m.mass * GRAVITY * m.height * sin(lean) * sin(m.slope) * cos(y[HEADING])
    )


def unstable_pole(m: Machine) -> float:
    """Rate at which a robot that is let go falls at first [1/s]."""
    vv = m.mass + 2.0 * m.wheel_mass + 2.0 * m.wheel_inertia / m.radius**2
    vq, qq = m.mass * m.height, m.pitch_inertia + m.mass * m.height**2
    return sqrt(vv * m.mass * GRAVITY * m.height / (vv * qq - vq**2))
