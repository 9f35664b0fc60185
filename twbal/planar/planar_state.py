"""What the planar model remembers, and how it turns; kernels are compiled for these classes (`twbal.core.compiled`)."""

from typing import NamedTuple

from twbal.core.compiled import kernel
from twbal.core.sine_cosine import sine_and_cosine


class PlanarState(NamedTuple):
    """All that the planar model remembers.

    Attributes:
        tilt: θ [rad].
        wheel: φ, in space [rad].
        tilt_rate: [rad/s].
        wheel_speed: φ̇ [rad/s].
        torque: to which the motors have come, both together [N·m].
        rotor: ρ, in space, in turns of the wheel [rad]; φ without backlash.
        rotor_speed: [rad/s].
        slip: speed of the axle beyond r φ̇ [m/s]; 0 where the wheels roll.
        position: of the axle along its way since the rollout began [m].
        driver_torque: to which the driver has come, both motors together [N·m]; of no meaning without a slew limit.
        sway: y, by which the part of the body that swings is ahead of where a rigid frame would hold it [m].
        sway_rate: [m/s].
        x, y: place of the axle, ahead of where the rollout began and to the left of that [m].
        left_joint, right_joint, left_ground, right_ground: dry friction of the wheels in their joints and on the ground
            in the last physics step, where it grows over an angle [N·m]; 0 where it does not.
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
    driver_torque: float
    sway: float
    sway_rate: float
    x: float
    y: float
    left_joint: float
    right_joint: float
    left_ground: float
    right_ground: float


class Turning(NamedTuple):
    """How the robot turns: a known input.

    Attributes:
        rate: ψ̇ [rad/s].
        heading: ψ, since the rollout began [rad].
        cosine, sine: of the heading.
    """

    rate: float
    heading: float
    cosine: float
    sine: float


STRAIGHT = Turning(0.0, 0.0, 1.0, 0.0)


@kernel(is_inlined=True)
def turning_at(rate: float, heading: float) -> Turning:
    """How a robot turns, by its yaw rate [rad/s] and its heading [rad]."""
    sine, cosine = sine_and_cosine(heading)
    return Turning(rate, heading, cosine, sine)
