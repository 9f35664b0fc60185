"""The robot's motion about its balance, linearised."""

from typing import NamedTuple

import numpy as np
import scipy.linalg

from twbal.core.gaussian import Array
from twbal.core.robot_parameters import RobotParameters
from twbal.planar.actuation import EVEN
from twbal.planar.constants import Constants, constants
from twbal.planar.equations import coefficients
from twbal.planar.parameters import PlanarParameters, linear_part
from twbal.planar.planar_plant import hold
from twbal.planar.planar_state import STRAIGHT, PlanarState
from twbal.planar.sensing import imu_settled, read_sensors

_DRIVER = ("torque_gain_gain", "actuation_delay_delay")
_STEPS = 5  # physics steps of a control period in a linear model


class LinearModel(NamedTuple):
    """ẋ = A x + B u in continuous time, or x' = A x + B u from one control period to the next.

    x = (tilt - balance, tilt rate, speed) in rad, rad/s, m/s; u in N·m.

    Attributes:
        A: (3, 3).
        B: (3,).
    """

    A: Array
    B: Array


def linearise(robot: RobotParameters) -> LinearModel:
    """Linearise the equations of motion of `dynamics` about standing still at the balance, tilt = -com_offset."""
    k = coefficients(robot)
    determinant = k.a * k.c - k.b**2
    r = robot.wheel_radius
    A = np.zeros((3, 3))
    A[0, 1] = 1.0
    A[1, 0] = k.a * k.d / determinant
    A[2, 0] = -r * k.b * k.d / determinant
    B = np.array([0.0, -(k.a + k.b) / determinant, r * (k.c + k.b) / determinant])
    return LinearModel(A, B)


def sampled(robot: RobotParameters) -> LinearModel:
    """The same over one control period, the command being held: x' = A x + B u."""
    A, B = linearise(robot)
    both = scipy.linalg.expm(robot.control_period * np.block([[A, B[:, None]], [np.zeros((1, 4))]]))
    return LinearModel(both[:3, :3], both[:3, 3])


class DelayedModel(NamedTuple):
    """x' = A x + Σ_k B_k u_k from one control period to the next, u_k being the command of k periods before.

    Attributes:
        A: (3, 3), of x = (tilt - balance, tilt rate, speed) as the sensors show it.
        B: (K + 1, 3), by age: that of the period's own command first.
        balance: what the sensors show of the tilt where the robot stands still without torque [rad].
        true_balance: the tilt there [rad].
    """

    A: Array
    B: Array
    balance: float
    true_balance: float


def sampled_with_delay(model: PlanarParameters, period: float, ages: int) -> DelayedModel:
    """The planar model about its balance, over one control period, without what is not linear about it.

    By differences of the model itself, with its torque gain and its delay of commands, but without a motor lag. A delay
    longer than `ages` control periods is cut to that.

    Args:
        model: with its effects.
        period: control period [s].
        ages: K, how many commands before the period's own may still act.
    """
    # What acts between command and motors is no part of `linear_part`, as the diagnosis' filter does without it.
    smooth = linear_part(model)._replace(**{field: getattr(model, field) for field in _DRIVER})
    k: Constants = constants(smooth, period / _STEPS)
    late = min(k.delay, ages * period)
    k = k._replace(delay=late)
    e = 1e-5

    def after(x: Array, commands: Array) -> Array:
        tilt, rate, speed = x.tolist()
        tilt -= k.offset
        turning = speed / smooth.wheel_radius
        state = PlanarState(tilt, 0.0, rate, turning, 0.0, 0.0, turning, *(0.0,) * (len(PlanarState._fields) - 7))
        imu = imu_settled(k, state, 2 * _STEPS)
        s = hold(smooth, k, state, commands, ages, _STEPS, STRAIGHT, imu, EVEN)
        return np.array([s.tilt + k.offset, s.tilt_rate, smooth.wheel_radius * s.wheel_speed])

    none = np.zeros(ages + 1)
    rest = after(np.zeros(3), none)
    A = np.array([(after(e * direction, none) - rest) / e for direction in np.eye(3)]).T
    B = np.array([(after(np.zeros(3), e * direction) - rest) / e for direction in np.eye(ages + 1)[::-1]])
    standing = PlanarState(-k.offset, *(0.0,) * (len(PlanarState._fields) - 1))
    shown = read_sensors(model, k, standing, imu_settled(k, standing, 2), 0, 0.0, 0.0)
    return DelayedModel(A, B, float(shown.tilt), -float(k.offset))


def torque_response(model: PlanarParameters, period: float) -> Array:
    """(2, 2), what torques [N·m] do within a control period to the rates of body and wheels about the balance [rad/s].

    The columns are a torque in the joints, between wheels and body, and one on the wheels from outside. By
    differences of the model itself; both act throughout the period, and what is not linear about it is left out.

    Args:
        model: with its effects.
        period: control period [s].
    """
    smooth = linear_part(model)
    k: Constants = constants(smooth, period / _STEPS)
    state = PlanarState(-k.offset, *(0.0,) * (len(PlanarState._fields) - 1))
    e = 1e-5

    def after(torque: float, outside: float) -> Array:
        pushed, imu = k._replace(pushed=outside / smooth.wheel_radius), imu_settled(k, state, 2 * _STEPS)
        s = hold(smooth, pushed, state, np.array([torque]), 0, _STEPS, STRAIGHT, imu, EVEN)
        return np.array([s.tilt_rate, s.wheel_speed])

    rest = after(0.0, 0.0)
    return np.column_stack([(after(e, 0.0) - rest) / e, (after(0.0, e) - rest) / e])
