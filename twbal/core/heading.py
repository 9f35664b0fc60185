"""Which way the robot looks, from its gyro and its wheels."""

import math
from typing import NamedTuple

from twbal.core.plant import WheelDifference
from twbal.core.robot_parameters import RobotParameters

BIAS_TIME = 5.0
"""Over which the gyro's bias is averaged while the robot stands [s]."""
WHEEL_TIME = 0.5
"""In which the heading comes to what the wheels tell while the robot stands [s]: long beside the noise of their ticks,
short beside the drift of an integrated gyro."""
SLIP = 0.1
"""Largest disagreement of gyro and wheels that is taken for drift [rad]; beyond, somebody turned the robot."""
_MOST_OFF = 0.1  # rad/s, of a sample from the bias: what is more is cut (Huber, Robust estimation of a location, 1964)
_PRIOR_SAMPLES = 4.0  # of a bias of 0: (noise of a sample / spread of biases)², both of some hundredths of a rad/s


class HeadingSample(NamedTuple):
    """What the heading's control knew and did at an observation.

    Attributes:
        reference: heading that was asked for [rad].
        reference_rate: [rad/s].
        estimate: heading by the robot's sensors [rad].
        rate: of that [rad/s].
        difference: of the wheel torques that was commanded until the next observation [N·m].
    """

    reference: float
    reference_rate: float
    estimate: float
    rate: float
    difference: float


class HeadingEstimate:
    """Heading from that at the start, by integration.

    With a gyro it is the gyro's yaw rate less its bias that is integrated: wheels tell the heading only as well as
    their radii agree, and a difference of one per cent bends a way of a metre by 0.01 m / track. The wheels are right
    while the robot stands. So what gyro and wheels disagree by then is the gyro's bias, and from then on the heading
    follows the wheels, by a complementary filter. Where they come apart by more than `SLIP`, tyres have slipped or the
    robot was lifted; the gyro is right then, and the wheels are followed from there on. Without a gyro it is the
    wheels' difference, r (φ_right - φ_left) / track, that tells the heading. Without wheels that are told apart the
    gyro has to do as it is.

    Args:
        robot: its sheet.
        has_gyro: whether the yaw rate is measured.

    Attributes:
        heading: positive to the left [rad].
        rate: of that [rad/s].
        bias: of the gyro [rad/s].
    """

    def __init__(self, robot: RobotParameters, has_gyro: bool) -> None:
        self.heading = self.rate = self.bias = 0.0
        self._heading_per_wheel = robot.wheel_radius / robot.track
        self._has_gyro = has_gyro
        self._before: tuple[float, float] | None = None  # time [s] and heading by the wheels [rad]
        self._gyro = 0.0  # yaw rate by it at the observation before [rad/s]
        self._still = 0
        self._wheels_zero: float | None = None  # heading where the wheels tell 0, since the robot stands [rad]

    def follow(self, time: float, yaw_rate: float, apart: WheelDifference | None, stands: bool) -> None:
        """Take the next observation.

        Args:
            time: of it, later than the one before [s].
            yaw_rate: by the gyro; not looked at where there is none [rad/s].
            apart: how far the wheels are apart; None where they are not told apart.
            stands: whether the robot is to stand, so that its wheels tell its yaw rate.
        """
        by_wheels = self._heading_per_wheel * apart.angle if apart else 0.0
        before, self._before = self._before, (time, by_wheels)
        if not self._has_gyro:
            moved, since = (by_wheels - before[1], time - before[0]) if before else (0.0, math.inf)
            is_told = apart is not None and math.isfinite(apart.rate)
            self.rate = self._heading_per_wheel * apart.rate if apart and is_told else moved / since
            self.heading += moved
            return
        if before is not None:
            step = time - before[0]
            if stands and apart is not None:
                self._learn_bias(yaw_rate - (by_wheels - before[1]) / step, step)
            self.heading += step * (0.5 * (yaw_rate + self._gyro) - self.bias)
            self._follow_wheels(by_wheels if stands and apart is not None else None, step)
        self._gyro, self.rate = yaw_rate, yaw_rate - self.bias

    def _follow_wheels(self, by_wheels: float | None, step: float) -> None:
        """Come nearer to the heading by the wheels [rad] in a step [s]; None: the robot does not stand."""
        if by_wheels is None:
            self._wheels_zero = None
            return
        if self._wheels_zero is None or abs(self._wheels_zero + by_wheels - self.heading) > SLIP:
            self._wheels_zero = self.heading - by_wheels
        self.heading += min(step / WHEEL_TIME, 1.0) * (self._wheels_zero + by_wheels - self.heading)

    def _learn_bias(self, disagreement: float, step: float) -> None:
        self._still += 1
        share = max(step / BIAS_TIME, 1.0 / (self._still + _PRIOR_SAMPLES))
        self.bias += share * min(max(disagreement - self.bias, -_MOST_OFF), _MOST_OFF)
