"""Levels of the noise of a predictor, and of a model discrepancy.

What a model lacks is no white noise: it lasts. A *model discrepancy* may stand for it. It has six components: a torque
at the joints, one from outside on the wheels, an error of the tilt, and a bias of the gyro, each a first-order
Gauss-Markov process with a time constant of its own (`DISCREPANCY_TIMES`, `BIAS_TIME`); noise of the gyro that a filter
has added up in the tilt; and what the steps of an encoder make of a wheel that turns slowly, which lasts until the next
step. Their levels are fitted with those of the noise. It joins the state, x' = F x + D d + w with d' = exp(-T/τ) d, so
that the filter follows what is missing, and prediction errors stay white where a model is imperfect. (M. C. Kennedy,
A. O'Hagan: Bayesian calibration of computer models, Journal of the Royal Statistical Society B 63 (3), 2001, 425-464;
here over time.) Levels of 0 leave it out.
"""

from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array

DISCREPANCY_TIMES = np.array([0.2, 0.2, 1.0])
"""Time constants of the model discrepancy: torque at the joints, torque from outside, tilt [s].

Friction of another form changes with the motion, within tenths of a second; a filter of the tilt is slower. Where the
model has that filter, its error decays as the filter does.
"""
SLOWEST_FILTER = 0.1
"""Rate of a filter of the tilt below which its error decays as that of a tilt without a filter [1/s].

Else the time for which the error lasts would jump at a rate of 0, where many fits end, from no end to a second.
"""
BIAS_TIME = 10.0
"""Time constant of the gyro's bias [s]: what is constant for longer is an effect, `gyro_bias`."""
LASTING = 6
"""Components of the model discrepancy: see `NoiseModel`."""
UNSENSED = 100.0
"""Standard deviation of a channel that was not measured [rad, rad/s]: so large that it corrects nothing."""


class NoiseModel(NamedTuple):
    """Levels of noise.

    Attributes:
        sensors: (4,) standard deviations, in the order of `MEASURED`.
        torques: (2,) standard deviations of the mean torque of a control period: at the joints, and from outside on
            the wheels [N·m].
        discrepancy: (6,) standard deviations of the model discrepancy: torque at the joints, torque from outside
            [N·m], tilt [rad], noise of the gyro that the tilt has added up [rad/s], wheel angle [rad], bias of the
            gyro [rad/s]; all 0 where there is none.
    """

    sensors: Array
    torques: Array
    discrepancy: Array = np.zeros(LASTING)

    @property
    def has_discrepancy(self) -> bool:
        """Whether the filter's state holds a model discrepancy."""
        return bool((self.discrepancy > 0.0).any())


def discrepancy_penalty(noise: NoiseModel, largest: NoiseModel) -> float:
    """-2 log prior of the levels of a model discrepancy, but for a constant: half-normal, `largest` at three sigmas."""
    if not noise.has_discrepancy:
        return 0.0
    return float((discrepancy_sigmas(noise, largest) ** 2).sum())


def discrepancy_sigmas(noise: NoiseModel, largest: NoiseModel) -> Array:
    """(6,) levels of a model discrepancy, in standard deviations of their prior: `largest` is three of them."""
    return 3.0 * noise.discrepancy / largest.discrepancy
