"""The constants of the planar model's equations of motion, by its parameters."""

from math import expm1, nan, pi
from typing import NamedTuple

from twbal.core.compiled import kernel
from twbal.core.gaussian import Array
from twbal.core.play import Play
from twbal.core.quantities import Quantity
from twbal.core.robot_model import UNBOUNDED
from twbal.core.robot_parameters import GRAVITY
from twbal.planar.parameters import PlanarParameters
from twbal.planar.terms import quantities


class Swing(NamedTuple):
    """The part of the body that swings on a frame that yields; all 0 where the frame is rigid.

    Attributes:
        mass: m_s [kg].
        height: h, above the axle [m].
        stiffness: of the spring, m_s ω² [N/m]; nan where the part leaves no body (`core.swinging_part.without_part`).
        damping: 2 ζ m_s ω [N·s/m].
    """

    mass: float
    height: float
    stiffness: float
    damping: float


class FilterTimes(NamedTuple):
    """Of a complementary filter of the tilt.

    Attributes:
        rate: at which it follows the accelerometer [1/s]; 0 where there is none.
        lead: by which the sum of the gyro in it runs ahead of the tilt [s].
    """

    rate: float
    lead: float


class DryFriction(NamedTuple):
    """Of the joints and the ground.

    Attributes:
        coulomb, breakaway, stribeck_rate, presliding: as of `DriveTrain`.
        rolling: of the ground, for each wheel [N·m].
    """

    coulomb: float
    breakaway: float
    stribeck_rate: float
    rolling: float
    presliding: float


class Constants(NamedTuple):
    """The constants of the equations of motion, effects on body, drive, ground and delays applied.

    They are 30 at most: numba compiles no call with more arguments in a row.

    Attributes:
        a, b, c: [kg·m²]; c is with what turning the body does to geared rotors (`twbal.planar.rolling`).
        d: [N·m].
        offset: δ [rad].
        turn: I_xx - I_zz + m l² [kg·m²].
        radius: r [m].
        mass: M, of all [kg].
        arm: m l [kg·m].
        swing: what of the body swings.
        play: the backlash.
        slope: σ at the start [rad].
        apart: half the track over the wheels' radius.
        geared: part of the wheels' inertia that turns relative to the body, on the wheels' side of a backlash [kg·m²].
        geared_rotors: share of the rotors' inertia behind a backlash that turns relative to the body.
        dry: friction of joints and ground.
        viscous: friction of the joints, as of `DriveTrain`.
        rolling_viscous, grip: of the ground, as of `Ground`.
        creep: speed of slip at which the tyres slide [m/s].
        pushed: constant force at the axle beside those of effects [N].
        delay: of commands [s].
        lag: share of the way to the demanded torque that the motors go in a physics step.
        fade: weight of the torque at a step's start in the mean over it.
        slew: most by which the demanded torque changes in a physics step [N·m].
        imu_delay: [s].
        filter: of the tilt.
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
    arm: float
    swing: Swing
    play: Play
    slope: float
    apart: float
    geared: float
    geared_rotors: float
    dry: DryFriction
    viscous: float
    rolling_viscous: float
    grip: float
    creep: float
    pushed: float
    delay: float
    lag: float
    fade: float
    slew: float
    imu_delay: float
    filter: FilterTimes
    step: float


@kernel()
def _swing(q: Array) -> Swing:
    """What of the body swings, by the robot's quantities."""
    share, ratio = q[Quantity.SWINGING_SHARE], q[Quantity.SWING_HEIGHT]
    mass, height = share * q[Quantity.BODY_MASS], q[Quantity.COM_HEIGHT]
    pace, pitch = 2.0 * pi * q[Quantity.SWING_FREQUENCY], q[Quantity.BODY_INERTIA_PITCH]
    less = mass * (height * (ratio - 1.0)) ** 2 / (1.0 - share)  # by which the rest of the body has less inertia
    is_body = pitch > less and pitch + q[Quantity.TURN_INERTIA] >= 2.0 * less
    return Swing(
        mass, ratio * height, mass * pace * pace if is_body else nan, 2.0 * q[Quantity.SWING_DAMPING] * mass * pace
    )


@kernel()
def _dry(q: Array) -> DryFriction:
    """Dry friction, by the robot's quantities."""
    return DryFriction(
        q[Quantity.COULOMB_FRICTION],
        q[Quantity.BREAKAWAY],
        q[Quantity.STRIBECK_RATE],
        q[Quantity.ROLLING_RESISTANCE],
        q[Quantity.PRESLIDING],
    )


