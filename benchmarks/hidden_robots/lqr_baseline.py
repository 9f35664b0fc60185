"""A controller that has nothing to do with twbal's learning: the textbook regulator of the data sheet.

A robot that it already holds needs no learning, and tells nothing about it. Methods are compared on robots that it
drops.
"""

from collections.abc import Iterator
from itertools import count

import numpy as np
import scipy.linalg

from benchmarks.hidden_robots.families import FAMILIES
from benchmarks.hidden_robots.robots import Workshop
from twbal.algorithm.rollout import rollout
from twbal.core.channels import Channels
from twbal.core.episode import Provenance
from twbal.core.evaluation import SuccessCriterion, judged
from twbal.core.gaussian import Array
from twbal.core.plant import Plant
from twbal.core.robot_parameters import RobotParameters
from twbal.planar.linearised import sampled
from twbal.policies.policy import Controller, Policy

_WIDTHS = np.array([0.25, 2.5, 1.0])  # rad, rad/s, m/s: Bryson's rule, a usual deviation of each


class Regulator(Policy):
    """u = -Kx, cut at the torque limit, with K of the data sheet's linearised model, sampled at the control period."""

    def __init__(self, robot: RobotParameters) -> None:
        A, B = sampled(robot)
        B = B[:, None]
        Q, R = np.diag(_WIDTHS**-2.0), np.array([[robot.torque_limit**-2.0]])
        P = scipy.linalg.solve_discrete_are(A, B, Q, R)
        self._gain: Array = np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A)[0]
        self._limit = robot.torque_limit

    def controller(self, rng: np.random.Generator) -> Controller:
        """The law; nothing in it is random."""
        return lambda state: float(np.clip(-self._gain @ state, -self._limit, self._limit))


def drops(plant: Plant, robot: RobotParameters, rule: SuccessCriterion, trials: int) -> bool:
    """Whether the data sheet's regulator fails every one of `trials` trials on this robot."""
    channels = Channels(("tilt", "tilt_rate", "speed"), robot.wheel_radius)
    regulator = Regulator(robot)
    for trial in range(trials):
        episode = rollout(
            plant, regulator, channels, rule.steps, rule.tilt_limit, Provenance(robot.name, "robot", trial=trial)
        )
        if judged(episode, rule).succeeded:
            return False
    return True


def dropped_by_the_data_sheet(first_seed: int) -> Iterator[int]:
    """Seeds from `first_seed` on of `hard` robots that the data sheet's regulator drops."""
    workshop = Workshop(FAMILIES["hard"])
    for seed in count(first_seed):
        if drops(workshop.robot(seed), workshop.sheet, workshop.rules.default, trials=1):
            yield seed
