"""Whether one motor is stronger than the other: whether the robot turns with the command."""

from collections.abc import Sequence

import numpy as np

from twbal.core.block_regression import CREEP, jackknife
from twbal.core.episode import Episode
from twbal.core.gaussian import Array
from twbal.core.heading import HeadingSample
from twbal.core.mobility import yaw_mobility
from twbal.core.plant import Observation
from twbal.core.robot_parameters import RobotParameters
from twbal.core.smoothed_derivatives import smoothed
from twbal.diagnosis.side_findings import MotorDifference
from twbal.planar.actuation import driver_torque
from twbal.planar.constants import constants
from twbal.planar.parameters import PlanarParameters
from twbal.sysid.recording import commands_of

_KERNEL, _TAPS = 0.3, 8.0  # s, and samples, of the bump through which all is seen, at least
_LEAST = 0.02  # share that is worth a word
_INERTIA = 0.15  # of the yaw inertia by the data sheet, by which it may be off (a standard deviation)
_FEWEST = 10.0  # s of driving, in all
_YAW, _TILT, _WHEEL_RATE = (Observation._fields.index(name) for name in ("yaw_rate", "tilt", "wheel_rate"))
_DIFFERENCE = HeadingSample._fields.index("difference")


def motor_difference(
    episodes: Sequence[Episode], robot: RobotParameters, planar: PlanarParameters, max_tilt: float
) -> MotorDifference | None:
    r"""The motors' difference e that the yaw rate shows; None where it shows none.

    With the track b and the yaw inertia J, ψ̈ = (b / 2 r J) (e τ + d) - λ ψ̇ + friction: e τ is the difference of the
    wheel torques that unequal motors make of the torque τ of both, and d the one that was commanded. All of it is seen
    through a smooth kernel, so that nothing is differenced, and regressed; friction may differ from wheel to wheel, by
    terms in the wheels' rate and its sign. Intervals are those of a jackknife over blocks of time. The chance of a
    finding where the motors are equal is `block_regression.ERROR_RATE`.

    Args:
        episodes: of one robot, at its control period.
        robot: its data sheet.
        planar: the model, for what its driver makes of commands, and how late.
        max_tilt: beyond which the robot has fallen [rad].
    """
    parts = [part for episode in episodes if (part := _seen(episode, robot, planar, max_tilt)) is not None]
    rows = sum(len(turning) for turning, _ in parts)
    if rows * robot.control_period < _FEWEST:
        return None
    X = np.concatenate([columns for _, columns in parts])
    fit = jackknife(X, np.concatenate([turning for turning, _ in parts]), robot.control_period, 1)
    mobility = yaw_mobility(robot)
    share, half = float(fit.coefficients[0]) / mobility, float(fit.half_widths[0]) / mobility
    if not abs(share) > max(half, _LEAST) or abs(share) >= 1.0:
        return None
    either = float(np.hypot(fit.half_widths95[0] / mobility, 2.0 * _INERTIA * share))
    return MotorDifference(share, share - either, share + either)


def _seen(
    episode: Episode, robot: RobotParameters, planar: PlanarParameters, max_tilt: float
) -> tuple[Array, Array] | None:
    """Yaw acceleration (n,), and what may make it (n, 6), torque first; None of an episode that tells nothing."""
    if any(of.channel in ("yaw_rate", "wheel_rate") for of in episode.estimated):
        return None
    period, seen = episode.control_period, episode.observations
    fallen = np.flatnonzero(np.abs(seen[:, _TILT]) > max_tilt)
    end = int(fallen[0]) if len(fallen) else len(seen)
    length = max(_KERNEL, _TAPS * period)
    if end * period < 2.0 * length:
        return None
    k = constants(planar, period)
    late = 0.5 * period + k.delay + period * k.fade / max(k.lag, 1e-9)  # a lag is as late as its time constant
    given = commands_of(episode, robot)
    torque = np.array([driver_torque(planar, u, i * period) for i, u in enumerate(given)])
    steered = np.zeros(len(torque)) if episode.headings is None else episode.headings[:-1, _DIFFERENCE]
    acting = [smoothed(np.append(u, u[-1:])[:end], period, length, 0, late) for u in (torque, steered)]
    yaw, wheel = (smoothed(seen[:end, i], period, length) for i in (_YAW, _WHEEL_RATE))
    turning = smoothed(seen[:end, _YAW], period, length, 1)
    columns = [*acting, yaw, wheel, np.tanh(wheel / CREEP), np.ones(len(turning))]
    return turning, np.column_stack(columns)
