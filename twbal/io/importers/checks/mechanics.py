"""Tilt, wheels and command against mechanics: signs whatever the robot is, sizes by its data sheet.

With tilt θ, wheels φ relative to the body, body mass M with its centre at height l above the axle, inertia I about the
axle, wheels of radius r, all that rolls as J = J_w + (m_w + M) r², and torque τ of both motors:

    (I + M l r) θ'' + M l r φ'' = M g l θ - τ      the body
    (J + M l r) θ'' + J φ'' = τ                    wheels and ground

Their sum has no torque in it. It says how wheels and tilt go together whatever drives them and however the joints rub:

    φ'' = G θ - Q θ''      G = M g l / (J + M l r),  Q = (I + J + 2 M l r) / (J + M l r)

G and Q are positive for every robot. Solved for the accelerations, the two say what a command does:
θ'' = ... - b τ and φ'' = ... + d τ with b, d positive. Friction at the joints is taken off by terms in φ' and its sign.
"""

from typing import NamedTuple

import numpy as np

from twbal.core.block_regression import CREEP, Regression, regression
from twbal.core.gaussian import Array
from twbal.core.robot_parameters import GRAVITY, RobotParameters
from twbal.core.smoothed_derivatives import lengths, smoothed
from twbal.io.importers.checks.doubt import LogPart
from twbal.io.importers.checks.rates import integral


class Expected(NamedTuple):
    """Coefficients by the data sheet.

    Attributes:
        gravity: G [1/s²].
        coupling: Q.
        turned: b [1/(kg·m²)].
        driven: d [1/(kg·m²)].
    """

    gravity: float
    coupling: float
    turned: float
    driven: float


class Mechanics(NamedTuple):
    """What regressions on the laws of motion found; half-widths are those of intervals.

    Attributes:
        length: of the kernel that smoothed [s].
        motion: φ'' on θ and θ'': G and -Q.
        body: θ'' on the command: -b, then its rate, θ, φ' and friction.
        wheels: φ'' on the same: d.
        torque: mean command through the kernel, (n,).
        tilt_acceleration: θ'', (n,).
        wheel_acceleration: φ'', (n,).
        lag: rows by which the tilt comes after the wheels, with its half-width.
    """

    length: float
    motion: Regression
    body: Regression
    wheels: Regression
    torque: Array
    tilt_acceleration: Array
    wheel_acceleration: Array
    lag: tuple[float, float]


def expected(robot: RobotParameters) -> Expected:
    """The coefficients of a robot."""
    arm = robot.body_mass * robot.com_height
    cross = arm * robot.wheel_radius
    rolling = 2 * robot.wheel_inertia + (2 * robot.wheel_mass + robot.body_mass) * robot.wheel_radius**2
    about_axle = robot.body_inertia_pitch + arm * robot.com_height
    M = np.array([[about_axle + cross, cross], [rolling + cross, rolling]])
    turned, driven = np.linalg.solve(M, [-1.0, 1.0])
    wheels = rolling + cross
    return Expected(arm * GRAVITY / wheels, (about_axle + rolling + 2 * cross) / wheels, float(-turned), float(driven))


def mechanics(part: LogPart, by_gyro: bool = True, wheels: Array | None = None) -> Mechanics | None:
    """Regress the laws of motion on a log, through the kernel that tells Q best.

    Args:
        part: of the log.
        by_gyro: takes the integral of the tilt rate, where there is one, for the tilt: a complementary filter's tilt
            has the robot's acceleration in it. What its offset adds is taken off with a cubic in time.
        wheels: in place of the log's angle of the wheels, (n,) [rad].

    Returns:
        None where the log is too short, or where nothing moves.
    """
    is_integral = by_gyro and "tilt_rate" in part.signals
    theta = integral(part.signals["tilt_rate"], part.period) if is_integral else part.signals["tilt"]
    has_angle = wheels is not None or "wheel_angle" in part.signals
    phi = wheels if wheels is not None else part.signals["wheel_angle" if has_angle else "wheel_rate"]
    if np.ptp(theta) == 0.0 or np.ptp(phi) == 0.0:
        return None
    first = 1 if has_angle else 0  # derivative of what was measured that is φ'
    found = [_through(part, theta, phi, first, is_integral, length) for length in lengths(len(theta), part.period)]
    return max(found, key=_certainty, default=None)


def _certainty(found: Mechanics) -> float:
    half = float(found.motion.half_widths[1])
    return abs(float(found.motion.coefficients[1])) / half if half else 0.0


def _through(part: LogPart, theta: Array, phi: Array, first: int, is_integral: bool, length: float) -> Mechanics:
    """Regress the laws of motion through one kernel."""
    dt = part.period
    angle, tilting, turning, third = (smoothed(theta, dt, length, order) for order in range(4))
    rate, rolling = (smoothed(phi, dt, length, first + order) for order in (0, 1))
    at = np.linspace(-1.0, 1.0, len(angle))
    trend = [at, at**2, at**3] if is_integral else []
    commands = np.append(part.commands, part.commands[-1:])
    torque, steeper = (smoothed(commands, dt, length, order, 0.5 * dt) for order in (0, 1))
    acting = [torque, steeper, angle, rate, np.tanh(rate / CREEP), *trend]
    motion = regression(rolling, [angle, turning, *trend], dt)
    gravity, coupling = motion.coefficients[:2]
    late = regression(rolling, [angle, turning, third + gravity / (coupling or 1.0) * tilting, *trend], dt)
    scale = float(late.coefficients[1]) * dt or 1.0
    lag = float(late.coefficients[2]) / scale, abs(float(late.half_widths[2]) / scale)
    body, wheel = regression(turning, acting, dt), regression(rolling, acting, dt)
    return Mechanics(length, motion, body, wheel, torque, turning, rolling, lag)
