"""How a robot stands when a rollout begins."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from twbal.core.errors import ConfigError
from twbal.core.robot_parameters import LARGEST_LEAN


class InitialState(NamedTuple):
    """How a robot moves when a rollout begins; all else of it is at rest.

    Attributes:
        tilt: [rad].
        tilt_rate: [rad/s].
        speed: of the axle over ground [m/s].
    """

    tilt: float
    tilt_rate: float
    speed: float


@dataclass(frozen=True)
class StartPose:
    """Where rollouts begin: the body leaning about `tilt_mean`, the robot about at rest.

    Attributes:
        tilt_mean: [rad].
        tilt_sd: standard deviation of the tilt [rad].
        tilt_rate_sd: of the tilt rate [rad/s].
        speed_sd: of the axle's speed over ground [m/s].

    Raises:
        ConfigError: a standard deviation is negative, or the robot would lie on the ground.
    """

    tilt_mean: float
    tilt_sd: float
    tilt_rate_sd: float
    speed_sd: float

    def __post_init__(self) -> None:
        for name in ("tilt_sd", "tilt_rate_sd", "speed_sd"):
            if not 0 <= getattr(self, name) < float("inf"):
                raise ConfigError(f"{name} of the start pose must not be negative; found {getattr(self, name)}.")
        if not abs(self.tilt_mean) <= LARGEST_LEAN:
            raise ConfigError(
                f"tilt_mean of the start pose is an angle in rad from the vertical, well under a right angle; "
                f"found {self.tilt_mean}. Was it given in degrees?"
            )

    def draw(self, rng: np.random.Generator) -> InitialState:
        """One normally distributed start."""
        noise = rng.standard_normal(3)
        return InitialState(
            tilt=float(self.tilt_mean + self.tilt_sd * noise[0]),
            tilt_rate=float(self.tilt_rate_sd * noise[1]),
            speed=float(self.speed_sd * noise[2]),
        )
