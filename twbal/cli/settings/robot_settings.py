"""Settings of the robot, its start, its state, and the simulation."""

from twbal.cli.settings.kinds import PATH, ListOf, Number, OneOf, OrNull, Part, Setting, Text, Whole, YesNo
from twbal.core.robot_parameters import LARGEST_LEAN, LEAST_VALUE
from twbal.core.robot_sheet import MEANING

MEASURED = {"tilt": "rad", "tilt_rate": "rad/s", "speed": "m/s", "acceleration": "m/s²", "yaw_rate": "rad/s"}
"""Unit of each channel that a sensor measures."""
CHANNELS = {**MEASURED, "position": "m", "position_integral": "m·s"}
"""Unit of each channel of the state but past commands."""
SENSORS = {
    "tilt": "rad",
    "tilt_rate": "rad/s",
    "acceleration": "m/s²",
    "wheel_angle": "rad",
    "wheel_rate": "rad/s",
    "yaw_rate": "rad/s",
}
"""Unit of each sensor."""
CONTROL_PERIODS = "control periods"
STEPS = Whole(1, 1_000_000, CONTROL_PERIODS)
TILT_LIMIT = Number(0.001, 100.0, "rad")
UPRIGHT = Number(0.001, 1.57, "rad")  # short of lying on the floor, where no rollout goes on
MASS, WHEEL_MASS = Number(0.001, 1e4, "kg"), Number(1e-5, 1e4, "kg")
TORQUE_LIMIT = Number(1e-4, 1e5, "N·m")
BODY_INERTIA = Number(LEAST_VALUE, 1e6, "kg·m²")
LEAN = Number(-LARGEST_LEAN, LARGEST_LEAN, "rad")
CONTROL_PERIOD = Number(0.0005, 1.0, "s")
PHYSICS_STEP = Number(1e-5, 0.001, "s")
STATE_NAMES = ListOf(Text("name of a channel"), least=1, most=20)

ROBOT = (
    Setting("robot.name", Text("name"), "name of the data sheet"),
    Setting("robot.body_mass", MASS, "mass of all that does not turn with the wheels"),
    Setting("robot.com_height", Number(0.001, 100.0, "m"), "height of the centre of mass above the axle"),
    Setting("robot.com_offset", LEAN, "angle of the centre of mass before the axle"),
    Setting("robot.body_inertia_pitch", BODY_INERTIA, "pitch inertia of the body about its centre of mass"),
    Setting("robot.body_inertia_roll", BODY_INERTIA, "roll inertia of the body about its centre of mass"),
    Setting("robot.body_inertia_yaw", BODY_INERTIA, "yaw inertia of the body about its centre of mass"),
    Setting("robot.wheel_mass", WHEEL_MASS, "mass of each wheel"),
    Setting("robot.wheel_radius", Number(0.001, 10.0, "m"), "radius of the wheels"),
    Setting("robot.wheel_inertia", Number(LEAST_VALUE, 1e5, "kg·m²"), "inertia of each wheel, with its geared rotor"),
    Setting("robot.wheel_width", Number(1e-4, 10.0, "m"), "width of each wheel"),
    Setting("robot.track", Number(0.001, 100.0, "m"), "distance between the middles of the wheels"),
    Setting("robot.torque_limit", TORQUE_LIMIT, "largest command, sum of both wheels"),
    Setting("robot.control_period", CONTROL_PERIOD, "time for which each command is held"),
    *(
        Setting(f"robot.provenance.{kind}", ListOf(Text("name of a value"), most=20), f"values that are {meaning}")
        for kind, meaning in MEANING.items()
    ),
)

START = (
    Setting("start.tilt_mean", LEAN, "mean of the tilt at the start"),
    Setting("start.tilt_sd", Number(0.0, 1.5, "rad"), "standard deviation of that tilt"),
    Setting("start.tilt_rate_sd", Number(0.0, 100.0, "rad/s"), "standard deviation of the tilt rate at the start"),
    Setting("start.speed_sd", Number(0.0, 100.0, "m/s"), "standard deviation of the speed at the start"),
)

