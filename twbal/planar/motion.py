r"""One physics step of the twin.

The equations of `dynamics` with what effects add. On ground that rises by σ ahead, turning at the yaw rate ψ̇ (a known
input), with the torque τ between wheels and body, the force F and the torque τ_g on the wheels from outside,

    a φ̈ + b cos(α + σ) θ̈ - b sin(α + σ) θ̇² = τ + τ_g + r F - M g r sin σ + b sin α ψ̇²
    b cos(α + σ) φ̈ + c θ̈ - d sin α = -τ + (I_xx - I_zz + m l²) ψ̇² sin α cos α,

M being the mass of all. Rates go by the accelerations at the step's start, then angles by the new rates (semi-implicit
Euler). Dry frictions and the backlash are impulses within bounds, which act after the rest of the step: each brings its
relative rate to where it wants it, or goes to its bound.

A robot that turns has its slope and its wheels elsewhere: ground that rose by σ_0 at the start rises by σ_0 cos ψ at
the heading ψ. As the robot stands on that ground, its axle tips while it turns, and θ and φ, which count from the
vertical, grow by σ_0 sin ψ ψ̇ beside θ̇, which a gyro measures about the axle. The wheels turn by e = ψ̇ t / 2 r faster
and slower than their mean, t being the track. Dry friction at the two of them then cancels as long as the mean rate is
within ±e, and their cogging is out of step.

Where a part J' of the wheels' inertia is of rotors that turn relative to the body, b cos loses J' and c gains it. (On
tyres that slip these rotors turn with the wheels in space.)

With a backlash the rotors, of inertia J (both), turn by an angle ρ of their own: J ρ̈ = τ - (contact), and the wheels
have a - J in place of a. The contact is plastic and keeps |ρ - φ| within half of the gap.
"""

from math import cos, exp, expm1, sin
from typing import NamedTuple

from twbal.core.compiled import kernel
from twbal.core.quantities import Quantity
from twbal.core.robot_model import ROTOR_SHARE, UNBOUNDED, AxleMotion, JointMotion
from twbal.core.robot_parameters import GRAVITY
from twbal.planar.parameters import TwinParameters
from twbal.planar.terms import push, quantities, turn

_SWEEPS = 50
"""Rounds over the impulses, where several act at once; as many as a physics engine takes."""


class TwinState(NamedTuple):
    """All that the twin remembers.

    Attributes:
        tilt: θ [rad].
        wheel: φ, in space [rad].
        tilt_rate: [rad/s].
        wheel_speed: φ̇ [rad/s].
        torque: to which the motors have come, both together [N·m].
        rotor: ρ, in space, in turns of the wheel [rad]; φ without backlash.
        rotor_speed: [rad/s].
        slip: speed of the axle beyond r φ̇ [m/s]; 0 where the wheels roll.
        position: of the axle since the rollout began [m].
    """

    tilt: float
    wheel: float
    tilt_rate: float
    wheel_speed: float
    torque: float
    rotor: float
    rotor_speed: float
    slip: float
    position: float


class Turning(NamedTuple):
    """How the robot turns: a known input.

    Attributes:
        rate: ψ̇ [rad/s].
        heading: ψ, since the rollout began [rad].
    """

    rate: float
    heading: float


STRAIGHT = Turning(0.0, 0.0)


class Constants(NamedTuple):
    """The constants of the equations of motion, effects on body, drive, ground and delays applied.

    Attributes:
        a, b, c: [kg·m²].
        d: [N·m].
        offset: δ [rad].
        turn: I_xx - I_zz + m l² [kg·m²].
        radius: r [m].
        mass: M, of all [kg].
        weight: M g [N].
        arm: m l [kg·m].
        rotors: J [kg·m²]; 0 without backlash.
        gap: of the backlash, full width [rad].
        slope: σ at the start [rad].
        apart: half the track over the wheels' radius.
        geared: part of the wheels' inertia that turns relative to the body [kg·m²].
        coulomb, viscous, breakaway, stribeck_rate: of the joints, as of `Drive`.
        rolling, rolling_viscous, grip: of the ground, as of `Ground`.
        pushed: constant force at the axle beside those of effects [N].
        delay: of commands [s].
        lag: share of the way to the asked torque that the motors go in a physics step.
        fade: weight of the torque at a step's start in the mean over it.
        imu_delay: [s].
        step: of the physics [s].
    """

    a: float
    b: float
    c: float
    d: float
    offset: float
    turn: float
    radius: float
    mass: float
    weight: float
    arm: float
    rotors: float
    gap: float
    slope: float
    apart: float
    geared: float
    coulomb: float
    viscous: float
    breakaway: float
    stribeck_rate: float
    rolling: float
    rolling_viscous: float
    grip: float
    pushed: float
    delay: float
    lag: float
    fade: float
    imu_delay: float
    step: float


