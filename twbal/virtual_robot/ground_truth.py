"""What one virtual robot is: every number that it hides, in SI units."""

from dataclasses import dataclass

Pair = tuple[float, float]
"""Of the left and of the right wheel."""


@dataclass(frozen=True)
class Body:
    """Masses and measures.

    Attributes:
        mass: of all that does not turn with the wheels [kg].
        com_height: of its centre of mass above the axle [m].
        com_offset: angle by which that lies in front [rad].
        inertia: about its centre of mass: roll, pitch, yaw [kg·m²].
        wheel_mass: of each wheel [kg].
        wheel_inertia: of each wheel about the axle, without the rotor [kg·m²].
        rotor_inertia: of each motor's rotor, seen through its gear; it turns relative to the body [kg·m²].
        wheel_radius: [m].
        wheel_width: [m].
        eccentricity: distance of each wheel's middle from its axle [m].
        eccentric_phase: direction of that in the wheel, from its z axis towards x [rad].
        track: [m].
    """

    mass: float
    com_height: float
    com_offset: float
    inertia: tuple[float, float, float]
    wheel_mass: float
    wheel_inertia: float
    rotor_inertia: float
    wheel_radius: Pair
    wheel_width: float
    eccentricity: float
    eccentric_phase: Pair
    track: float


@dataclass(frozen=True)
class Actuation:
    """From the command to the shafts of the motors.

    Attributes:
        torque_limit: at which the command, the sum of both wheels, is cut [N·m].
        delay: from a command to when it acts, any time [s].
        dead_zone: of the summed command: forward, backward [N·m].
        gain: torque over command of each motor.
        sag_load: share of the supply that both motors at their limit take away.
        sag_use: share of the supply that is lost in a second of that [1/s].
        lag: time constant of the motors' torque [s].
        slew_time: in which a torque goes from zero to the limit; 0: at once [s].
        torque_noise: standard deviation of a random torque on both shafts together, half on each; drawn anew for each
            control period, and held for it [N·m].
        viscous: braking torque of each motor over its rate, back-EMF above all [N·m·s/rad].
        cogging: amplitude of each motor's cogging torque [N·m].
        cogging_count: periods of it in a turn of the wheel.
        cogging_phase: [rad].
        play: of each gear, full width at the wheel [rad].
        gear_stiffness: of its teeth and shafts [N·m/rad].
        gear_damping: [N·m·s/rad].
    """

    torque_limit: float
    delay: float
    dead_zone: Pair
    gain: Pair
    sag_load: float
    sag_use: float
    lag: float
    slew_time: float
    torque_noise: float
    viscous: float
    cogging: float
    cogging_count: int
    cogging_phase: Pair
    play: float
    gear_stiffness: float
    gear_damping: float


@dataclass(frozen=True)
class Friction:
    """Dry friction in each bearing, of motor against body: the LuGre model (Canudas de Wit 1995).

    Attributes:
        coulomb: while it slides fast [N·m].
        static: at which it begins to slide [N·m].
        stribeck_rate: over which one becomes the other [rad/s].
        bristle_stiffness: [N·m/rad].
        bristle_damping: [N·m·s/rad].
    """

    coulomb: float
    static: float
    stribeck_rate: float
    bristle_stiffness: float
    bristle_damping: float


@dataclass(frozen=True)
class Surroundings:
    """What the robot drives on and through.

    Attributes:
        slope: angle by which the ground rises towards +x [rad].
        wave_slope: amplitude of the slope of its waves [rad].
        wave_length: [m].
        wave_phase: [rad].
        scrub: largest torque by which both tyres oppose turning on the spot [N·m].
        drag: force of the air over the square of the speed [N·s²/m²].
    """

    slope: float
    wave_slope: float
    wave_length: float
    wave_phase: float
    scrub: float
    drag: float


@dataclass(frozen=True)
class Noise:
    """Standard deviations of the sensors' white noise.

    Attributes:
        tilt: [rad].
        tilt_rate: [rad/s].
        acceleration: [m/s²].
        wheel_angle: of the mean of both encoders [rad].
        wheel_rate: [rad/s].
        yaw_rate: [rad/s].
    """

    tilt: float
    tilt_rate: float
    acceleration: float
    wheel_angle: float
    wheel_rate: float
    yaw_rate: float


@dataclass(frozen=True)
class SensorModel:
    """What the robot makes of its motion.

    Attributes:
        mounting_angle: measured tilt of a body that stands straight [rad].
        fusion_time: time constant of the complementary filter of gyro and accelerometer; 0: the true tilt [s].
        filter_time: time constant of the low-pass behind tilt and tilt rate [s].
        gyro_bias: [rad/s].
        gyro_walk: random walk of that [rad/s/√s].
        ticks: of an encoder in a turn of the wheel; 0: no steps.
        rate_window: time over which the encoders' ticks are counted; 0: the rate as it is [s].
        is_encoder_on_motor: before the play, and not behind it.
        noise: of all of them.
    """

    mounting_angle: float
    fusion_time: float
    filter_time: float
    gyro_bias: float
    gyro_walk: float
    ticks: int
    rate_window: float
    is_encoder_on_motor: bool
    noise: Noise


@dataclass(frozen=True)
class GroundTruth:
    """One robot."""

    body: Body
    drive: Actuation
    friction: Friction
    surroundings: Surroundings
    sensors: SensorModel