STATE = (
    Setting("state.names", STATE_NAMES, "channels that make up the state"),
    Setting("state.wheel_radius", Number(0.001, 10.0, "m"), "radius that turns wheel rates into speeds"),
    Setting("state.control_period", CONTROL_PERIOD, "time over which speeds become positions"),
)

SIMULATION = (
    Setting(
        "sim.physics_step",
        PHYSICS_STEP,
        "step of the integrator, at most; it divides the control period",
    ),
    Setting("sim.engine", OneOf(("pybullet", "planar")), "planar: the analytic equations of motion"),
    Setting("sim.effects", Part(), "what the data sheet leaves out; +effect@sim.effects.<name>=<name>"),
    Setting("sim.effects.*", Part(), "an effect"),
    Setting("sim.draws", Part(), "effects whose sizes are drawn for each rollout"),
    Setting("sim.draws.*", Part(), "an effect, by name"),
    Setting("ensemble", Part(), "more simulated robots that policy 0 must serve"),
    Setting("ensemble.*", Part(), "the effects of one of them"),
    Setting("ensemble.*.*", Part(), "an effect"),
)

COURSE = (
    Setting("course", Part(), "where the robot is to go; none: it is to stay where it was put"),
    Setting("course.robot", Part(), "data sheet that the limits are taken from"),
    Setting("course.segments", ListOf(Part(), 1, 1000), "speeds and places in order, see conf/groups/course.yaml"),
    Setting("course.speed_limit", OrNull(Number(1e-3, 100.0, "m/s")), "of the reference; null: from the sheet"),
    Setting("course.acceleration_limit", OrNull(Number(1e-3, 1e3, "m/s²")), "of the reference; null: from the sheet"),
    Setting("course.jerk_limit", OrNull(Number(1e-3, 1e5, "m/s³")), "of the reference; null: from the sheet"),
    Setting("course.control_heading", YesNo(), "keep the heading, and turn, where the robot can be turned"),
    Setting("course.yaw_rate_limit", OrNull(Number(1e-3, 100.0, "rad/s")), "of the reference; null: from the sheet"),
    Setting(
        "course.yaw_acceleration_limit", OrNull(Number(1e-3, 1e4, "rad/s²")), "of the reference; null: from the sheet"
    ),
    Setting("course.give_way", Number(0.01, 1e4, "s"), "lag at the speed limit from which on the reference gives way"),
)

POLICY = (
    Setting("policy.path", PATH, "policy.pt that drives", common=True),
    Setting("policy.channels", STATE_NAMES, "channels that the policy sees"),
    Setting("policy.amplitude", Number(0.001, 1.0), "share of the torque limit for random commands", common=True),
    Setting("policy.torque_limit", TORQUE_LIMIT, "largest command"),
    Setting("policy.hold", Whole(1, 10_000, CONTROL_PERIODS), "time for which each random command is held"),
    Setting("policy.robot", Part(), "data sheet that the regulator is made for"),
    Setting("policy.widths", ListOf(Number(1e-6, 1e6), 3, 3), "tilt [rad], rate [rad/s], speed [m/s] that cost alike"),
    Setting("policy.command_width", Number(1e-4, 1e4), "command that costs as much, per torque limit"),
    Setting("policy.multisine", Number(0.0, 1.0), "sd of the multisine, per torque limit"),
    Setting("policy.prbs", Number(0.0, 1.0), "pseudo-random binary torque, per torque limit"),
    Setting(
        "policy.speed", OrNull(Number(0.0, 100.0, "m/s")), "asked for forth, at rest and back, 3 s each; null: sheet"
    ),
    Setting("policy.fade_tilt", TILT_LIMIT, "tilt at which the disturbance has faded"),
)
