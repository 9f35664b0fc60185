"""Settings of the link to a robot, and of what a virtual robot hides."""

from twbal.cli.settings.kinds import ListOf, Number, OneOf, OrNull, Part, Span, Text, Whole
from twbal.cli.settings.robot_settings import CONTROL_PERIODS, SENSORS
from twbal.cli.settings.setting import Setting

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
    Setting("link.confirm_placed", OrNull(Part()), "question before each rollout; null: none"),
)

FAULTS = (
    Setting("faults.outer", Number(1e-6, 0.5), "share of a range's ends that is drawn from"),
    Setting("faults.reference_torque", Number(1e-4, 1e5, "N·m"), "torque limit that torques are for"),
    Setting("faults.torque_gain", Span(Number(0.01, 10.0)), "torque over command"),
    Setting("faults.dead_zone", Span(Number(0.0, 1e5, "N·m")), "half width of the dead zone"),
    Setting("faults.delay_periods", Span(Number(0.0, 100.0, CONTROL_PERIODS)), "delay of the actuation"),
    Setting("faults.lag_periods", Span(Number(0.0, 100.0, CONTROL_PERIODS)), "time constant of the motors"),
    Setting("faults.viscous_friction", Span(Number(0.0, 1e4, "N·m·s/rad")), "viscous friction of each wheel"),
    Setting("faults.coulomb_friction", Span(Number(0.0, 1e5, "N·m")), "dry friction of each wheel"),
    Setting("faults.body_mass", Span(Number(0.01, 100.0)), "mass over the data sheet's"),
    Setting("faults.com_height", Span(Number(0.01, 100.0)), "height over the data sheet's"),
    Setting("faults.com_offset", Span(Number(-1.5, 1.5, "rad")), "angle of the centre of mass"),
    *(
        Setting(f"faults.noise.{name}", Number(0.0, 1e4, unit), "standard deviation of the sensor's noise")
        for name, unit in SENSORS.items()
    ),
)
