"""One physics step of the planar model whose tyres may slip; the equations are those of `twbal.planar.motion`."""

from typing import NamedTuple

from twbal.core.compiled import kernel
from twbal.core.robot_parameters import GRAVITY
from twbal.core.sine_cosine import sine_and_cosine
from twbal.core.tyres import traction_impulse
from twbal.planar.constants import Constants
from twbal.planar.dry_friction import SWEEPS, cut, extrapolation_factor, is_settled, joint_bound
from twbal.planar.forces import forces, joint_torque, slope_ahead, swung, without_swinging
from twbal.planar.parameters import PlanarParameters
from twbal.planar.planar_state import PlanarState, Turning
from twbal.planar.presliding import Bristles, Contact, frictions, rub_or_bend, torques

_traction = kernel(is_inlined=True)(traction_impulse)


class _Mobilities(NamedTuple):
    """The inverse of the mass matrix: what axle speed, tilt rate and wheel rate gain by an impulse on each of them."""

    axle: float
    axle_body: float
    axle_wheels: float
    body: float
    body_wheels: float
    wheels: float


@kernel(is_inlined=True)
def _mobilities(mass: float, coupling: float, c: float, geared: float, spin: float) -> _Mobilities:
    """Of the mass matrix ((mass, coupling, 0), (coupling, c, -geared), (0, -geared, spin))."""
    bent = c * spin - geared * geared
    determinant = mass * bent - coupling * coupling * spin
    return _Mobilities(
        bent / determinant,
        -coupling * spin / determinant,
        -coupling * geared / determinant,
        mass * spin / determinant,
        mass * geared / determinant,
        (mass * c - coupling * coupling) / determinant,
    )


class _Rates(NamedTuple):
    """At the end of a step: speed of the axle [m/s], tilt rate and wheel rate [rad/s]."""

    axle: float
    tilt: float
    wheels: float


class _DryFriction(NamedTuple):
    """Dry friction in a step, but for traction.

    Attributes:
        joint, ground: bounds of its impulses on both wheels, from the body and from the ground [N·m·s].
        of_joint, of_ground: inertias against which these impulses change the rates there [kg·m²].
        in_joints, on_ground: its bristles.
        apart: as of `joint_bound`.
    """

    joint: float
    ground: float
    of_joint: float
    of_ground: float
    in_joints: Bristles
    on_ground: Bristles
    apart: float


@kernel(is_inlined=True)
def _pulled(rates: _Rates, m: _Mobilities, radius: float, impulse: float) -> _Rates:
    """Rates after an impulse of traction [N·s]."""
    return _Rates(
        rates.axle + (m.axle - radius * m.axle_wheels) * impulse,
        rates.tilt + (m.axle_body - radius * m.body_wheels) * impulse,
        rates.wheels + (m.axle_wheels - radius * m.wheels) * impulse,
    )


@kernel(is_inlined=True)
def _rolled(rates: _Rates, m: _Mobilities, impulse: float) -> _Rates:
    """Rates after an impulse of the ground's dry friction on the wheels [N·m·s]."""
    return _Rates(
        rates.axle + m.axle_wheels * impulse,
        rates.tilt + m.body_wheels * impulse,
        rates.wheels + m.wheels * impulse,
    )


@kernel(is_inlined=True)
def _rubbed(rates: _Rates, m: _Mobilities, impulse: float) -> _Rates:
    """Rates after an impulse of the dry friction between body and wheels [N·m·s]."""
    return _Rates(
        rates.axle + (m.axle_wheels - m.axle_body) * impulse,
        rates.tilt + (m.body_wheels - m.body) * impulse,
        rates.wheels + (m.wheels - m.body_wheels) * impulse,
    )


@kernel(is_inlined=True)
def _with_friction(
    k: Constants, m: _Mobilities, mobility: float, grip: float, dry: _DryFriction, rates: _Rates
) -> _Rates:
    """Rates after the impulses of traction and of dry friction, which depend on one another.

    They are found one after the other, round by round. Each round changes them by about the same share of what is left
    to change, so that their limit is extrapolated from the last two rounds.

    Args:
        k, m: constants of the planar model; mobilities.
        mobility: of the slip, by traction [1/kg].
        grip: bound of the traction [N·s].
        dry: the rest of the dry friction.
        rates: without either.
    """
    traction = rolling = rubbing = ahead = 0.0
    changed = found = 0.0, 0.0
    for number in range(1 if dry.joint == 0.0 and dry.ground == 0.0 else SWEEPS):
        before = traction, rolling, rubbing
        rolling += rub_or_bend(rolling, rates.wheels, dry.of_ground, dry.ground, dry.apart, dry.on_ground)
        rates = _rolled(rates, m, rolling - before[1])
        rubbing += rub_or_bend(rubbing, rates.wheels - rates.tilt, dry.of_joint, dry.joint, dry.apart, dry.in_joints)
        rates = _rubbed(rates, m, rubbing - before[2])
        if number > 0 and ahead == 0.0 and is_settled(0.0, rolling, rubbing, (0.0, before[1], before[2])):
            break  # so that the traction would be as it is
        traction = _traction(rates.axle - k.radius * rates.wheels - mobility * traction, mobility, grip, k.creep)
        rates = _pulled(rates, m, k.radius, traction - before[0])
        if is_settled(traction, rolling, rubbing, before):
            break
        last, changed = changed, (k.radius * (traction - before[0]), rubbing - before[2] if dry.ground > 0.0 else 0.0)
        ahead = extrapolation_factor(changed, last, number) if number < SWEEPS - 1 else 0.0
        pull = cut(traction + ahead * (traction - found[0]), grip) - traction
        rub = cut(rubbing + ahead * (rubbing - found[1]), dry.joint) - rubbing if dry.ground > 0.0 else 0.0
        found = traction, rubbing
        traction, rubbing, rates = traction + pull, rubbing + rub, _rubbed(_pulled(rates, m, k.radius, pull), m, rub)
    return rates


