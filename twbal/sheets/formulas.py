"""What values of a sheet follow from what can be weighed, timed and measured."""

from math import pi, sqrt

from twbal.core.errors import ConfigError
from twbal.core.motor import Motor
from twbal.core.robot_parameters import GRAVITY


def swing_inertia(mass: float, distance: float, period: float) -> float:
    """Inertia of a pendulum about its centre of mass: I = m g l T² / 4π² - m l², for small swings [kg·m²].

    Args:
        mass: [kg].
        distance: l, of the centre of mass from the axis that it hangs by [m].
        period: T, of a whole swing, there and back [s].

    Raises:
        ConfigError: it swings faster than all of its mass at the centre of mass would.
    """
    shortest = 2.0 * pi * sqrt(distance / GRAVITY)
    if not period > shortest:
        half = " Was it the time of half a swing? One swing is there and back." if 2.0 * period > shortest else ""
        raise ConfigError(
            f"A body whose centre of mass hangs {distance:g} m below its axle cannot swing in {period:g} s; expected "
            f"more than {shortest:.3f} s.{half} Else measure com_height once more."
        )
    return mass * distance * (GRAVITY * period**2 / (4.0 * pi**2) - distance)


def two_string_inertia(mass: float, between: float, length: float, period: float) -> float:
    """Inertia of a body that turns to and fro on two strings: I = m g d² T² / (16 π² L), for small turns [kg·m²].

    It is about the vertical through the centre of mass, which hangs midway between the strings.

    Args:
        mass: [kg].
        between: d, distance of the two strings, which are parallel [m].
        length: L, of each [m].
        period: T, of a whole turn to and fro [s].
    """
    return mass * GRAVITY * between**2 * period**2 / (16.0 * pi**2 * length)


def box_inertia(mass: float, a: float, b: float) -> float:
    """Inertia of an even box about its middle, m (a² + b²) / 12 [kg·m²].

    Args:
        mass: [kg].
        a: side across the axis [m].
        b: the other side across the axis [m].
    """
    return mass * (a**2 + b**2) / 12.0


def wheel_inertia(mass: float, radius: float, rotor: float = 0.0, gear: float = 1.0) -> float:
    """Inertia of a disk and of a rotor that turns `gear` times as fast, m r² / 2 + N² J [kg·m²]."""
    return mass * radius**2 / 2.0 + gear**2 * rotor


def stall_torque(motor: Motor) -> float:
    """Of two such motors with gears, at the wheels and at the whole supply, 2 N k U / R [N·m]."""
    return 2.0 * motor.torque_per_volt * motor.supply
