"""A virtual robot as it is, and changed along an axis of `perturbations`."""

from dataclasses import astuple, dataclass
from itertools import product

from twbal.algorithm.perturbations import Axis, Perturbations
from twbal.core.plant import Plant
from twbal.core.robot_parameters import RobotParameters
from twbal.core.start_pose import StartPose
from twbal.core.streams import Stream, child_seed, generator
from twbal.virtual_robot.ground_truth import GroundTruth, Noise
from twbal.virtual_robot.mujoco_robot import MujocoRobot
from twbal.virtual_robot.perturbed import (
    Signs,
    with_delay,
    with_model_error,
    with_motor_lag,
    with_sensor_noise,
    with_torque_noise,
)
from twbal.virtual_robot.pushed_robot import PushedRobot

_REFERENCE_MASS = 10.0  # of the body, for which impulses are given [kg]


@dataclass(frozen=True)
class TestedRobot:
    """A virtual robot that can be had as it is, and changed.

    Attributes:
        sheet: its data sheet.
        truth: what it is.
        start: where rollouts begin.
        physics_step: upper bound of the one that is used [s].
        seed: which virtual robot of its kind, as `link.seed` says it.
    """

    __test__ = False  # not a test for pytest

    sheet: RobotParameters
    truth: GroundTruth
    start: StartPose
    physics_step: float
    seed: int

    def plant(self, truth: GroundTruth | None = None) -> MujocoRobot:
        """It, or with its start poses and noise another truth."""
        return MujocoRobot(
            truth=truth or self.truth,
            control_period=self.sheet.control_period,
            start=self.start,
            physics_step=self.physics_step,
            seed=child_seed(Stream.VIRTUAL_ROBOT, self.seed),
        )


def perturbed_plant(
    robot: TestedRobot, axis: Axis, level: float, trial: int, perturbations: Perturbations, seed: int
) -> Plant:
    """The robot, changed along one axis, for one trial.

    Args:
        robot: as it is.
        axis: what is changed.
        level: how far, in the axis's unit; 0 leaves it as it is.
        trial: number of the trial from 0 on, which chooses the direction of a model error.
        perturbations: for what all levels share.
        seed: of the order in which the trials take the directions of model errors.
    """
    truth = robot.truth
    match axis:
        case Axis.MODEL_ERROR:
            return robot.plant(with_model_error(truth, level, direction(trial, robot.seed, seed)))
        case Axis.SENSOR_NOISE:
            more = Noise(*(level * each for each in astuple(perturbations.noise)))
            return robot.plant(with_sensor_noise(truth, more))
        case Axis.TORQUE_NOISE:
            return robot.plant(with_torque_noise(truth, level * robot.sheet.torque_limit))
        case Axis.MOTOR_LAG:
            return robot.plant(with_motor_lag(truth, level))
        case Axis.DELAY:
            return robot.plant(with_delay(truth, level))
        case Axis.PUSHES:
            impulse = level * robot.sheet.body_mass / _REFERENCE_MASS
            return PushedRobot(robot.plant(), perturbations.push_time, perturbations.push_duration, impulse)


def direction(trial: int, robot_seed: int, seed: int) -> Signs:
    """Direction of a trial's model error: eight trials in a row take all eight, in an order of the robot's own."""
    corners = [Signs(*signs) for signs in product((1.0, -1.0), repeat=3)]
    order = generator(Stream.PERTURBATION, seed, robot_seed, trial // len(corners)).permutation(len(corners))
    return corners[int(order[trial % len(corners)])]
