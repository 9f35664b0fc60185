"""All numbers of the twin: the data sheet's, and those of every effect, each with a value at which it does nothing."""

from collections.abc import Mapping
from typing import NamedTuple

from twbal.core.errors import ConfigError
from twbal.core.robot_model import ROTOR_SHARE as ROTOR_SHARE
from twbal.core.robot_parameters import RobotParameters

UNBOUNDED = 1e9
"""Stands for no limit, where a parameter is one [N·m], and for tyres that cannot slip."""


class TwinParameters(NamedTuple):
    """The data sheet, and `<effect>_<parameter>` of every effect; angles in rad, all in SI units.

    The first fields are those of `RobotParameters`; `body_inertia_turn` is its roll inertia less its yaw inertia. The
    effects and their parameters are those of `effects/`.
    """

    body_mass: float
    com_height: float
    com_offset: float
    body_inertia: float
    body_inertia_turn: float
    wheel_mass: float
    wheel_radius: float
    wheel_inertia: float
    track: float
    torque_limit: float
    dead_zone_width: float = 0.0
    torque_gain_gain: float = 1.0
    torque_saturation_limit: float = UNBOUNDED
    actuation_delay_delay: float = 0.0
    motor_lag_time_constant: float = 0.0
    battery_sag_rate: float = 0.0
    coulomb_friction_torque: float = 0.0
    viscous_friction_coefficient: float = 0.0
    stribeck_friction_torque: float = 0.0
    stribeck_friction_breakaway: float = 0.0
    stribeck_friction_rate: float = 1.0
    backlash_gap: float = 0.0
    rotor_inertia_share: float = 0.0
    cogging_torque: float = 0.0
    cogging_count: float = 0.0
    cogging_phase: float = 0.0
    body_mass_factor: float = 1.0
    body_inertia_factor: float = 1.0
    com_height_factor: float = 1.0
    com_offset_angle: float = 0.0
    wheel_radius_factor: float = 1.0
    ground_slope_angle: float = 0.0
    rolling_resistance_torque: float = 0.0
    rolling_viscous_coefficient: float = 0.0
    wheel_slip_friction: float = UNBOUNDED
    gyro_bias_rate: float = 0.0
    gyro_scale_factor: float = 1.0
    imu_mount_angle_angle: float = 0.0
    imu_delay_delay: float = 0.0
    cable_spring_stiffness: float = 0.0
    ground_waves_slope: float = 0.0
    ground_waves_waves: float = 0.0
    ground_waves_phase: float = 0.0
    periodic_disturbance_force: float = 0.0
    periodic_disturbance_frequency: float = 0.0
    periodic_disturbance_phase: float = 0.0


def twin_parameters(robot: RobotParameters, effects: Mapping[str, Mapping[str, float]]) -> TwinParameters:
    """The twin of a robot with effects.

    Args:
        robot: data sheet.
        effects: values by effect and by parameter, as the effects of the simulation take them. `sensor_noise` is no
            part of the motion and is passed over.

    Raises:
        ConfigError: the twin has no such effect or parameter.
    """
    sheet = TwinParameters(
        body_mass=robot.body_mass,
        com_height=robot.com_height,
        com_offset=robot.com_offset,
        body_inertia=robot.body_inertia_pitch,
        body_inertia_turn=robot.body_inertia_roll - robot.body_inertia_yaw,
        wheel_mass=robot.wheel_mass,
        wheel_radius=robot.wheel_radius,
        wheel_inertia=robot.wheel_inertia,
        track=robot.track,
        torque_limit=robot.torque_limit,
    )
    return changed(sheet, effects)


def changed(twin: TwinParameters, effects: Mapping[str, Mapping[str, float]]) -> TwinParameters:
    """The twin with other values of some effects' parameters.

    Raises:
        ConfigError: the twin has no such effect or parameter.
    """
    values: dict[str, float] = {}
    for effect, parameters in effects.items():
        if effect == "sensor_noise":
            continue
        for name, value in parameters.items():
            field = f"{effect}_{name}"
            if field not in TwinParameters._field_defaults:
                known = ", ".join(TwinParameters._field_defaults)
                raise ConfigError(
                    f"The planar twin has no parameter {name!r} of an effect {effect!r}; it has: {known}."
                )
            values[field] = float(value)
    return twin._replace(**values)
