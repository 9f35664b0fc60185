"""Changes of one virtual robot by a given amount, from what it is. They return another robot, and leave the first."""

from dataclasses import astuple, replace
from math import hypot
from typing import NamedTuple

from twbal.virtual_robot.ground_truth import GroundTruth, Noise


class Signs(NamedTuple):
    """Direction of a model error: 1.0 or -1.0 each.

    Attributes:
        mass: of the body.
        com_height: height of its centre of mass.
        torque_gain: of both motors.
    """

    mass: float
    com_height: float
    torque_gain: float


def with_model_error(truth: GroundTruth, share: float, signs: Signs) -> GroundTruth:
    """The robot with another mass, height of the centre of mass and torque gain, each times (1 ± share).

    The body's inertias are in proportion to its mass, so that it stays a body that there can be.

    Args:
        truth: the robot as it is.
        share: from 0 to below 1.
        signs: whether each grows or shrinks.
    """
    mass, height, gain = (1.0 + share * sign for sign in signs)
    body, drive = truth.body, truth.drive
    roll, pitch, yaw = (mass * inertia for inertia in body.inertia)
    heavier = replace(body, mass=mass * body.mass, com_height=height * body.com_height, inertia=(roll, pitch, yaw))
    left, right = drive.gain
    return replace(truth, body=heavier, drive=replace(drive, gain=(gain * left, gain * right)))


def with_sensor_noise(truth: GroundTruth, more: Noise) -> GroundTruth:
    """The robot with more white noise of its sensors, independent of what they have: variances add up.

    Args:
        truth: the robot as it is.
        more: standard deviations of what is added.
    """
    noise = Noise(*map(hypot, astuple(truth.sensors.noise), astuple(more)))
    return replace(truth, sensors=replace(truth.sensors, noise=noise))


def with_torque_noise(truth: GroundTruth, deviation: float) -> GroundTruth:
    """The robot with more random torque on its shafts, by its standard deviation on both together [N·m]."""
    noise = hypot(truth.drive.torque_noise, deviation)
    return replace(truth, drive=replace(truth.drive, torque_noise=noise))


def with_motor_lag(truth: GroundTruth, more: float) -> GroundTruth:
    """The robot whose motors' time constant is longer by `more` [s]."""
    return replace(truth, drive=replace(truth.drive, lag=truth.drive.lag + more))


def with_delay(truth: GroundTruth, more: float) -> GroundTruth:
    """The robot whose commands act later by `more` [s]."""
    return replace(truth, drive=replace(truth.drive, delay=truth.drive.delay + more))
