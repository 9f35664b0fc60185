"""The numbers of a robot that effects may change, and the ways to change one.

Kernels have them, too (`twbal.core.compiled`).
"""

from enum import IntEnum


class Quantity(IntEnum):
    """A number of a robot; in lower case, its name in `RobotParameters`, `Frame`, `DriveTrain` or `Ground`.

    The physics engine alone has body_inertia_roll, body_inertia_yaw, wheel_inertia (of the wheels' links) and
    imbalance. The planar model alone has those from turn_inertia to slew_rate but for geared_share, in their place and
    in that of code that effects have for the engine.
    """

    BODY_MASS = 0
    COM_HEIGHT = 1
    COM_OFFSET = 2
    BODY_INERTIA_PITCH = 3
    BODY_INERTIA_ROLL = 4
    BODY_INERTIA_YAW = 5
    WHEEL_RADIUS = 6
    WHEEL_INERTIA = 7
    COULOMB_FRICTION = 8
    VISCOUS_FRICTION = 9
    BREAKAWAY = 10
    STRIBECK_RATE = 11
    GAP = 12
    ROTOR_SHARE = 13
    SLOPE = 14
    GRIP = 15
    ROLLING_RESISTANCE = 16
    ROLLING_VISCOUS = 17
    TURN_INERTIA = 18
    """I_xx - I_zz [kg·m²], with which a robot that turns pitches."""
    GEARED_SHARE = 19
    COMMAND_DELAY = 20
    """By which commands act late [s]."""
    MOTOR_LAG = 21
    """Time constant with which the motors' torque follows [s]."""
    IMU_DELAY = 22
    """By which tilt and tilt rate are shown late [s]."""
    TILT_FILTER_RATE = 23
    """At which a filter of the tilt follows the accelerometer [1/s]."""
    TILT_FILTER_LEAD = 24
    """By which the sum of the gyro in that filter runs ahead of the tilt [s]."""
    SLEW_RATE = 25
    """Fastest change of the torque that the driver asks of both motors together [N·m/s]."""
    IMBALANCE = 26
    """By which the right motor is stronger than the mean of both."""
    SWINGING_SHARE = 27
    SWING_FREQUENCY = 28
    SWING_DAMPING = 29
    SWING_HEIGHT = 30
    SHAFT_GAP = 31
    """Width of a gap that lies behind encoders on the motors' shafts [rad]."""
    SHAFT_ROTOR_SHARE = 32
    TYRE_CREEP = 33
    """Speed of slip below which the tyres creep, and above which they slide [m/s]."""
    PRESLIDING = 34
    CONTACT_TIME = 35
    CONTACT_DAMPING = 36
    SHAFT_CONTACT_TIME = 37
    SHAFT_CONTACT_DAMPING = 38


class Change(IntEnum):
    """What a parameter of an effect does to a quantity."""

    ADD = 0
    SCALE = 1
    REDUCE = 2
    LIMIT = 3
    REPLACE = 4


def changed(value: float, change: int, by: float) -> float:
    """A quantity's value after a `Change`; plain enough to be compiled."""
    if change == Change.ADD:
        return value + by
    if change == Change.SCALE:
        return value * by
    if change == Change.REDUCE:
        return value * (1.0 - by)
    return min(value, by) if change == Change.LIMIT else by