@kernel()
def constants(p: TwinParameters, step: float) -> Constants:
    """The constants of a twin, integrated at a physics step [s]."""
    q = quantities(p)
    m, height, r = q[Quantity.BODY_MASS], q[Quantity.COM_HEIGHT], q[Quantity.WHEEL_RADIUS]
    mass = m + 2.0 * p.wheel_mass
    geared = 2.0 * q[Quantity.GEARED_SHARE] * p.wheel_inertia
    time_constant = q[Quantity.MOTOR_LAG]
    lag = -expm1(-step / time_constant) if time_constant > 0.0 else 1.0
    return Constants(
        mass * r * r + 2.0 * p.wheel_inertia,
        m * height * r,
        q[Quantity.BODY_INERTIA_PITCH] + m * height * height + geared,
        m * GRAVITY * height,
        q[Quantity.COM_OFFSET],
        q[Quantity.TURN_INERTIA] + m * height * height,
        r,
        mass,
        mass * GRAVITY,
        m * height,
        2.0 * ROTOR_SHARE * p.wheel_inertia if q[Quantity.GAP] > 0.0 else 0.0,
        q[Quantity.GAP],
        q[Quantity.SLOPE],
        0.5 * p.track / r,
        geared,
        q[Quantity.COULOMB_FRICTION],
        q[Quantity.VISCOUS_FRICTION],
        q[Quantity.BREAKAWAY],
        q[Quantity.STRIBECK_RATE],
        q[Quantity.ROLLING_RESISTANCE],
        q[Quantity.ROLLING_VISCOUS],
        q[Quantity.GRIP],
        0.0,
        q[Quantity.COMMAND_DELAY],
        lag,
        lag * time_constant / step if time_constant > 0.0 else 0.0,
        q[Quantity.IMU_DELAY],
        step,
    )


class Forces(NamedTuple):
    """What acts on the coordinates at a step's start, beside the motors and all that is dry.

    Attributes:
        on_wheels: generalised force on φ [N·m].
        on_body: on θ [N·m].
        outside: force at the axle, contained in `on_wheels` [N].
    """

    on_wheels: float
    on_body: float
    outside: float


@kernel()
def slope_ahead(k: Constants, turning: Turning) -> float:
    """σ: by how much the ground rises in the direction in which the robot looks [rad]."""
    return k.slope if k.slope == 0.0 or turning.heading == 0.0 else k.slope * cos(turning.heading)


@kernel()
def tipped(k: Constants, s: TwinState, before: Turning, after: Turning) -> TwinState:
    """The state in angles from the vertical, once the robot has turned on its slope."""
    by = slope_ahead(k, before) - slope_ahead(k, after)
    return TwinState(
        s.tilt + by, s.wheel + by, s.tilt_rate, s.wheel_speed, s.torque, s.rotor + by, s.rotor_speed, s.slip, s.position
    )


@kernel()
def joint_torque(p: TwinParameters, k: Constants, s: TwinState, turning: Turning) -> float:
    """Torque in both joints beside the motors' and all that is dry [N·m]."""
    relative = s.wheel_speed - s.tilt_rate
    at = JointMotion(s.wheel - s.tilt, relative, 0.0, k.apart, turning.heading)
    return turn(p, -2.0 * k.viscous * relative, at)


