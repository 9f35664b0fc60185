"""How a robot is in the middle of a rollout."""

from typing import NamedTuple


class RestartState(NamedTuple):
    """What a robot in the middle of a rollout has beyond tilt, tilt rate and speed.

    Attributes:
        wheel_angle: relative to the body, mean of both wheels [rad].
        heading: by which it has turned since the rollout began, to the left [rad].
        slip: speed of the axle beyond that of wheels which roll [m/s].
        yaw_rate: [rad/s].
        position: of the axle along its way since the rollout began [m].
        x, y: place of the axle, ahead of where the rollout began and to the left of that [m].
        rotor_ahead: of the wheels, within a backlash [rad].
        rotor_faster: than the wheels [rad/s].
        sway: of the part of the body that swings, ahead of where a rigid frame would hold it [m].
        sway_rate: [m/s].
        joints, ground: dry friction in the left joint and the right one, and of the left wheel on the ground and the
            right one, where it grows over an angle [N·m].
    """

    wheel_angle: float
    heading: float = 0.0
    slip: float = 0.0
    yaw_rate: float = 0.0
    position: float = 0.0
    x: float = 0.0
    y: float = 0.0
    rotor_ahead: float = 0.0
    rotor_faster: float = 0.0
    sway: float = 0.0
    sway_rate: float = 0.0
    joints: tuple[float, float] = (0.0, 0.0)
    ground: tuple[float, float] = (0.0, 0.0)
