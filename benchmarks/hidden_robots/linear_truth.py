"""The true robot without its dry friction, dead zone and play, as a linear model that is sampled with its delay.

Written from docs/virtual_robot.md alone: it shares nothing with the models that learning uses.
"""

from math import asin, sin
from typing import NamedTuple

import numpy as np
import scipy.linalg

from twbal.core.gaussian import Array
from twbal.core.robot_parameters import GRAVITY
from twbal.virtual_robot.ground_truth import GroundTruth

TILT, RATE, POSITION, SPEED = range(4)
"""Order of the state."""


class LinearTruth(NamedTuple):
    """dx/dt = A x + B τ of x = (tilt beyond the balance point, its rate, position, speed), τ summed over both wheels.

    Attributes:
        A: (4, 4).
        B: (4,).
        radius: mean of both wheels [m].
        balance: true tilt at which the robot stands [rad].
        shown: measured tilt at which it stands [rad].
        holding: torque of both wheels that keeps it from rolling down the slope [N·m].
        delay: from a command until what it does is seen [s].
    """

    A: Array
    B: Array
    radius: float
    balance: float
    shown: float
    holding: float
    delay: float


class Sampled(NamedTuple):
    """x[k+1] = A x[k] + early τ[k-whole] + late τ[k-whole-1].

    Attributes:
        A: (4, 4).
        early: (4,).
        late: (4,).
        whole: control periods in the delay.
    """

    A: Array
    early: Array
    late: Array
    whole: int


def linear_truth(truth: GroundTruth) -> LinearTruth:
    """The model about the balance point of a robot.

    With q = x/r - θ, both equations of docs/virtual_robot.md, linearised, are M (ẍ, θ̈) = (τ/r - 2b q̇/r, m g l θ - τ +
    2b q̇). Lags count as delays by their time constants, a slew limit by half its time.
    """
    body, drive, sensors = truth.body, truth.drive, truth.sensors
    m, l, J, b = body.mass, body.com_height, body.rotor_inertia, drive.viscous
    r = 0.5 * sum(body.wheel_radius)
    whole = m + 2.0 * body.wheel_mass
    across = m * l - 2.0 * J / r
    M = np.array(
        [
            [whole + 2.0 * (body.wheel_inertia + J) / r**2, across],
            [across, body.inertia[1] + m * l**2 + 2.0 * J],
        ]
    )
    # Columns: tilt, tilt rate, speed, torque.
    forces = np.array(
        [
            [0.0, 2.0 * b / r, -2.0 * b / r**2, 1.0 / r],
            [m * GRAVITY * l, -2.0 * b, 2.0 * b / r, -1.0],
        ]
    )
    (x_tilt, x_rate, x_speed, x_torque), (t_tilt, t_rate, t_speed, t_torque) = np.linalg.solve(M, forces)
    A = np.array([[0, 1, 0, 0], [t_tilt, t_rate, 0, t_speed], [0, 0, 0, 1], [x_tilt, x_rate, 0, x_speed]], dtype=float)
    holding = whole * GRAVITY * sin(truth.surroundings.slope) * r
    balance = asin(holding / (m * GRAVITY * l)) - body.com_offset
    return LinearTruth(
        A=A,
        B=np.array([0.0, t_torque, 0.0, x_torque]),
        radius=r,
        balance=balance,
        shown=balance + sensors.mounting_angle + sensors.gyro_bias * sensors.fusion_time,
        holding=holding,
        delay=drive.delay + drive.lag + 0.5 * drive.slew_time + sensors.filter_time,
    )


def sample(model: LinearTruth, period: float) -> Sampled:
    """Its exact sampling, with torques that are held for one control period [s] and act after the delay."""
    whole = int(model.delay / period + 1e-9)
    rest = model.delay - whole * period
    step, first = _held(model, period - rest)
    after, second = _held(model, rest)
    return Sampled(step @ after, first, step @ second, whole)


def _held(model: LinearTruth, time: float) -> tuple[Array, Array]:
    """Transition over `time` [s], and what a torque that is held for it adds."""
    block = np.zeros((5, 5))
    block[:4, :4], block[:4, 4] = model.A, model.B
    moved = scipy.linalg.expm(block * time)
    return moved[:4, :4], moved[:4, 4]