@kernel()
def forces(p: TwinParameters, k: Constants, s: TwinState, time: float, turning: Turning) -> Forces:
    """Smooth forces: gravity, inertia, turning, what is in the joints, and what pushes from outside."""
    alpha = s.tilt + k.offset
    sine, spin = sin(alpha), turning.rate * turning.rate
    joint = joint_torque(p, k, s, turning)
    axle = AxleMotion(s.position, k.radius * s.wheel_speed + s.slip, time, k.weight)
    outside = push(p, 0.0, axle)
    if k.pushed != 0.0:
        outside += k.pushed
    slope = slope_ahead(k, turning)
    rising = sine if slope == 0.0 else sin(alpha + slope)
    wheels = joint + k.b * (rising * s.tilt_rate * s.tilt_rate + sine * spin)
    if slope != 0.0:
        wheels -= k.weight * k.radius * sin(slope)
    wheels += k.radius * outside - 2.0 * k.rolling_viscous * s.wheel_speed
    body = k.d * sine - joint + k.turn * spin * sine * cos(alpha)
    return Forces(wheels, body, outside)


@kernel()
def joint_bound(k: Constants, relative: float, apart: float) -> float:
    """Largest dry friction of both joints together [N·m].

    Args:
        k: constants of the twin.
        relative: mean rate of the wheels relative to the body [rad/s].
        apart: by which one wheel is faster than that and the other slower [rad/s].
    """
    bound = 2.0 * k.coulomb
    if k.breakaway > 0.0:
        for rate in (relative + apart, relative - apart):
            share = rate / k.stribeck_rate
            bound += k.breakaway * exp(-share * share)
    return bound


@kernel()
def _cut(value: float, bound: float) -> float:
    return min(max(value, -bound), bound)


@kernel()
def _rub(so_far: float, rate: float, inverse: float, bound: float, apart: float) -> float:
    """Change of the dry friction's impulse on both wheels.

    Alone, the impulse would bring a rate beyond what the wheels are apart back to that, where one of them stands still.

    Args:
        so_far: impulse of the rounds before.
        rate: mean of the wheels, with that impulse.
        inverse: inverse inertia.
        bound: of the impulse.
        apart: as of `joint_bound`.
    """
    wanted = _cut(rate - inverse * so_far, apart) if apart > 0.0 else 0.0
    return _cut(so_far - (rate - wanted) / inverse, bound) - so_far


@kernel()
def roll(p: TwinParameters, k: Constants, s: TwinState, torque: float, time: float, turning: Turning) -> TwinState:
    """One step of a robot whose wheels roll.

    Args:
        p: the twin.
        k: its constants.
        s: state at the step's start.
        torque: of the motors in this step, both together [N·m].
        time: since the rollout began [s].
        turning: of the robot.
    """
    h = k.step
    f = forces(p, k, s, time, turning)
    loose = k.rotors > 0.0
    a = k.a - k.rotors
    coupling = k.b * cos(s.tilt + k.offset + slope_ahead(k, turning)) - k.geared
    determinant = a * k.c - coupling * coupling
    w, v = k.c / determinant, -coupling / determinant  # inverse inertia: wheel by wheel, wheel by body
    q = a / determinant  # body by body
    on_wheels = f.on_wheels if loose else f.on_wheels + torque
    on_body = f.on_body - torque
    wheel_speed = s.wheel_speed + h * (w * on_wheels + v * on_body)
    tilt_rate = s.tilt_rate + h * (v * on_wheels + q * on_body)
    rotor_speed = s.rotor_speed + h * torque / k.rotors if loose else wheel_speed

    apart = k.apart * abs(turning.rate)
    joint = h * joint_bound(k, s.wheel_speed - s.tilt_rate, apart)
    ground = 2.0 * h * k.rolling
    if joint > 0.0 or ground > 0.0 or loose:
        half = 0.5 * k.gap
        contact = rubbing = rolling = 0.0
        alone = (joint > 0.0) + (ground > 0.0) + loose == 1
        for _ in range(1 if alone else _SWEEPS):
            if loose:
                inverse = w + 1.0 / k.rotors
                wanted = _cut(s.rotor - s.wheel + h * (rotor_speed - wheel_speed) + h * inverse * contact, half)
                free = rotor_speed - wheel_speed + inverse * contact
                change = (free - (wanted - s.rotor + s.wheel) / h) / inverse - contact
                contact += change
                rotor_speed -= change / k.rotors
                wheel_speed += w * change
                tilt_rate += v * change
            if ground > 0.0:
                change = _rub(rolling, wheel_speed, w, ground, apart)
                rolling += change
                wheel_speed += w * change
                tilt_rate += v * change
            if joint > 0.0:
                change = _rub(rubbing, wheel_speed - tilt_rate, w - 2.0 * v + q, joint, apart)
                rubbing += change
                wheel_speed += (w - v) * change
                tilt_rate += (v - q) * change
    wheel = s.wheel + h * wheel_speed
    return TwinState(
        s.tilt + h * tilt_rate,
        wheel,
        tilt_rate,
        wheel_speed,
        s.torque,
        s.rotor + h * rotor_speed if loose else wheel,
        rotor_speed if loose else wheel_speed,
        0.0,
        s.position + h * k.radius * wheel_speed,
    )


