"""The effects of twbal's that come nearest to what a virtual robot hides, which has forms of its own."""

from twbal.core.robot_parameters import RobotParameters
from twbal.effects.actuation_delay import ActuationDelay
from twbal.effects.body_inertia import BodyInertia
from twbal.effects.body_mass import BodyMass
from twbal.effects.com_height import ComHeight
from twbal.effects.com_offset import ComOffset
from twbal.effects.coulomb_friction import CoulombFriction
from twbal.effects.dead_zone import DeadZone
from twbal.effects.effect import Effect
from twbal.effects.ground_slope import GroundSlope
from twbal.effects.imu_mount_angle import ImuMountAngle
from twbal.effects.motor_lag import MotorLag
from twbal.effects.torque_gain import TorqueGain
from twbal.effects.viscous_friction import ViscousFriction
from twbal.virtual_robot.ground_truth import GroundTruth


def nearest_effects(truth: GroundTruth, sheet: RobotParameters) -> list[Effect]:
    """By which the simulation comes near this robot; both sides of it are taken for their mean.

    Left out is what these effects have no form for, and what is small: play, cogging, sag, the sensors' filters.

    Args:
        truth: the robot.
        sheet: what it differs from.
    """
    body, drive = truth.body, truth.drive
    mass = body.mass / sheet.body_mass
    return [
        TorqueGain(0.5 * sum(drive.gain)),
        DeadZone(0.5 * sum(drive.dead_zone)),
        ActuationDelay(drive.delay),
        MotorLag(drive.lag),
        ViscousFriction(drive.viscous),
        CoulombFriction(truth.friction.coulomb),
        BodyMass(mass),
        BodyInertia(body.inertia[1] / (sheet.body_inertia_pitch * mass)),
        ComHeight(body.com_height / sheet.com_height),
        ComOffset(body.com_offset - sheet.com_offset),
        GroundSlope(truth.surroundings.slope),
        ImuMountAngle(truth.sensors.mounting_angle),
    ]
