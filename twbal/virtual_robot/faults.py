"""What a virtual robot hides: effects drawn from its seed."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from twbal.core.errors import ConfigError
from twbal.core.robot_parameters import RobotParameters
from twbal.effects.actuation_delay import ActuationDelay
from twbal.effects.body_mass import BodyMass
from twbal.effects.com_height import ComHeight
from twbal.effects.com_offset import ComOffset
from twbal.effects.coulomb_friction import CoulombFriction
from twbal.effects.dead_zone import DeadZone
from twbal.effects.effect import Effect
from twbal.effects.motor_lag import MotorLag
from twbal.effects.sensor_noise import SensorNoise
from twbal.effects.torque_gain import TorqueGain
from twbal.effects.viscous_friction import ViscousFriction

Range = Sequence[float]
"""Lowest and highest value."""


@dataclass(frozen=True)
class FaultDistribution:
    """Ranges of the effects, each a (lowest, highest) pair.

    Torques and frictions are those of a robot whose torque limit is `reference_torque`; for another they are scaled
    by its own limit over that one, so that they are as large beside its motors. Delays and lags are in its control
    periods. Masses, heights and angles are relative already; the noise is that of the same sensors on any robot.

    Attributes:
        outer: share of each range, at either of its ends, that values are drawn from; 0.5 is the whole range. Robots
            near the middle of the ranges are much like their data sheet: there is little to learn about them.
        reference_torque: [N·m].
        torque_gain: torque over command.
        dead_zone: half width, on the summed command [N·m].
        delay_periods: of the actuation [control periods].
        lag_periods: time constant of the motors [control periods].
        viscous_friction: of each wheel [N·m·s/rad].
        coulomb_friction: of each wheel [N·m].
        body_mass: times the data sheet's.
        com_height: times the data sheet's.
        com_offset: [rad].
        noise: of the sensors, the same for every seed.

    Raises:
        ConfigError: a range is not a pair in order.
    """

    outer: float
    reference_torque: float
    torque_gain: Range
    dead_zone: Range
    delay_periods: Range
    lag_periods: Range
    viscous_friction: Range
    coulomb_friction: Range
    body_mass: Range
    com_height: Range
    com_offset: Range
    noise: SensorNoise

    def __post_init__(self) -> None:
        for name in self.ranges():
            pair = getattr(self, name)
            if len(pair) != 2 or not pair[0] <= pair[1]:
                raise ConfigError(f"The hidden range {name} must be [lowest, highest]; found {list(pair)}.")
        if not 0 < self.outer <= 0.5:
            raise ConfigError(f"outer must lie within (0, 0.5]; found {self.outer}.")
        if not self.reference_torque > 0:
            raise ConfigError(f"reference_torque must be positive; found {self.reference_torque} N·m.")

    @classmethod
    def ranges(cls) -> tuple[str, ...]:
        """Names of what is drawn, in the order in which it is drawn."""
        return tuple(f.name for f in fields(cls) if f.name not in ("outer", "reference_torque", "noise"))


def draw_faults(recipe: FaultDistribution, robot: RobotParameters, seed: int) -> list[Effect]:
    """The effects of the hidden robot `seed`, each drawn by itself.

    Args:
        recipe: the ranges.
        robot: the data sheet, for its torque limit and control period.
        seed: the same seed is the same robot.
    """
    rng = np.random.default_rng(seed)  # not a named stream: the robot of a seed stays that of published tables
    drawn = {}
    for name in recipe.ranges():
        low, high = getattr(recipe, name)
        drawn[name] = _draw(low, high, recipe.outer, rng)
    torque = robot.torque_limit / recipe.reference_torque
    period = robot.control_period
    return [
        TorqueGain(drawn["torque_gain"]),
        DeadZone(drawn["dead_zone"] * torque),
        ActuationDelay(drawn["delay_periods"] * period),
        MotorLag(drawn["lag_periods"] * period),
        ViscousFriction(drawn["viscous_friction"] * torque),
        CoulombFriction(drawn["coulomb_friction"] * torque),
        BodyMass(drawn["body_mass"]),
        ComHeight(drawn["com_height"]),
        ComOffset(drawn["com_offset"]),
        recipe.noise,
    ]


def _draw(low: float, high: float, outer: float, rng: np.random.Generator) -> float:
    """Uniform within the share `outer` of [low, high] at one of its ends, either as likely."""
    depth = outer * rng.uniform() * (high - low)
    return float(low + depth if rng.uniform() < 0.5 else high - depth)
