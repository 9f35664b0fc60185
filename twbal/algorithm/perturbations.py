"""What a virtual robot is changed by, axis by axis and level by level, to see which policies still balance it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

from twbal.core.errors import ConfigError
from twbal.virtual_robot.ground_truth import Noise


class Axis(StrEnum):
    """What is changed."""

    MODEL_ERROR = "model_error"
    SENSOR_NOISE = "sensor_noise"
    TORQUE_NOISE = "torque_noise"
    MOTOR_LAG = "motor_lag"
    DELAY = "delay"
    PUSHES = "pushes"


UNITS: Mapping[Axis, str] = {
    Axis.MODEL_ERROR: "± share",
    Axis.SENSOR_NOISE: "times an IMU's",
    Axis.TORQUE_NOISE: "per torque limit",
    Axis.MOTOR_LAG: "s",
    Axis.DELAY: "s",
    Axis.PUSHES: "N·s for 10 kg",
}
"""Unit of each axis's levels."""


@dataclass(frozen=True)
class Perturbations:
    """Levels of each axis, increasing, and how often each is tried on each robot.

    Attributes:
        model_error: share by which mass, height of the centre of mass and torque gain each are larger or smaller; the
            trials take all eight directions in turn.
        sensor_noise: white noise that is added to the sensors', times `noise`.
        torque_noise: standard deviation of a random torque on the wheels' shafts, drawn anew for each control period,
            as a share of the torque limit.
        motor_lag: added to the motors' time constant [s].
        delay: added to the delay of the command [s].
        pushes: impulse of a push of `push_duration` at the axle, for a body of 10 kg; in proportion to the mass of the
            data sheet's body [N·s]. Even trials are pushed forward, odd ones backward.
        noise: that of which `sensor_noise` is a multiple.
        push_time: when a push begins [s].
        push_duration: [s].
        trials: of each level on each robot.
        first_trial: number of the first; a robot draws its start and its noise from it.

    Raises:
        ConfigError: levels are not positive and increasing.
    """

    model_error: Sequence[float]
    sensor_noise: Sequence[float]
    torque_noise: Sequence[float]
    motor_lag: Sequence[float]
    delay: Sequence[float]
    pushes: Sequence[float]
    noise: Noise
    push_time: float
    push_duration: float
    trials: int
    first_trial: int

    def __post_init__(self) -> None:
        for axis, levels in self.levels.items():
            if not levels or list(levels) != sorted({*levels}) or not levels[0] > 0.0:
                raise ConfigError(f"perturbation.{axis} must be levels above 0 that increase; found {list(levels)}.")
        if self.model_error[-1] >= 1.0:
            raise ConfigError(f"perturbation.model_error must stay below 1; found {self.model_error[-1]}.")

    @property
    def levels(self) -> Mapping[Axis, Sequence[float]]:
        """Levels of each axis."""
        return {axis: getattr(self, axis) for axis in Axis}
