"""The smooth forces on the planar model: gravity, inertia, what is in the joints, and what pushes from outside."""

from typing import NamedTuple

from twbal.core.compiled import kernel, rarely
from twbal.core.robot_model import AxleMotion, JointMotion
from twbal.core.robot_parameters import GRAVITY
from twbal.core.sine_cosine import sine_and_cosine
from twbal.planar.constants import Constants
from twbal.planar.parameters import PlanarParameters
from twbal.planar.planar_state import PlanarState, Turning
from twbal.planar.terms import push, turn


class Forces(NamedTuple):
    """What acts on the coordinates at a step's start, beside the motors and all that is dry.

    Attributes:
        on_wheels: generalised force on φ [N·m].
        on_body: on θ [N·m].
        outside: force at the axle, contained in `on_wheels` [N].
        leaning: cosine of the angle between the body and the ground's normal, α + σ.
        swinging: what a part of the body that swings pushes the rest forward with, across the body, less what weight
            and turning push it forward with; 0 where nothing swings [N].
    """

    on_wheels: float
    on_body: float
    outside: float
    leaning: float
    swinging: float


@kernel(is_inlined=True)
def slope_ahead(k: Constants, turning: Turning) -> float:
    """σ: by how much the ground rises in the direction in which the robot looks [rad]."""
    return k.slope * turning.cosine


@kernel(is_inlined=True)
def tipped(k: Constants, s: PlanarState, before: Turning, after: Turning) -> PlanarState:
    """The state in angles from the vertical, once the robot has turned on its slope."""
    by = slope_ahead(k, before) - slope_ahead(k, after)
    return PlanarState(
        s.tilt + by,
        s.wheel + by,
        s.tilt_rate,
        s.wheel_speed,
        s.torque,
        s.rotor + by,
        s.rotor_speed,
        s.slip,
        s.position,
        s.driver_torque,
        s.sway,
        s.sway_rate,
        s.x,
        s.y,
        s.left_joint,
        s.right_joint,
        s.left_ground,
        s.right_ground,
    )


@kernel(is_inlined=True)
def joint_torque(p: PlanarParameters, k: Constants, s: PlanarState, torque: float, turning: Turning) -> float:
    """Torque in both joints beside the motors' `torque` and all that is dry [N·m]."""
    relative = s.wheel_speed - s.tilt_rate
    at = JointMotion(s.wheel - s.tilt, relative, k.apart, turning.heading, k.apart * turning.rate)
    return turn(p, torque, at) - torque - 2.0 * k.viscous * relative


class Inertias(NamedTuple):
    """What resists accelerations of wheels, or axle, and body.

    Attributes:
        own: of wheels [kg·m²] or axle [kg].
        coupling: between them and the body [kg·m²] or [kg·m].
        body: [kg·m²].
    """

    own: float
    coupling: float
    body: float


@kernel(is_inlined=True)
def without_swinging(k: Constants, along: float, own: float, coupling: float, body: float) -> Inertias:
    """Inertias without the part of the body that swings, which takes no part in motion across the body.

    Args:
        k: constants of the planar model.
        along: way of that part across the body for each unit of what `own` resists: [m] or 1.
        own, coupling, body: as of `Inertias`, with the part.
    """
    if rarely(k.swing.mass > 0.0):
        mass, height = k.swing.mass, k.swing.height
        return Inertias(own - mass * along * along, coupling - mass * along * height, body - mass * height * height)
    return Inertias(own, coupling, body)


@kernel(is_inlined=True)
def swung(k: Constants, s: PlanarState, f: Forces, speed: float, tilt_rate: float) -> tuple[float, float]:
    """Where the part of the body that swings is after a step, and its rate: y [m], y' [m/s].

    Args:
        k: constants of the planar model.
        s: state at the step's start.
        f: forces there.
        speed: change of the axle's speed in the step [m/s].
        tilt_rate: change of the tilt rate in the step [rad/s].
    """
    if not rarely(k.swing.mass > 0.0):
        return s.sway, s.sway_rate
    rate = s.sway_rate - k.step * (f.swinging / k.swing.mass - s.sway * s.tilt_rate * s.tilt_rate)
    rate -= f.leaning * speed + k.swing.height * tilt_rate
    return s.sway + k.step * rate, rate


@kernel(is_inlined=True)
def turning_over(p: PlanarParameters, k: Constants, spin: float, rising: float, leaning: float) -> float:
    """What turning about the normal of the ground tips the body forward with [N·m].

    With α the angle of the centre of mass from that normal, it is ψ̇² (m l² sin α cos α + J sin β cos β). The body's
    inertias, of which J = I_xx - I_zz, are about axes of the body, and so lie at the angle β = α - δ.

    Args:
        p, k: the planar model, and its constants.
        spin: ψ̇² [rad²/s²].
        rising, leaning: sine and cosine of α.
    """
    torque = k.turn * spin * rising * leaning
    if rarely(k.offset != 0.0):  # sin β cos β - sin α cos α = -sin δ cos(2 α - δ)
        own = k.turn - k.arm * k.arm / (k.mass - 2.0 * p.wheel_mass)
        sine, cosine = sine_and_cosine(k.offset)
        twice = cosine * (leaning * leaning - rising * rising) + sine * (2.0 * rising * leaning)
        torque -= own * spin * sine * twice
    return torque


@kernel(is_inlined=True)
def forces(p: PlanarParameters, k: Constants, s: PlanarState, torque: float, time: float, turning: Turning) -> Forces:
    """Smooth forces: gravity, inertia, turning, what is in the joints, and what pushes from outside.

    Args: as of `twbal.planar.rolling.roll`.
    """
    alpha = s.tilt + k.offset
    (sine, cosine), spin = sine_and_cosine(alpha), turning.rate * turning.rate
    joint = joint_torque(p, k, s, torque, turning)
    speed, weight = k.radius * s.wheel_speed + s.slip, k.mass * GRAVITY
    axle = AxleMotion(
        s.position, speed, time, weight, s.wheel, s.wheel_speed, k.apart, turning.heading, s.x, s.y, turning.cosine,
        turning.sine,
    )  # fmt: skip
    outside = push(p, 0.0, axle)
    if rarely(k.pushed != 0.0):
        outside += k.pushed
    slope = slope_ahead(k, turning)
    rising, leaning = sine, cosine
    if rarely(slope != 0.0):
        rising, leaning = sine_and_cosine(alpha + slope)
    wheels = joint + k.b * rising * (s.tilt_rate * s.tilt_rate + spin)
    if rarely(slope != 0.0):
        wheels -= weight * k.radius * sine_and_cosine(slope).sine
    wheels += k.radius * outside - 2.0 * k.rolling_viscous * s.wheel_speed
    body = k.d * sine - joint
    if rarely(spin != 0.0):
        body += turning_over(p, k, spin, rising, leaning)
    back = 0.0
    if rarely(k.swing.mass > 0.0):
        outwards = k.swing.mass * (sine * GRAVITY + k.swing.height * spin * rising * leaning)
        back = k.swing.stiffness * s.sway + k.swing.damping * s.sway_rate - outwards
        across = 2.0 * s.tilt_rate * s.sway_rate
        hangs = GRAVITY * cosine - k.swing.height * s.tilt_rate * s.tilt_rate - across
        wheels += k.radius * (leaning * back + k.swing.mass * across * rising)
        body += k.swing.height * back + k.swing.mass * hangs * s.sway
    return Forces(wheels, body, outside, leaning, back)
