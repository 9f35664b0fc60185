"""Ranges that virtual robots are drawn from. They are set from robots and parts, not from what learns to drive them."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from twbal.core.errors import ConfigError
from twbal.virtual_robot.ground_truth import Noise

Range = Sequence[float]
"""Lowest and highest value."""

_NO_RANGES = ("outer", "reference_torque", "noise")


@dataclass(frozen=True)
class FaultDistribution:
    """Ranges of what a robot hides, each a (lowest, highest) pair.

    Torques and frictions are those of a robot whose torque limit is `reference_torque`; for another they are scaled
    by its own limit over that one, so that they are as large beside its motors. Masses, heights, inertias and radii
    are times the data sheet's. The noise is that of the same sensors on any robot. `docs/virtual_robot.md` has the
    equation of each term.

    Attributes:
        outer: share of each range, at either of its ends, that values are drawn from; 0.5 is the whole range. Robots
            near the middle of the ranges are much like their data sheet: there is little to learn about them.
        reference_torque: [N·m].
        torque_gain: torque over command.
        motor_difference: of the left motor's gain and the right one's, over their mean.
        dead_zone: half width, on the summed command, of its wider side [N·m].
        dead_zone_skew: by which share the backward (positive) or the forward side (negative) is narrower.
        delay: of the actuation [s].
        delay_periods: more of it [control periods].
        motor_lag: time constant [s].
        slew_time: from zero torque to the limit [s].
        sag_load: share of the supply lost under full load.
        sag_use: share of the supply lost in a second of full load [1/s].
        viscous_friction: of each wheel [N·m·s/rad].
        coulomb_friction: of each wheel, sliding [N·m].
        static_friction: over Coulomb's.
        stribeck_rate: [rad/s].
        presliding: angle by which bristles bend before they slide [rad].
        cogging: of each motor [N·m].
        cogging_count: periods in a turn of the wheel; rounded.
        rotor_share: of the data sheet's wheel inertia that turns relative to the body.
        play: of each gear [rad].
        encoder_on_motor: from 0.5 on encoders sit on the motors, else on the wheels.
        body_mass: factor.
        com_height: factor.
        com_offset: added to the data sheet's [rad].
        body_inertia: factor of all three, besides that of the mass.
        wheel_mass: factor.
        wheel_inertia: factor.
        wheel_radius: factor of both.
        radius_difference: of the left wheel and the right one, over their mean.
        eccentricity: over the radius.
        drag: air drag coefficient of a plate, 2 com_height high and one track wide.
        slope: of the ground [rad].
        waves: amplitude of its slope [rad].
        wave_length: over the wheel's radius.
        scrub: friction coefficient of tyres that turn on the spot.
        mounting_angle: of the tilt sensor [rad].
        fusion_time: of the complementary filter [s].
        filter_time: of the low-pass behind it [s].
        gyro_bias: [rad/s].
        gyro_walk: [rad/s/√s].
        ticks: of an encoder in a turn; rounded.
        rate_window: over which they are counted [control periods].
        torque_noise: standard deviation of the random torque on both shafts together [N·m].
        noise: of the sensors, the same for every seed.

    Raises:
        ConfigError: a range is not a pair in order.
    """

    outer: float
    reference_torque: float
    torque_gain: Range
    motor_difference: Range
    dead_zone: Range
    dead_zone_skew: Range
    delay: Range
    delay_periods: Range
    motor_lag: Range
    slew_time: Range
    sag_load: Range
    sag_use: Range
    viscous_friction: Range
    coulomb_friction: Range
    static_friction: Range
    stribeck_rate: Range
    presliding: Range
    cogging: Range
    cogging_count: Range
    rotor_share: Range
    play: Range
    encoder_on_motor: Range
    body_mass: Range
    com_height: Range
    com_offset: Range
    body_inertia: Range
    wheel_mass: Range
    wheel_inertia: Range
    wheel_radius: Range
    radius_difference: Range
    eccentricity: Range
    drag: Range
    slope: Range
    waves: Range
    wave_length: Range
    scrub: Range
    mounting_angle: Range
    fusion_time: Range
    filter_time: Range
    gyro_bias: Range
    gyro_walk: Range
    ticks: Range
    rate_window: Range
    torque_noise: Range  # last, so that what is drawn before it is what it was without
    noise: Noise

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
        return tuple(f.name for f in fields(cls) if f.name not in _NO_RANGES)

    def draw(self, rng: np.random.Generator) -> dict[str, float]:
        """A value from each range: within its share `outer` at one of its ends, either as likely."""
        return {name: _draw(getattr(self, name), self.outer, rng) for name in self.ranges()}


def _draw(pair: Range, outer: float, rng: np.random.Generator) -> float:
    low, high = pair
    depth = outer * rng.uniform() * (high - low)
    return float(low + depth if rng.uniform() < 0.5 else high - depth)
