"""What values of a sheet follow from, against bodies of point masses that are swung and turned numerically."""

from math import cos, pi, sin, sqrt

import numpy as np
import pytest

from twbal.core.errors import ConfigError
from twbal.core.motor import Motor
from twbal.sheets.formulas import box_inertia, stall_torque, swing_inertia, two_string_inertia, wheel_inertia

G = 9.81
MASSES = np.array([0.3, 0.5, 0.2])
PLACES = np.array([[0.02, -0.03], [-0.01, -0.09], [0.00, -0.16]])  # across, and up from the axle [m]


def quadrature(speed_squared, widest):
    """Period of a symmetric oscillation to `widest`, of θ'²(θ): 4 ∫ dθ / θ', with θ = widest sin φ."""
    phi = (np.arange(4000) + 0.5) / 4000 * pi / 2
    theta = widest * np.sin(phi)
    return float(4.0 * np.mean(widest * np.cos(phi) / np.sqrt(speed_squared(theta))) * pi / 2)


def test_a_swung_body_of_point_masses_has_the_inertia_that_its_period_tells():
    mass, centre = MASSES.sum(), MASSES @ PLACES / MASSES.sum()
    about_axle = float(MASSES @ (PLACES**2).sum(axis=1))
    rest = np.arctan2(-centre[0], -centre[1])  # turned so that the centre hangs below the axle

    across, up = (float(sum_) for sum_ in MASSES @ PLACES)

    def height(angle):
        return across * sin(angle) + up * cos(angle)

    def acceleration(angle):  # by the work of gravity
        return -G * (across * cos(angle) - up * sin(angle)) / about_axle

    angle = min((rest, -rest), key=height)
    lowest, rate, step, time, begin = angle, 0.0, 1e-4, 0.0, None
    angle += 0.02
    while time < 3.0:  # leapfrog, from one turning point to the next but one
        before = rate
        half = rate + acceleration(angle) * step / 2
        angle += half * step
        rate = half + acceleration(angle) * step / 2
        time += step
        if before > 0.0 >= rate:
            if begin is not None:
                break
            begin = time
    assert abs(angle - lowest) < 0.05
    about_centre = float(MASSES @ ((PLACES - centre) ** 2).sum(axis=1))
    found = swing_inertia(float(mass), float(np.hypot(*centre)), time - begin)
    assert found == pytest.approx(about_centre, rel=0.01)


def test_a_body_on_two_strings_turns_with_the_period_of_its_exact_energy():
    mass, inertia, between, length = 1.09, 4.4e-3, 0.2, 0.8

    def rise(theta):  # of the body, as both ends of a string are `between` sin(θ/2) apart
        return length - np.sqrt(length**2 - (between * np.sin(theta / 2)) ** 2)

    widest = 0.05

    def speed_squared(theta):
        slope = (rise(theta + 1e-6) - rise(theta - 1e-6)) / 2e-6
        return 2.0 * mass * G * (rise(widest) - rise(theta)) / (inertia + mass * slope**2)

    period = quadrature(speed_squared, widest)
    assert two_string_inertia(mass, between, length, period) == pytest.approx(inertia, rel=2e-3)


def test_a_box_and_a_disk_are_the_sum_of_their_parts():
    grid = (np.arange(200) + 0.5) / 200 - 0.5
    a, b = np.meshgrid(0.06 * grid, 0.09 * grid)
    assert box_inertia(0.371, 0.06, 0.09) == pytest.approx(0.371 * np.mean(a**2 + b**2), rel=1e-4)
    radii = 0.034 * np.sqrt((np.arange(2000) + 0.5) / 2000)  # rings of equal area
    assert wheel_inertia(0.035, 0.034) == pytest.approx(0.035 * np.mean(radii**2), rel=1e-6)


def test_the_published_motors_of_balboa_and_regbot_come_to_their_sheets():
    balboa = Motor(resistance=2.70, torque_constant=3.38e-3, gear=110.1, supply=7.2)
    assert stall_torque(balboa) == pytest.approx(1.99, rel=0.005)
    assert wheel_inertia(0.0, 0.04, 1.6e-8, 110.1) + 2.3e-5 == pytest.approx(2.17e-4, rel=0.005)


def test_a_swing_that_is_faster_than_a_point_mass_is_refused_and_half_a_swing_is_named():
    shortest = 2.0 * pi * sqrt(0.0759 / G)
    assert swing_inertia(1.0, 0.0759, shortest * 1.0001) > 0.0
    with pytest.raises(ConfigError, match="half a swing"):
        swing_inertia(1.0, 0.0759, 0.31)
    with pytest.raises(ConfigError, match=f"expected more than {shortest:.3f} s. Else"):
        swing_inertia(1.0, 0.0759, 0.031)


def test_strings_and_swing_agree_on_a_body_that_is_the_same_about_both_axes():
    inertia, mass, height = 2e-3, 1.0, 0.1
    swing = 2 * pi * sqrt((inertia + mass * height**2) / (mass * G * height))
    turn = 4 * pi * sqrt(inertia * 0.7 / (mass * G * 0.15**2))
    assert swing_inertia(mass, height, swing) == pytest.approx(inertia)
    assert two_string_inertia(mass, 0.15, 0.7, turn) == pytest.approx(inertia)
