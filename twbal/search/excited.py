"""The excitation of a robot by its data sheet."""

from collections.abc import Sequence

import numpy as np
import scipy.linalg

from twbal.core.errors import ConfigError
from twbal.core.motion_limits import MotionLimits
from twbal.core.robot_parameters import RobotParameters
from twbal.planar.linearised import sampled
from twbal.policies.excitation import Excitation

_MOST_SPEED, _SPEED_SHARE = 0.5, 0.5  # [m/s], and of the sheet's speed limit


def usual_speed(robot: RobotParameters) -> float:
    """The speed at which a robot is excited where none is given [m/s]: half of its sheet's limit, at most 0.5."""
    return min(_MOST_SPEED, _SPEED_SHARE * MotionLimits.of_robot(robot).speed)


def excited_regulator(
    robot: RobotParameters,
    channels: Sequence[str],
    widths: Sequence[float],
    command_width: float,
    multisine: float,
    prbs: float,
    speed: float | None,
    fade_tilt: float,
) -> Excitation:
    """The linear-quadratic regulator of the data sheet, sampled at its control period, with excitation on top.

    Args:
        robot: data sheet.
        channels: names of the state channels.
        widths: deviations of tilt [rad], tilt rate [rad/s] and speed [m/s] that cost alike (Bryson's rule).
        command_width: command that costs as much, as a share of the torque limit.
        multisine, prbs, fade_tilt: as of `Excitation`.
        speed: asked for at most [m/s]; None: half of the speed limit that the sheet gives, and no more than 0.5 m/s.

    Raises:
        ConfigError: the state lacks a channel, or a width is not positive.
    """
    if len(widths) != 3 or not min(*widths, command_width) > 0:
        raise ConfigError(
            f"widths must be three positive numbers, and command_width one; found {list(widths)}, {command_width}."
        )
    Ad, Bd = sampled(robot)
    Bd = Bd[:, None]
    price = np.diag(np.asarray(widths, dtype=float) ** -2.0)
    effort = np.array([[(command_width * robot.torque_limit) ** -2.0]])
    P = scipy.linalg.solve_discrete_are(Ad, Bd, price, effort)
    gain = np.linalg.solve(effort + Bd.T @ P @ Bd, Bd.T @ P @ Ad)[0]
    return Excitation(
        tuple(channels),
        (float(gain[0]), float(gain[1]), float(gain[2])),
        robot.control_period,
        robot.torque_limit,
        multisine,
        prbs,
        usual_speed(robot) if speed is None else speed,
        fade_tilt,
    )
