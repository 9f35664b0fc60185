"""One physics step of the planar model whose tyres may slip; the equations are those of `twbal.planar.motion`."""

from twbal.core.compiled import kernel
from twbal.core.robot_parameters import GRAVITY
from twbal.core.sine_cosine import sine_and_cosine
from twbal.core.tyres import traction_impulse
from twbal.planar.constants import Constants
from twbal.planar.dry_friction import SWEEPS, is_settled, joint_bound
from twbal.planar.forces import forces, joint_torque, slope_ahead, swung, without_swinging
from twbal.planar.parameters import PlanarParameters
from twbal.planar.planar_state import PlanarState, Turning
from twbal.planar.presliding import Contact, frictions, rub_or_bend, torques

_traction = kernel(is_inlined=True)(traction_impulse)


@kernel(is_inlined=True)
def slide(
    p: PlanarParameters, k: Constants, s: PlanarState, torque: float, time: float, turning: Turning
) -> PlanarState:
    r"""One step of a robot whose tyres may slip; backlash is left out.

    Axle speed v and wheel rate φ̇ are coordinates of their own, with 2 I_w = a - M r² and b / r in place of a and b;
    traction is dry friction at the tyres with the bound μ N, N being the weight that the body's motion leaves.

    Args: as of `twbal.planar.rolling.roll`.
    """
    h, r = k.step, k.radius
    f = forces(p, k, s, torque, time, turning)
    slope = slope_ahead(k, turning)
    spin = k.a - k.mass * r * r  # of both wheels about the axle
    alpha = s.tilt + k.offset
    mass, coupling, c = without_swinging(k, f.leaning, k.mass, k.arm * f.leaning, k.c - k.geared)
    determinant = mass * c - coupling * coupling
    w, v, q = c / determinant, -coupling / determinant, mass / determinant  # axle by axle, by body; body by body
    rubbed = joint_torque(p, k, s, torque, turning)
    rolled = -2.0 * k.rolling_viscous * s.wheel_speed
    on_axle = (f.on_wheels - rubbed - rolled) / r
    on_body = f.on_body - torque
    bend = v * on_axle + q * on_body  # θ̈ without traction
    speed = s.slip + r * s.wheel_speed + h * (w * on_axle + v * on_body)
    tilt_rate = s.tilt_rate + h * bend
    wheel_speed = s.wheel_speed + h * (torque + rubbed + rolled) / spin

    sine, cosine = sine_and_cosine(alpha)
    weight = k.mass * GRAVITY * sine_and_cosine(slope).cosine - k.arm * (cosine * s.tilt_rate**2 + sine * bend)
    grip = h * k.grip * max(weight, 0.0)
    mobility = w + r * r / spin  # of the slip, by traction
    apart = k.apart * abs(turning.rate)
    joint = h * joint_bound(k, s.wheel_speed - s.tilt_rate, apart)
    ground = 2.0 * h * k.dry.rolling
    of_joint = spin / (1.0 + spin * q)
    at_joint, at_ground = Contact(wheel_speed - tilt_rate, of_joint, joint), Contact(wheel_speed, spin, ground)
    in_joints, on_ground = frictions(k, s, at_joint, at_ground, turning)
    traction = rubbing = rolling = 0.0
    for _ in range(1 if joint == 0.0 and ground == 0.0 else SWEEPS):
        before = traction, rolling, rubbing
        change = _traction(speed - r * wheel_speed - mobility * traction, mobility, grip, k.creep) - traction
        traction += change
        speed += w * change
        tilt_rate += v * change
        wheel_speed -= r * change / spin
        change = rub_or_bend(rolling, wheel_speed, spin, ground, apart, on_ground)
        rolling += change
        wheel_speed += change / spin
        change = rub_or_bend(rubbing, wheel_speed - tilt_rate, of_joint, joint, apart, in_joints)
        rubbing += change
        wheel_speed += change / spin
        tilt_rate -= q * change
        speed -= v * change
        if is_settled(traction, rolling, rubbing, before):
            break
    wheel, slip, way = s.wheel + h * wheel_speed, speed - r * wheel_speed, h * speed
    sway, sway_rate = swung(k, s, f, speed - s.slip - r * s.wheel_speed, tilt_rate - s.tilt_rate)
    joints, wheels = torques(k, in_joints, wheel_speed - tilt_rate), torques(k, on_ground, wheel_speed)
    return PlanarState(
        s.tilt + h * tilt_rate, wheel, tilt_rate, wheel_speed, s.torque, wheel, wheel_speed, slip, s.position + way,
        s.driver_torque, sway, sway_rate, s.x + way * turning.cosine, s.y + way * turning.sine, *joints, *wheels,
    )  # fmt: skip
