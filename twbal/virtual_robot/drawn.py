"""One virtual robot, drawn from ranges for the robot of a data sheet."""

from collections.abc import Mapping
from math import pi, sqrt

import numpy as np

from twbal.core.robot_parameters import GRAVITY, RobotParameters
from twbal.core.streams import Stream, generator
from twbal.virtual_robot.distribution import FaultDistribution
from twbal.virtual_robot.ground_truth import (
    Actuation,
    Body,
    Friction,
    GroundTruth,
    Noise,
    Pair,
    SensorModel,
    Surroundings,
)

_AIR_DENSITY = 1.2  # [kg/m³]
_GEAR_WINDUP = 0.0087  # 0.5 degrees, by which gears and shafts twist under the motor's greatest torque [rad]
_GEAR_DAMPING = 0.5  # of the rotor on its teeth, over critical damping
_BRISTLE_DAMPING = 0.3  # of the wheel on its bristles, over critical damping

_Values = Mapping[str, float]


def draw_ground_truth(distribution: FaultDistribution, sheet: RobotParameters, seed: int) -> GroundTruth:
    """The robot `seed`, each value drawn by itself.

    Args:
        distribution: the ranges.
        sheet: the data sheet.
        seed: the same seed is the same robot.
    """
    drawn = distribution.draw(generator(Stream.GROUND_TRUTH, seed))
    phases = generator(Stream.GROUND_TRUTH, seed, 1)  # apart: a new range leaves them as they are
    torque = sheet.torque_limit / distribution.reference_torque
    body = _body(drawn, sheet, _phases(phases))
    return GroundTruth(
        body=body,
        drive=_drive(drawn, sheet, body, torque, _phases(phases)),
        friction=_friction(drawn, body, torque),
        surroundings=_surroundings(drawn, sheet, body, float(phases.uniform(0.0, 2.0 * pi))),
        sensors=_sensors(drawn, sheet, distribution.noise),
    )


def _phases(rng: np.random.Generator) -> Pair:
    left, right = rng.uniform(0.0, 2.0 * pi, 2)
    return float(left), float(right)


def _about(mean: float, difference: float) -> Pair:
    """Two values that differ by this share of their mean."""
    return mean * (1.0 + 0.5 * difference), mean * (1.0 - 0.5 * difference)


def _body(drawn: _Values, sheet: RobotParameters, phases: Pair) -> Body:
    """One factor for all three inertias: what a body can have stays what a body can have."""
    mass, inertia = drawn["body_mass"], drawn["body_mass"] * drawn["body_inertia"]
    wheel = sheet.wheel_inertia * drawn["wheel_inertia"]
    radius = sheet.wheel_radius * drawn["wheel_radius"]
    return Body(
        mass=sheet.body_mass * mass,
        com_height=sheet.com_height * drawn["com_height"],
        com_offset=sheet.com_offset + drawn["com_offset"],
        inertia=(
            sheet.body_inertia_roll * inertia,
            sheet.body_inertia_pitch * inertia,
            sheet.body_inertia_yaw * inertia,
        ),
        wheel_mass=sheet.wheel_mass * drawn["wheel_mass"],
        wheel_inertia=wheel * (1.0 - drawn["rotor_share"]),
        rotor_inertia=wheel * drawn["rotor_share"],
        wheel_radius=_about(radius, drawn["radius_difference"]),
        wheel_width=sheet.wheel_width,
        eccentricity=radius * drawn["eccentricity"],
        eccentric_phase=phases,
        track=sheet.track,
    )


def _drive(drawn: _Values, sheet: RobotParameters, body: Body, torque: float, phases: Pair) -> Actuation:
    zone, skew = drawn["dead_zone"] * torque, drawn["dead_zone_skew"]
    stiffness = 0.5 * sheet.torque_limit / _GEAR_WINDUP
    return Actuation(
        torque_limit=sheet.torque_limit,
        delay=drawn["delay"] + drawn["delay_periods"] * sheet.control_period,
        dead_zone=(zone * (1.0 - max(-skew, 0.0)), zone * (1.0 - max(skew, 0.0))),
        gain=_about(drawn["torque_gain"], drawn["motor_difference"]),
        sag_load=drawn["sag_load"],
        sag_use=drawn["sag_use"],
        lag=drawn["motor_lag"],
        slew_time=drawn["slew_time"],
        torque_noise=drawn["torque_noise"] * torque,
        viscous=drawn["viscous_friction"] * torque,
        cogging=drawn["cogging"] * torque,
        cogging_count=round(drawn["cogging_count"]),
        cogging_phase=phases,
        play=drawn["play"] if body.rotor_inertia > 0.0 else 0.0,
        gear_stiffness=stiffness,
        gear_damping=2.0 * _GEAR_DAMPING * sqrt(stiffness * body.rotor_inertia),
    )


def _friction(drawn: _Values, body: Body, torque: float) -> Friction:
    coulomb = drawn["coulomb_friction"] * torque
    static = coulomb * drawn["static_friction"]
    stiffness = static / drawn["presliding"]
    inertia = body.wheel_inertia + body.rotor_inertia
    return Friction(
        coulomb=coulomb,
        static=static,
        stribeck_rate=drawn["stribeck_rate"],
        bristle_stiffness=stiffness,
        bristle_damping=2.0 * _BRISTLE_DAMPING * sqrt(stiffness * inertia),
    )


def _surroundings(drawn: _Values, sheet: RobotParameters, body: Body, phase: float) -> Surroundings:
    weight = (body.mass + 2.0 * body.wheel_mass) * GRAVITY
    return Surroundings(
        slope=drawn["slope"],
        wave_slope=drawn["waves"],
        wave_length=drawn["wave_length"] * sheet.wheel_radius,
        wave_phase=phase,
        # A line of contact of width w under N that turns about its middle: mu N w / 4.
        scrub=0.25 * drawn["scrub"] * weight * sheet.wheel_width,
        drag=0.5 * _AIR_DENSITY * drawn["drag"] * sheet.track * 2.0 * sheet.com_height,
    )


def _sensors(drawn: _Values, sheet: RobotParameters, noise: Noise) -> SensorModel:
    return SensorModel(
        mounting_angle=drawn["mounting_angle"],
        fusion_time=drawn["fusion_time"],
        filter_time=drawn["filter_time"],
        gyro_bias=drawn["gyro_bias"],
        gyro_walk=drawn["gyro_walk"],
        ticks=round(drawn["ticks"]),
        rate_window=drawn["rate_window"] * sheet.control_period,
        is_encoder_on_motor=drawn["encoder_on_motor"] >= 0.5,
        noise=noise,
    )
