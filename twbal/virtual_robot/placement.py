"""How the robot is put on the ground: both wheels touch it, and roll."""

from math import cos, sin

import numpy as np

from twbal.core.gaussian import Array
from twbal.core.start_pose import InitialState
from twbal.virtual_robot.ground_truth import Body
from twbal.virtual_robot.mjcf import LEFT, RIGHT


def place(qpos: Array, qvel: Array, body: Body, slope: float, initial: InitialState) -> None:
    """Write the pose and the velocity of a robot whose axle stands over the origin and that looks along x.

    Args:
        qpos: (9,) of the free joint and both hinges, written to.
        qvel: (8,) written to.
        body: for its wheels.
        slope: of the ground [rad].
        initial: tilt from the vertical, and how it moves.
    """
    lean = initial.tilt + slope
    left, right = (axle_height(body, side, lean) for side in (LEFT, RIGHT))
    roll = np.arcsin((left - right) / body.track)
    qpos[:3] = 0.0, 0.0, 0.5 * (left + right)
    across, along = (cos(0.5 * roll), sin(0.5 * roll)), (cos(0.5 * lean), sin(0.5 * lean))
    qpos[3:7] = across[0] * along[0], across[1] * along[0], across[0] * along[1], across[1] * along[1]
    qpos[7:9] = 0.0
    qvel[:] = initial.speed, 0.0, 0.0, 0.0, initial.tilt_rate, 0.0, 0.0, 0.0
    for side in (LEFT, RIGHT):
        qvel[6 + side] = initial.speed / body.wheel_radius[side] - initial.tilt_rate


def axle_height(body: Body, side: int, lean: float) -> float:
    """Of the axle over the ground [m] where a wheel that turned by `lean` [rad] touches it."""
    return body.wheel_radius[side] - body.eccentricity * cos(body.eccentric_phase[side] + lean)
