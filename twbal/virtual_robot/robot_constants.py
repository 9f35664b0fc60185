"""The ground truth as physics that `twbal.core.compiled` compiles reads it, and what that remembers."""

from math import exp, inf, pi
from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array
from twbal.core.robot_parameters import GRAVITY
from twbal.virtual_robot.ground_truth import GroundTruth


class RobotConstants(NamedTuple):
    """What does not change while the robot drives; see `ground_truth`, and `drive` for how it is used.

    Attributes:
        step: physics step [s].
        period: control period [s].
        slew: most by which a torque changes in a physics step [N·m].
        lag_share, filter_share: part of the way to its input that a lag goes in a physics step; 1 is all of it.
        wave_force: greatest push of the ground's waves [N].
        fusion_rate: inverse of the complementary filter's time constant; 0: the true tilt [1/s].
        rotor: inertia of each rotor that play parts from its wheel; 0: there is no play [kg·m²].
        tick: angle of an encoder's step; 0: none [rad].
        window: physics steps over which ticks are counted.
    """

    step: float
    period: float
    delay: float
    half_zone_forward: float
    half_zone_backward: float
    gain: Array
    limit: float
    sag_load: float
    sag_use: float
    lag_share: float
    slew: float
    viscous: float
    cogging: float
    cogging_count: float
    cogging_phase: Array
    rotor: float
    half_play: float
    gear_stiffness: float
    gear_damping: float
    coulomb: float
    static: float
    stribeck_rate: float
    bristle_stiffness: float
    bristle_damping: float
    slope: float
    wave_force: float
    wave_number: float
    wave_phase: float
    scrub: float
    drag: float
    com_height: float
    fusion_rate: float
    filter_share: float
    tick: float
    window: int
    is_encoder_on_motor: bool


class Memory(NamedTuple):
    """What changes; arrays that the compiled physics writes to.

    Attributes:
        commands: ring of the last commands, by number of the control period [N·m].
        differences: ring of the last differences, the right wheel's torque minus the left one's [N·m].
        begins: ring of how late in their periods these begin; those before them go on until then [s].
        earlier_count: ring of how many commands came earlier in their periods.
        earlier_commands: (ring, steps of a period) of these [N·m].
        earlier_differences: (ring, steps of a period) of these [N·m].
        earlier_begins: (ring, steps of a period) of how late in their periods these begin [s].
        used: of the battery, in seconds at the limit of both motors (1,) [s].
        lagged: torque behind the lag (2,) [N·m].
        torque: of each motor (2,) [N·m].
        random_torque: on each shaft, in this control period (1,) [N·m].
        bristles: deflection (2,) [rad].
        rotor: angle relative to the body (2,) [rad].
        rotor_rate: (2,) [rad/s].
        counted: encoders' angles at the beginning of the window (2,) [rad].
        imu: speed of the axle [m/s], tilt behind the fusion [rad], and tilt [rad] and tilt rate [rad/s] behind the
            low-pass.
    """

    commands: Array
    differences: Array
    begins: Array
    earlier_count: Array
    earlier_commands: Array
    earlier_differences: Array
    earlier_begins: Array
    used: Array
    lagged: Array
    torque: Array
    random_torque: Array
    bristles: Array
    rotor: Array
    rotor_rate: Array
    counted: Array
    imu: Array


def constants(truth: GroundTruth, physics_step: float, control_period: float) -> RobotConstants:
    """Those of one robot.

    Args:
        truth: the robot.
        physics_step: [s].
        control_period: [s].
    """
    body, drive, friction = truth.body, truth.drive, truth.friction
    around, sensors = truth.surroundings, truth.sensors
    limit = 0.5 * drive.torque_limit
    return RobotConstants(
        step=physics_step,
        period=control_period,
        delay=drive.delay,
        half_zone_forward=0.5 * drive.dead_zone[0],
        half_zone_backward=0.5 * drive.dead_zone[1],
        gain=np.array(drive.gain),
        limit=limit,
        sag_load=drive.sag_load,
        sag_use=drive.sag_use,
        lag_share=_share(physics_step, drive.lag),
        slew=limit * physics_step / drive.slew_time if drive.slew_time else inf,
        viscous=drive.viscous,
        cogging=drive.cogging,
        cogging_count=float(drive.cogging_count),
        cogging_phase=np.array(drive.cogging_phase),
        rotor=body.rotor_inertia if drive.play else 0.0,
        half_play=0.5 * drive.play,
        gear_stiffness=drive.gear_stiffness,
        gear_damping=drive.gear_damping,
        coulomb=friction.coulomb,
        static=friction.static,
        stribeck_rate=friction.stribeck_rate,
        bristle_stiffness=friction.bristle_stiffness,
        bristle_damping=friction.bristle_damping,
        slope=around.slope,
        wave_force=(body.mass + 2.0 * body.wheel_mass) * GRAVITY * around.wave_slope,
        wave_number=2.0 * pi / around.wave_length,
        wave_phase=around.wave_phase,
        scrub=around.scrub,
        drag=around.drag,
        com_height=body.com_height,
        fusion_rate=1.0 / sensors.fusion_time if sensors.fusion_time else 0.0,
        filter_share=_share(physics_step, sensors.filter_time),
        tick=2.0 * pi / sensors.ticks if sensors.ticks else 0.0,
        window=max(round(sensors.rate_window / physics_step), 1) if sensors.rate_window else 0,
        is_encoder_on_motor=sensors.is_encoder_on_motor,
    )


def _share(step: float, time_constant: float) -> float:
    """Of the way that a first-order lag goes in a step while its input stands still."""
    return 1.0 - exp(-step / time_constant) if time_constant else 1.0


def fresh_memory(c: RobotConstants) -> Memory:
    """That of a robot at rest."""
    ring = int(c.delay / c.period) + 4
    most = (ring, round(c.period / c.step))
    return Memory(
        commands=np.zeros(ring),
        differences=np.zeros(ring),
        begins=np.zeros(ring),
        earlier_count=np.zeros(ring, dtype=np.int64),
        earlier_commands=np.zeros(most),
        earlier_differences=np.zeros(most),
        earlier_begins=np.zeros(most),
        used=np.zeros(1),
        lagged=np.zeros(2),
        torque=np.zeros(2),
        random_torque=np.zeros(1),
        bristles=np.zeros(2),
        rotor=np.zeros(2),
        rotor_rate=np.zeros(2),
        counted=np.zeros(2),
        imu=np.zeros(4),
    )