@kernel()
def _play(q: Array, wheel_inertia: float) -> Play:
    """The play in the gears, by the robot's quantities and the inertia of each wheel with its rotor [kg·m²]."""
    is_behind_encoder = q[Quantity.SHAFT_GAP] > 0.0
    gap, share, time, damping = (
        q[Quantity.GAP], q[Quantity.ROTOR_SHARE], q[Quantity.CONTACT_TIME], q[Quantity.CONTACT_DAMPING],
    )  # fmt: skip
    if is_behind_encoder:
        gap, share = q[Quantity.SHAFT_GAP], q[Quantity.SHAFT_ROTOR_SHARE]
        time, damping = q[Quantity.SHAFT_CONTACT_TIME], q[Quantity.SHAFT_CONTACT_DAMPING]
    rotors = 2.0 * share * wheel_inertia if gap > 0.0 else 0.0
    pace = pi / time if time > 0.0 else 0.0
    return Play(rotors, gap, pace * pace * rotors, 2.0 * damping * pace * rotors, 1.0 if is_behind_encoder else 0.0)


@kernel()
def constants(p: PlanarParameters, step: float) -> Constants:
    """The constants of a planar model, integrated at a physics step [s]."""
    q = quantities(p)
    m, height, r = q[Quantity.BODY_MASS], q[Quantity.COM_HEIGHT], q[Quantity.WHEEL_RADIUS]
    mass = m + 2.0 * p.wheel_mass
    play = _play(q, p.wheel_inertia)
    geared = 2.0 * q[Quantity.GEARED_SHARE] * p.wheel_inertia
    behind = min(geared, play.rotors) if q[Quantity.GRIP] >= UNBOUNDED else 0.0  # wheels that slip have no backlash
    geared_rotors = behind / play.rotors if behind > 0.0 else 0.0
    geared -= behind
    time_constant = q[Quantity.MOTOR_LAG]
    lag = -expm1(-step / time_constant) if time_constant > 0.0 else 1.0
    fade = lag * time_constant / step if time_constant > 0.0 else 0.0
    slew = q[Quantity.SLEW_RATE] * step if q[Quantity.SLEW_RATE] < UNBOUNDED else UNBOUNDED
    return Constants(
        mass * r * r + 2.0 * p.wheel_inertia,
        m * height * r,
        q[Quantity.BODY_INERTIA_PITCH] + m * height * height + (geared + (1.0 - geared_rotors) * behind),
        m * GRAVITY * height,
        q[Quantity.COM_OFFSET],
        q[Quantity.TURN_INERTIA] + m * height * height,
        r,
        mass,
        m * height,
        _swing(q),
        play,
        q[Quantity.SLOPE],
        0.5 * p.track / r,
        geared,
        geared_rotors,
        _dry(q),
        q[Quantity.VISCOUS_FRICTION],
        q[Quantity.ROLLING_VISCOUS],
        q[Quantity.GRIP],
        q[Quantity.TYRE_CREEP],
        0.0,
        q[Quantity.COMMAND_DELAY],
        lag,
        fade,
        slew,
        q[Quantity.IMU_DELAY],
        FilterTimes(q[Quantity.TILT_FILTER_RATE], q[Quantity.TILT_FILTER_LEAD]),
        step,
    )


@kernel(is_inlined=True)
def with_step(k: Constants, step: float, imu_delay: float) -> Constants:
    """The constants for another physics step and a delay of the IMU [s], without going through the effects again."""
    time_constant = k.fade * k.step / k.lag
    lag = -expm1(-step / time_constant) if time_constant > 0.0 else 1.0
    return Constants(
        k.a,
        k.b,
        k.c,
        k.d,
        k.offset,
        k.turn,
        k.radius,
        k.mass,
        k.arm,
        k.swing,
        k.play,
        k.slope,
        k.apart,
        k.geared,
        k.geared_rotors,
        k.dry,
        k.viscous,
        k.rolling_viscous,
        k.grip,
        k.creep,
        k.pushed,
        k.delay,
        lag,
        lag * time_constant / step if time_constant > 0.0 else 0.0,
        k.slew * step / k.step if k.slew < UNBOUNDED else UNBOUNDED,
        imu_delay,
        k.filter,
        step,
    )
