"""Where the search lets the robot begin."""

from collections.abc import Sequence

import numpy as np

from twbal.core.gaussian import Gaussian
from twbal.core.start_pose import StartPose


def start_state(pose: StartPose, names: Sequence[str]) -> Gaussian:
    """p(x_0) of a robot that stands as `pose` says: independent channels, of which `pose` leaves some exactly zero.

    No command was given before a rollout, and acceleration and yaw rate are still zero when it begins.
    """
    means = {"tilt": pose.tilt_mean}
    sds = {"tilt": pose.tilt_sd, "tilt_rate": pose.tilt_rate_sd, "speed": pose.speed_sd}
    mean = np.array([means.get(name, 0.0) for name in names])
    sd = np.array([sds.get(name, 0.0) for name in names])
    return Gaussian(mean, np.diag(sd**2))