@kernel()
def slide(p: TwinParameters, k: Constants, s: TwinState, torque: float, time: float, turning: Turning) -> TwinState:
    r"""One step of a robot whose tyres may slip; backlash is left out.

    Axle speed v and wheel rate φ̇ are coordinates of their own, with 2 I_w = a - M r² and b / r in place of a and b;
    traction is dry friction at the tyres with the bound μ N, N being the weight that the body's motion leaves.

    Args: as of `roll`.
    """
    h, r = k.step, k.radius
    f = forces(p, k, s, time, turning)
    slope = slope_ahead(k, turning)
    spin = k.a - k.mass * r * r  # of both wheels about the axle
    alpha = s.tilt + k.offset
    coupling = k.arm * cos(alpha + slope)
    c = k.c - k.geared
    determinant = k.mass * c - coupling * coupling
    w, v, q = c / determinant, -coupling / determinant, k.mass / determinant  # axle by axle, by body; body by body
    rubbed = joint_torque(p, k, s, turning)
    rolled = -2.0 * k.rolling_viscous * s.wheel_speed
    on_axle = (f.on_wheels - rubbed - rolled) / r
    on_body = f.on_body - torque
    bend = v * on_axle + q * on_body  # θ̈ without traction
    speed = s.slip + r * s.wheel_speed + h * (w * on_axle + v * on_body)
    tilt_rate = s.tilt_rate + h * bend
    wheel_speed = s.wheel_speed + h * (torque + rubbed + rolled) / spin

    weight = k.weight * cos(slope) - k.arm * (cos(alpha) * s.tilt_rate**2 + sin(alpha) * bend)
    grip = h * k.grip * max(weight, 0.0)
    apart = k.apart * abs(turning.rate)
    joint = h * joint_bound(k, s.wheel_speed - s.tilt_rate, apart)
    ground = 2.0 * h * k.rolling
    traction = rubbing = rolling = 0.0
    for _ in range(1 if joint == 0.0 and ground == 0.0 else _SWEEPS):
        change = _cut(traction - (speed - r * wheel_speed) / (w + r * r / spin), grip) - traction
        traction += change
        speed += w * change
        tilt_rate += v * change
        wheel_speed -= r * change / spin
        change = _rub(rolling, wheel_speed, 1.0 / spin, ground, apart)
        rolling += change
        wheel_speed += change / spin
        change = _rub(rubbing, wheel_speed - tilt_rate, 1.0 / spin + q, joint, apart)
        rubbing += change
        wheel_speed += change / spin
        tilt_rate -= q * change
        speed -= v * change
    wheel = s.wheel + h * wheel_speed
    slip = speed - r * wheel_speed
    tilt = s.tilt + h * tilt_rate
    return TwinState(tilt, wheel, tilt_rate, wheel_speed, s.torque, wheel, wheel_speed, slip, s.position + h * speed)


@kernel()
def step(p: TwinParameters, k: Constants, s: TwinState, torque: float, time: float, turning: Turning) -> TwinState:
    """One physics step, as of `roll` or `slide`."""
    if k.grip < UNBOUNDED:
        return slide(p, k, s, torque, time, turning)
    return roll(p, k, s, torque, time, turning)
