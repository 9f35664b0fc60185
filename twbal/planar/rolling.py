"""One physics step of the planar model whose wheels roll; the equations are those of `twbal.planar.motion`."""

from twbal.core.compiled import kernel, rarely
from twbal.core.play import engage
from twbal.planar.constants import Constants
from twbal.planar.dry_friction import SWEEPS, is_settled, joint_bound
from twbal.planar.forces import forces, swung, without_swinging
from twbal.planar.parameters import PlanarParameters
from twbal.planar.planar_state import PlanarState, Turning
from twbal.planar.presliding import Contact, frictions, rub_or_bend, torques


@kernel(is_inlined=True)
def roll(
    p: PlanarParameters, k: Constants, s: PlanarState, torque: float, time: float, turning: Turning
) -> PlanarState:
    """One step of a robot whose wheels roll.

    Args:
        p, k: the planar model, and its constants.
        s, turning: state at the step's start, and how the robot turns.
        torque: of the motors in this step, both together [N·m].
        time: since the rollout began [s].
    """
    h = k.step
    f = forces(p, k, s, torque, time, turning)
    loose = k.play.rotors > 0.0
    coupling = k.b * f.leaning - k.geared
    a, coupling, c = without_swinging(k, k.radius * f.leaning, k.a - k.play.rotors, coupling, k.c)
    determinant = a * c - coupling * coupling
    inverse = 1.0 / determinant
    w, v = c * inverse, -coupling * inverse  # inverse inertia: wheel by wheel, wheel by body
    q = a * inverse  # body by body
    on_wheels = f.on_wheels if loose else f.on_wheels + torque
    on_body = f.on_body - torque
    wheel_speed = s.wheel_speed + h * (w * on_wheels + v * on_body)
    tilt_rate = s.tilt_rate + h * (v * on_wheels + q * on_body)
    rotor_speed, ahead = s.rotor_speed + h * torque / k.play.rotors if loose else wheel_speed, 0.0

    apart = k.apart * abs(turning.rate)
    joint = h * joint_bound(k, s.wheel_speed - s.tilt_rate, apart)
    ground = 2.0 * h * k.dry.rolling
    of_joint, of_ground = determinant / (a + 2.0 * coupling + c), determinant / c  # inertias against their changes
    at_joint, at_ground = Contact(wheel_speed - tilt_rate, of_joint), Contact(wheel_speed, of_ground)
    in_joints, on_ground = frictions(k, s, at_joint, at_ground, turning)
    if joint > 0.0 or ground > 0.0 or loose:
        contact = rubbing = rolling = 0.0
        for _ in range(1 if (joint > 0.0) + (ground > 0.0) + loose == 1 else SWEEPS):
            before = contact, rolling, rubbing
            if rarely(loose):
                free = rotor_speed - wheel_speed + (w + 1.0 / k.play.rotors) * contact
                pushed, ahead = engage(k.play, h, s.rotor - s.wheel, s.rotor_speed - s.wheel_speed, free, w)
                change = pushed - contact
                contact = pushed
                rotor_speed -= change / k.play.rotors
                wheel_speed += w * change
                tilt_rate += v * change
            if rarely(ground > 0.0):
                change = rub_or_bend(rolling, wheel_speed, of_ground, ground, apart, on_ground)
                rolling += change
                wheel_speed += w * change
                tilt_rate += v * change
            if joint > 0.0:
                change = rub_or_bend(rubbing, wheel_speed - tilt_rate, of_joint, joint, apart, in_joints)
                rubbing += change
                wheel_speed += (w - v) * change
                tilt_rate += (v - q) * change
            if is_settled(contact, rolling, rubbing, before):
                break
    wheel, way = s.wheel + h * wheel_speed, h * k.radius * wheel_speed
    sway, sway_rate = swung(k, s, f, k.radius * (wheel_speed - s.wheel_speed), tilt_rate - s.tilt_rate)
    joints, wheels = torques(k, in_joints, wheel_speed - tilt_rate), torques(k, on_ground, wheel_speed)
    return PlanarState(
        s.tilt + h * tilt_rate, wheel, tilt_rate, wheel_speed, s.torque, wheel + ahead,
        rotor_speed if loose else wheel_speed, 0.0, s.position + way, s.driver_torque, sway, sway_rate,
        s.x + way * turning.cosine, s.y + way * turning.sine, *joints, *wheels,
    )  # fmt: skip
