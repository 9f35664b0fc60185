"""Settings of the link to a robot, and of what a virtual robot hides."""

from twbal.cli.settings.kinds import ListOf, Number, OneOf, OrNull, Part, Setting, Span, Text, Whole, YesNo
from twbal.cli.settings.robot_settings import CONTROL_PERIODS, SENSORS

SEED = Whole(0, 2**32 - 1)
CLOCK = OneOf(("lockstep", "real_time"))
_PATIENCE = Number(0.001, 3600.0, "s")

LINK = (
    Setting("link.port", Text("path or URL"), "port of the robot: /dev/ttyUSB0, socket://host:port", common=True),
    Setting("link.seed", SEED, "which virtual robot: seed of what it hides", common=True),
    Setting("link.clock", CLOCK, "clock of a virtual robot"),
    Setting("link.robot", Text("name"), "data sheet of a virtual robot"),
    Setting("link.overrides", ListOf(Text("override")), "more settings of twbal virtual-robot"),
    Setting("link.start_timeout", _PATIENCE, "time for a virtual robot to start"),
    Setting("link.baud_rate", Whole(50, 100_000_000, "bit/s"), "speed of the serial port"),
    Setting("link.connect_timeout", _PATIENCE, "time for the robot to answer"),
    Setting("link.arm_timeout", _PATIENCE, "time for the robot to be armed"),
    Setting("link.timeout", _PATIENCE, "silence that ends a rollout"),
    Setting("link.on_board", YesNo(), "the policy on board of the robot drives; the host watches"),
    Setting("link.deploy", OrNull(Text("command")), "puts the policy of $POLICY_FOLDER on board; null: a person does"),
    Setting("link.program", Text("path"), "the firmware, built for this computer"),
    Setting("link.motor", OrNull(Part()), "motor that makes voltages of torques; null: the robot takes torques"),
    Setting("link.confirm_placed", OrNull(Part()), "question before each rollout; null: none"),
)

_FACTOR = Span(Number(0.01, 100.0))
_ANGLE = Span(Number(-1.5, 1.5, "rad"))
_SHARE = Span(Number(0.0, 0.9))
_DIFFERENCE = Span(Number(-0.9, 0.9))
_TIME = Span(Number(0.0, 10.0, "s"))
_TORQUE = Span(Number(0.0, 1e5, "N·m"))

FAULTS = (
    Setting("faults.outer", Number(1e-6, 0.5), "share of a range's ends that is drawn from"),
    Setting("faults.reference_torque", Number(1e-4, 1e5, "N·m"), "torque limit that torques are for"),
    Setting("faults.torque_gain", Span(Number(0.01, 10.0)), "torque over command"),
    Setting("faults.motor_difference", _DIFFERENCE, "gain of the left motor less the right one's, over their mean"),
    Setting("faults.dead_zone", _TORQUE, "half width of the dead zone, on its wider side"),
    Setting("faults.dead_zone_skew", _DIFFERENCE, "share by which its other side is narrower; > 0: backward"),
    Setting("faults.delay", _TIME, "delay of the actuation"),
    Setting("faults.delay_periods", Span(Number(0.0, 100.0, CONTROL_PERIODS)), "more of that delay"),
    Setting("faults.motor_lag", _TIME, "time constant of the motors"),
    Setting("faults.slew_time", _TIME, "time from zero torque to the limit"),
    Setting("faults.sag_load", _SHARE, "share of the supply that is lost under full load"),
    Setting("faults.sag_use", Span(Number(0.0, 1.0, "1/s")), "share of the supply lost in a second of full load"),
    Setting("faults.viscous_friction", Span(Number(0.0, 1e4, "N·m·s/rad")), "viscous friction of each wheel"),
    Setting("faults.coulomb_friction", _TORQUE, "dry friction of each wheel"),
    Setting("faults.static_friction", Span(Number(1.0, 10.0)), "static friction over Coulomb's"),
    Setting("faults.stribeck_rate", Span(Number(1e-3, 1e3, "rad/s")), "rate over which static friction fades"),
    Setting("faults.presliding", Span(Number(1e-5, 0.1, "rad")), "angle by which bristles bend before they slide"),
    Setting("faults.cogging", _TORQUE, "amplitude of each motor's cogging"),
    Setting("faults.cogging_count", Span(Number(1.0, 1e4)), "its periods in a turn of the wheel"),
    Setting("faults.rotor_share", _SHARE, "share of wheel_inertia that turns relative to the body"),
    Setting("faults.play", Span(Number(0.0, 0.5, "rad")), "play of each gear"),
    Setting("faults.encoder_on_motor", Span(Number(0.0, 1.0)), "from 0.5 on: encoders on motors, not on wheels"),
    Setting("faults.body_mass", _FACTOR, "mass over the data sheet's"),
    Setting("faults.com_height", _FACTOR, "height over the data sheet's"),
    Setting("faults.com_offset", _ANGLE, "angle of the centre of mass"),
    Setting("faults.body_inertia", _FACTOR, "inertia over the data sheet's, besides that of the mass"),
    Setting("faults.wheel_mass", _FACTOR, "mass of each wheel over the data sheet's"),
    Setting("faults.wheel_inertia", _FACTOR, "inertia of each wheel over the data sheet's"),
    Setting("faults.wheel_radius", _FACTOR, "radius over the data sheet's"),
    Setting("faults.radius_difference", _DIFFERENCE, "radius of the left wheel less the right one's, over their mean"),
    Setting("faults.eccentricity", _SHARE, "distance of the wheel's middle from its axle, over the radius"),
    Setting("faults.drag", Span(Number(0.0, 100.0)), "air drag coefficient"),
    Setting("faults.slope", _ANGLE, "angle by which the ground rises"),
    Setting("faults.waves", Span(Number(0.0, 1.0, "rad")), "amplitude of the slope of the ground's waves"),
    Setting("faults.wave_length", Span(Number(0.01, 1e4)), "their length over the wheel's radius"),
    Setting("faults.scrub", Span(Number(0.0, 10.0)), "friction coefficient of tyres that turn on the spot"),
    Setting("faults.mounting_angle", _ANGLE, "of the tilt sensor"),
    Setting("faults.fusion_time", Span(Number(0.0, 1e4, "s")), "of the complementary filter; 0: the true tilt"),
    Setting("faults.filter_time", _TIME, "time constant of the low-pass of tilt and tilt rate"),
    Setting("faults.gyro_bias", Span(Number(-100.0, 100.0, "rad/s")), "bias of the gyro"),
    Setting("faults.gyro_walk", Span(Number(0.0, 100.0, "rad/s/√s")), "random walk of that bias"),
    Setting("faults.ticks", Span(Number(0.0, 1e6)), "ticks of an encoder in a turn; 0: no steps"),
    Setting("faults.rate_window", Span(Number(0.0, 1.0, CONTROL_PERIODS)), "time over which ticks are counted"),
    Setting("faults.torque_noise", _TORQUE, "sd of a random torque on both shafts together"),
    *(
        Setting(f"faults.noise.{name}", Number(0.0, 1e4, unit), "standard deviation of the sensor's noise")
        for name, unit in SENSORS.items()
    ),
)
