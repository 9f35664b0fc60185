"""One physics step of the planar model whose wheels roll; the equations are those of `twbal.planar.motion`."""

from twbal.core.compiled import kernel, rarely
from twbal.planar.constants import Constants
from twbal.planar.dry_friction import SWEEPS, cut, joint_bound, rub
from twbal.planar.forces import forces, swung
from twbal.planar.parameters import PlanarParameters
from twbal.planar.planar_state import PlanarState, Turning


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
    f = forces(p, k, s, time, turning)
    loose = k.play.rotors > 0.0
    a, c = k.a - k.play.rotors, k.c
    coupling = k.b * f.leaning - k.geared
    if rarely(k.swing.mass > 0.0):  # what swings takes no part in motion across the body
        along, height = k.radius * f.leaning, k.swing.height
        a -= k.swing.mass * along * along
        c -= k.swing.mass * height * height
        coupling -= k.swing.mass * along * height
    determinant = a * c - coupling * coupling
    inverse = 1.0 / determinant
    w, v = c * inverse, -coupling * inverse  # inverse inertia: wheel by wheel, wheel by body
    q = a * inverse  # body by body
    on_wheels = f.on_wheels if loose else f.on_wheels + torque
    on_body = f.on_body - torque
    wheel_speed = s.wheel_speed + h * (w * on_wheels + v * on_body)
    tilt_rate = s.tilt_rate + h * (v * on_wheels + q * on_body)
    rotor_speed = s.rotor_speed + h * torque / k.play.rotors if loose else wheel_speed

    apart = k.apart * abs(turning.rate)
    joint = h * joint_bound(k, s.wheel_speed - s.tilt_rate, apart)
    ground = 2.0 * h * k.rolling
    if joint > 0.0 or ground > 0.0 or loose:
        half = 0.5 * k.play.gap
        contact = rubbing = rolling = 0.0
        of_joint = determinant / (a + 2.0 * coupling + c)  # inertia against a change of the joint's rate
        alone = (joint > 0.0) + (ground > 0.0) + loose == 1
        for _ in range(1 if alone else SWEEPS):
            before = contact, rolling, rubbing
            if rarely(loose):
                apart_by = w + 1.0 / k.play.rotors  # what an impulse between rotors and wheels adds to their difference
                wanted = cut(s.rotor - s.wheel + h * (rotor_speed - wheel_speed) + h * apart_by * contact, half)
                free = rotor_speed - wheel_speed + apart_by * contact
                change = (free - (wanted - s.rotor + s.wheel) / h) / apart_by - contact
                contact += change
                rotor_speed -= change / k.play.rotors
                wheel_speed += w * change
                tilt_rate += v * change
            if rarely(ground > 0.0):
                change = rub(rolling, wheel_speed, determinant / c, ground, apart)
                rolling += change
                wheel_speed += w * change
                tilt_rate += v * change
            if joint > 0.0:
                change = rub(rubbing, wheel_speed - tilt_rate, of_joint, joint, apart)
                rubbing += change
                wheel_speed += (w - v) * change
                tilt_rate += (v - q) * change
            if (contact, rolling, rubbing) == before:  # and so it stays in all further rounds
                break
    wheel = s.wheel + h * wheel_speed
    sway, sway_rate = s.sway, s.sway_rate
    if rarely(k.swing.mass > 0.0):
        gained = k.radius * (wheel_speed - s.wheel_speed)
        sway, sway_rate = swung(k, s, f, gained, tilt_rate - s.tilt_rate)
    return PlanarState(
        s.tilt + h * tilt_rate,
        wheel,
        tilt_rate,
        wheel_speed,
        s.torque,
        s.rotor + h * rotor_speed if loose else wheel,
        rotor_speed if loose else wheel_speed,
        0.0,
        s.position + h * k.radius * wheel_speed,
        s.driver_torque,
        sway,
        sway_rate,
    )