@kernel(is_inlined=True)
def slide(
    p: PlanarParameters, k: Constants, s: PlanarState, torque: float, time: float, turning: Turning
) -> PlanarState:
    r"""One step of a robot whose tyres may slip; backlash is left out.

    Axle speed v and wheel rate φ̇ are coordinates of their own, with 2 I_w = a - M r² and b / r in place of a and b;
    traction is dry friction at the tyres with the bound μ N, N being the weight that the body's motion leaves. Geared
    rotors couple wheels and body by -g in the mass matrix of v, θ̇ and φ̇.

    Args: as of `twbal.planar.rolling.roll`.
    """
    h, r = k.step, k.radius
    f = forces(p, k, s, torque, time, turning)
    slope = slope_ahead(k, turning)
    spin = k.a - k.mass * r * r  # of both wheels about the axle
    alpha = s.tilt + k.offset
    mass, coupling, c = without_swinging(k, f.leaning, k.mass, k.arm * f.leaning, k.c)
    m = _mobilities(mass, coupling, c, k.geared, spin)
    rubbed = joint_torque(p, k, s, torque, turning)
    rolled = -2.0 * k.rolling_viscous * s.wheel_speed
    on_axle = (f.on_wheels - rubbed - rolled) / r
    on_body, on_wheels = f.on_body - torque, torque + rubbed + rolled
    bend = m.axle_body * on_axle + m.body * on_body + m.body_wheels * on_wheels  # θ̈ without traction
    speed = s.slip + r * s.wheel_speed
    speed += h * (m.axle * on_axle + m.axle_body * on_body + m.axle_wheels * on_wheels)
    tilt_rate = s.tilt_rate + h * bend
    wheel_speed = s.wheel_speed + h * (m.axle_wheels * on_axle + m.body_wheels * on_body + m.wheels * on_wheels)

    sine, cosine = sine_and_cosine(alpha)
    weight = k.mass * GRAVITY * sine_and_cosine(slope).cosine - k.arm * (cosine * s.tilt_rate**2 + sine * bend)
    grip = h * k.grip * max(weight, 0.0)
    mobility = m.axle - 2.0 * r * m.axle_wheels + r * r * m.wheels  # of the slip, by traction
    apart = k.apart * abs(turning.rate)
    joint = h * joint_bound(k, s.wheel_speed - s.tilt_rate, apart)
    ground = 2.0 * h * k.dry.rolling
    of_joint, of_wheels = 1.0 / (m.wheels - 2.0 * m.body_wheels + m.body), 1.0 / m.wheels
    at_joint, at_ground = Contact(wheel_speed - tilt_rate, of_joint), Contact(wheel_speed, of_wheels)
    in_joints, on_ground = frictions(k, s, at_joint, at_ground, turning)
    dry = _DryFriction(joint, ground, of_joint, of_wheels, in_joints, on_ground, apart)
    speed, tilt_rate, wheel_speed = _with_friction(k, m, mobility, grip, dry, _Rates(speed, tilt_rate, wheel_speed))
    wheel, slip, way = s.wheel + h * wheel_speed, speed - r * wheel_speed, h * speed
    sway, sway_rate = swung(k, s, f, speed - s.slip - r * s.wheel_speed, tilt_rate - s.tilt_rate)
    joints, wheels = torques(k, in_joints, wheel_speed - tilt_rate), torques(k, on_ground, wheel_speed)
    return PlanarState(
        s.tilt + h * tilt_rate, wheel, tilt_rate, wheel_speed, s.torque, wheel, wheel_speed, slip, s.position + way,
        s.driver_torque, sway, sway_rate, s.x + way * turning.cosine, s.y + way * turning.sine, *joints, *wheels,
    )  # fmt: skip
