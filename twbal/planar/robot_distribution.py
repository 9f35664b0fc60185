"""What is known of a robot before and after it was driven: a distribution over planar models."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array
from twbal.core.robot_model import UNBOUNDED
from twbal.core.robot_parameters import GRAVITY, RobotParameters
from twbal.effects.library import library
from twbal.effects.parameter import parameters_of
from twbal.planar.parameters import PlanarParameters, field_of, planar_parameters

_LEANING = 0.0087  # rad; half a degree, by which floors lean here and there
_FILTER_RATE = 0.3  # 1/s; time constants of complementary filters are some seconds
_PUBLISHED = 0.03  # standard deviation of a published mass or length, as a share of it
_SENSORS = (0.0035, 0.02, 0.001, 0.05)  # rad, rad/s: of a small IMU, and encoders of about 1000 ticks a turn
_DRIVE_AND_FILTERS = 0.005  # s; motors answer and sensors filter within some milliseconds
_CERTAIN = 3.0  # standard deviations from 0 at which a filter's rate is taken to be there
_SIMULATED = 0.1  # standard deviation of what a simulation was given, as a share of its distance from the neutral value
_DOUBTED = 0.2  # ... and besides, as a share of the sheet's standard deviation
_LEAST_CALIBRATED = 0.3  # of torque over command: gears, current sensing and a battery's charge are in it


TILT_FILTER = "tilt_filter"
"""Effect whose rate is `RobotDistribution.filter_rate`."""
SLOW_FILTERS = (0.2, 0.0, 0.1, 0.35, 0.5)
"""Rates of filters that are tried for any robot [1/s]; the first is where a search begins."""


def filter_lead(rate: float, period: float) -> float:
    """By how much the sum of the gyro in a filter of a rate [1/s] runs ahead of the tilt [s].

    Filters faster than `SLOW_FILTERS` are firmware's, which adds up rectangles a control period [s] wide.
    """
    return 0.5 * period if rate > max(SLOW_FILTERS) else 0.0


class Known(NamedTuple):
    """What is known of one number of the planar model before any data.

    Attributes:
        field: of `PlanarParameters`.
        mean: of a normal distribution.
        sd: its standard deviation.
        low: least value.
        high: greatest value.
    """

    field: str
    mean: float
    sd: float
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class RobotDistribution:
    """A normal distribution, cut to bounds, of P numbers of the planar model of a robot.

    Attributes:
        robot: its sheet.
        fields: of `PlanarParameters`, P names.
        mean: (P,).
        covariance: (P, P).
        low: (P,).
        high: (P,).
        sensor_sd: (4,) standard deviations of what tilt [rad], tilt rate [rad/s], wheel angle [rad] and wheel rate
            [rad/s] are measured with.
        torque_sd: (2,) standard deviations of slow torques that no parameter explains, in the joints and on the wheels
            from outside [N·m].
        filter_rate: mean and standard deviation of 1 / time constant of the complementary filter that the tilt comes
            from [1/s]; such a filter takes speeding up for leaning, a little. 0: the tilt is what it says.
    """

    robot: RobotParameters
    fields: tuple[str, ...]
    mean: Array
    covariance: Array
    low: Array
    high: Array
    sensor_sd: Array
    torque_sd: Array
    filter_rate: tuple[float, float]

    def __str__(self) -> str:
        """The numbers and their standard deviations, in one line."""
        sds = np.sqrt(np.diag(self.covariance))
        return ", ".join(
            f"{field} {mean:.3g} ± {sd:.1g}" for field, mean, sd in zip(self.fields, self.mean, sds, strict=True)
        )

    @property
    def tilt_filter(self) -> Mapping[str, float]:
        """Values of the effect `TILT_FILTER` where the tilt clearly comes from one; else none."""
        rate, sd = self.filter_rate
        if rate <= _CERTAIN * sd:
            return {}
        return {"rate": rate, "lead": filter_lead(rate, self.robot.control_period)}

    def possible(self, commands: Array) -> Array:
        """Commands [N·m] as the robot takes them: cut at its torque limit."""
        return np.clip(commands, -self.robot.torque_limit, self.robot.torque_limit)

    def models(self, count: int, rng: np.random.Generator, doubt: float = 1.0) -> list[PlanarParameters]:
        """The mean, and `count` - 1 draws, their distances from it times `doubt`."""
        root = np.linalg.cholesky(self.covariance + 1e-15 * np.eye(len(self.mean)))
        drawn = self.mean + doubt * rng.standard_normal((count, len(self.mean))) @ root.T
        drawn[0] = self.mean
        nominal = planar_parameters(self.robot, {})
        cut = np.clip(drawn, self.low, self.high)
        return [nominal._replace(**dict(zip(self.fields, row, strict=True))) for row in cut.tolist()]


def prior_of(robot: RobotParameters, effects: Mapping[str, Mapping[str, float]] | None = None) -> RobotDistribution:
    """What is known of a robot before it is driven: by its sheet, and by a simulation of it.

    Args:
        robot: its sheet.
        effects: of the simulation, values by effect and by parameter. Somebody measured or found them, so that they are
            nearly right. Those that no sheet tells of become further numbers; sensor noise is passed over.
    """
    known, filter_rate = {number.field: number for number in _by_sheet(robot)}, (0.0, _FILTER_RATE)
    for effect, values in (effects or {}).items():
        if effect == TILT_FILTER:
            filter_rate = (values["rate"], _SIMULATED * values["rate"] + _DOUBTED * _FILTER_RATE)
        elif effect in library():
            for number in _simulated(robot, effect, values, known):
                known[number.field] = number
    numbers = known.values()
    return RobotDistribution(
        robot,
        tuple(known),
        np.array([number.mean for number in numbers]),
        np.diag([number.sd**2 for number in numbers]),
        np.array([number.low for number in numbers]),
        np.array([number.high for number in numbers]),
        np.array(_SENSORS),
        np.full(2, _LEANING * (robot.body_mass + 2.0 * robot.wheel_mass) * GRAVITY * robot.wheel_radius),
        filter_rate,
    )


def _by_sheet(robot: RobotParameters) -> tuple[Known, ...]:
    """What a sheet tells.

    Masses and lengths are uncertain as their provenance says. What no sheet tells (friction, dead zone, delay) has the
    size that geared motors and sampled loops have: a dead zone of some per cent of the largest torque, dry friction of
    some per cent in either wheel, and a delay of about half a control period, as a command waits for the next one, and
    of the drive and the filters. Nor does a sheet tell how much of a wheel's inertia is that of a geared rotor, which
    turns relative to the body.
    """
    limit, period = robot.torque_limit, robot.control_period

    def factor(value: str) -> float:
        return _PUBLISHED * robot.tolerance_factors.get(value, 1.0)

    late = 0.5 * period + _DRIVE_AND_FILTERS
    inertia = np.hypot(factor("body_inertia_pitch"), 0.1)  # mostly computed from simple shapes
    return (
        Known("torque_gain_gain", 1.0, float(np.hypot(_LEAST_CALIBRATED, factor("torque_limit"))), 0.2, 3.0),
        Known("dead_zone_width", 0.05 * limit, 0.07 * limit, 0.0, 0.3 * limit),
        Known("actuation_delay_delay", late, late, 0.0, 4.0 * late),
        Known("viscous_friction_coefficient", 0.001 * limit, 0.003 * limit, 0.0, 0.03 * limit),
        Known("coulomb_friction_torque", 0.01 * limit, 0.02 * limit, 0.0, 0.1 * limit),
        Known("rotor_inertia_share", 0.4, 0.25, 0.0, 0.9),
        Known("com_offset_angle", 0.0, 0.04, -0.2, 0.2),
        Known("body_mass_factor", 1.0, float(np.hypot(factor("body_mass"), 0.1)), 0.4, 2.5),
        Known("com_height_factor", 1.0, float(np.hypot(factor("com_height"), 0.1)), 0.4, 2.5),
        Known("body_inertia_factor", 1.0, float(inertia), 0.3, 3.0),
    )


def _simulated(
    robot: RobotParameters, effect: str, values: Mapping[str, float], sheet: Mapping[str, Known]
) -> Iterator[Known]:
    """What a simulation with an effect tells; nothing of a parameter that does nothing and is in no sheet."""
    for name, parameter in parameters_of(library()[effect]).items():
        field, value, size = field_of(effect, name), float(values.get(name, parameter.value)), parameter.size(robot)
        neutral = parameter.neutral
        away = value if neutral == UNBOUNDED != value else value - neutral  # a limit that is none is infinitely far
        before = sheet.get(field)
        if before:
            sd = min(before.sd, float(np.hypot(_SIMULATED * away, _DOUBTED * before.sd)))
            yield before._replace(mean=value, sd=sd, low=min(before.low, value), high=max(before.high, value))
        elif away:
            low, high = min(parameter.low * size, value), max(parameter.high * size, value)
            yield Known(field, value, _SIMULATED * abs(away), low, high)
