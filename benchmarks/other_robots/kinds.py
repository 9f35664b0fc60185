"""What can be hidden: its size at severity 1, how its values are drawn, and what it changes of a robot.

Names and values are those of docs/effects.md, for which they are its defaults, in units of the robot; forms are those
of `mechanics` and `drive`. Some are foreign: the library has them not, or did not when the sets were designed.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import inf, pi
from typing import Any

import numpy as np

from benchmarks.other_robots.drive import Sensors
from benchmarks.other_robots.mechanics import GRAVITY, Machine
from benchmarks.other_robots.robots import torque_unit
from twbal.core.robot_parameters import RobotParameters

Values = dict[str, float]
Draw = Callable[[np.random.Generator], float]
SPREAD = 0.3  # share by which the size at severity 1 may be more or less


@dataclass(frozen=True)
class Kind:
    """One effect.

    Attributes:
        sizes: values at severity 1 of the parameters that severity scales.
        unit: in which they are: "torque", "period", "weight" or "" for SI units.
        machine: by the values, fields of the machine that are set; `+name` adds, `*name` multiplies.
        sensors: the same of the sensors.
        drawn: other parameters, which have no size.
        own: drawn numbers that the library's effect does not have.
        neutral: at which nothing happens.
        signed: whether the sign is drawn.
        met: share of the time for which a limit is met at severity 1; severity scales that share.
        unfit: parameters for which the form has no true value.
    """

    sizes: Mapping[str, float]
    unit: str = ""
    machine: Callable[[Any], Mapping[str, float]] | None = None
    sensors: Callable[[Any], Mapping[str, float]] | None = None
    drawn: Mapping[str, Draw] = field(default_factory=dict)
    own: Mapping[str, Draw] = field(default_factory=dict)
    neutral: float = 0.0
    signed: bool = False
    met: float = 0.0
    unfit: tuple[str, ...] = ()


def between(low: float, high: float) -> Draw:
    return lambda rng: float(rng.uniform(low, high))


def _sometimes(draw: Draw) -> Draw:
    return lambda rng: draw(rng) if rng.uniform() < 0.5 else 0.0


def whole(low: int, high: int) -> Draw:
    return lambda rng: float(rng.integers(low, high + 1))


PHASE = between(-pi, pi)

STRUCTURAL: dict[str, Kind] = {
    "dead_zone": Kind(
        {"width": 1.0},
        "torque",
        lambda v: {"dead_zone": v["width"], "skew": v["own_skew"]},
        own={"own_skew": _sometimes(between(-0.15, 0.15))},
    ),
    "torque_saturation": Kind({"limit": 0.0}, machine=lambda v: {"limit": v["limit"]}, neutral=inf, met=0.1),
    "actuation_delay": Kind({"delay": 0.02}, "period", lambda v: {"delay": v["delay"]}),
    "motor_lag": Kind({"time_constant": 0.02}, "period", lambda v: {"lag": v["time_constant"]}),
    "battery_sag": Kind({"rate": 0.05}, machine=lambda v: {"sag": v["rate"]}),
    "coulomb_friction": Kind({"torque": 0.3}, "torque", lambda v: {"kinetic": v["torque"], "static": v["torque"]}),
    "viscous_friction": Kind({"coefficient": 0.03}, "torque", lambda v: {"viscous": v["coefficient"]}),
    "stribeck_friction": Kind(
        {"torque": 0.2, "breakaway": 0.3},
        "torque",
        lambda v: {"kinetic": v["torque"], "static": v["torque"] + v["breakaway"], "fade": v["rate"]},
        drawn={"rate": between(1.0, 4.0)},
    ),
    "backlash": Kind(
        {"gap": 0.05},
        machine=lambda v: {"gap": v["gap"], "rotor_share": v["own_share"]},
        own={"own_share": between(0.2, 0.8)},
    ),
    "cogging": Kind(
        {"torque": 0.3},
        "torque",
        lambda v: {
            "cog_torque": v["torque"],
            "cog_count": v["count"],
            "cog_left": v["own_left"],
            "cog_right": v["own_right"],
        },
        drawn={"count": whole(6, 24)},
        own={"own_left": PHASE, "own_right": PHASE},
        unfit=("torque",),
    ),
    "com_offset": Kind({"angle": 0.035}, machine=lambda v: {"+offset": v["angle"]}, signed=True),
    "ground_slope": Kind({"angle": 0.03}, machine=lambda v: {"slope": v["angle"]}, signed=True),
    "ground_waves": Kind(
        {"slope": 0.02},
        machine=lambda v: {"wave_slope": v["slope"], "waves": v["waves"], "wave_phase": v["own_phase"]},
        drawn={"waves": between(0.8, 3.0)},
        own={"own_phase": PHASE},
    ),
    "rolling_resistance": Kind({"torque": 0.2}, "torque", lambda v: {"ground_kinetic": v["torque"]}),
    "rolling_viscous": Kind({"coefficient": 0.05}, "torque", lambda v: {"ground_viscous": v["coefficient"]}),
    "rotor_inertia": Kind({"share": 0.8}, machine=lambda v: {"rotor_share": v["share"], "geared": 1.0}),
    "wheel_slip": Kind({"friction": 0.0}, machine=lambda v: {"grip": v["friction"]}, neutral=inf, met=0.1),
    "gyro_bias": Kind({"rate": 0.05}, sensors=lambda v: {"gyro_bias": v["rate"]}, signed=True),
    "gyro_scale": Kind({"factor": 1.1}, sensors=lambda v: {"gyro_scale": v["factor"]}, neutral=1.0),
    "imu_mount_angle": Kind({"angle": 0.035}, sensors=lambda v: {"mount": v["angle"]}, signed=True),
    "imu_delay": Kind({"delay": 0.01}, "period", sensors=lambda v: {"delay": v["delay"]}),
    "cable_spring": Kind(
        {"stiffness": 10.0},
        "weight",
        lambda v: {"cable": v["stiffness"], "cable_x": v["anchor_x"], "cable_y": v["anchor_y"]},
        drawn={"anchor_x": _sometimes(between(-0.3, 0.3)), "anchor_y": _sometimes(between(-0.3, 0.3))},
    ),
    "periodic_disturbance": Kind(
        {"force": 3.0},
        "weight",
        lambda v: {"force": v["force"], "frequency": v["frequency"], "force_phase": v["own_phase"]},
        drawn={"frequency": between(0.5, 3.0)},
        own={"own_phase": PHASE},
    ),
}
"""Effects that change the form of the equations."""

SHEET: dict[str, Kind] = {
    "torque_gain": Kind({"gain": 0.8}, machine=lambda v: {"*gain": v["gain"]}, neutral=1.0),
    "body_mass": Kind(
        {"factor": 1.2},
        machine=lambda v: {
            "*mass": v["factor"],
            "*pitch_inertia": v["factor"],
            "*roll_inertia": v["factor"],
            "*yaw_inertia": v["factor"],
        },
        neutral=1.0,
    ),
    "body_inertia": Kind(
        {"factor": 1.3},
        machine=lambda v: {
            "*pitch_inertia": v["factor"],
            "*roll_inertia": v["factor"],
            "*yaw_inertia": v["factor"],
        },
        neutral=1.0,
    ),
    "com_height": Kind({"factor": 1.2}, machine=lambda v: {"*height": v["factor"]}, neutral=1.0),
    "wheel_radius": Kind({"factor": 1.1}, machine=lambda v: {"*radius": v["factor"]}, neutral=1.0),
}
"""Values of the data sheet that are off."""

FOREIGN: dict[str, Kind] = {
    "quadratic_drag": Kind({"coefficient": 12.0}, "weight", lambda v: {"drag": v["coefficient"]}),
    "flexible_mast": Kind(
        {"share": 0.1},
        own={"own_frequency": between(3.0, 8.0)},
    ),
    "slew_limit": Kind({"rate": 0.0}, machine=lambda v: {"slew": v["rate"]}, neutral=inf, met=0.2),
    "friction_feedforward": Kind(
        {"torque": 0.3}, "torque", lambda v: {"compensation": v["torque"]}, unfit=("torque",)
    ),  # added before the driver's gain
    "command_loss": Kind({"share": 0.25}),
    "gyro_bias_walk": Kind({"walk": 0.03}),
}
"""Effects that twbal's library did not have when the sets were designed. It tells lost commands by now."""

KNOWN_SINCE = ("quadratic_drag", "slew_limit", "friction_feedforward")
"""Of these, the ones that it has by now. They are left out where they are hidden as foreign, and so stay foreign."""

LATER: dict[str, Kind] = {
    "flexible_frame": Kind(
        {"share": 0.1},
        drawn={"frequency": between(3.0, 12.0), "damping": between(0.02, 0.15), "height": between(1.4, 2.0)},
        own={"own_hardening": _sometimes(between(0.0, 2e4))},
    ),
    "backlash_behind_encoder": Kind(
        {"gap": 0.05},
        machine=lambda v: {"gap": v["gap"], "rotor_share": v["own_share"]},
        sensors=lambda v: {"on_shaft": 1.0},
        own={"own_share": between(0.2, 0.8)},
    ),
}
"""The mast once more, of any height and damping and on a spring that may harden, and the play once more, now that the
library has them by these names."""

KNOWN_AS = {"flexible_mast": "flexible_frame"}
"""Of what is foreign, what the library has by now by another name: it must do without that there."""

SHAPES: dict[str, Kind] = {
    "cubic_friction": Kind({"cubic": 0.003}, "torque", lambda v: {"cubic": v["cubic"]}),
    "notch": Kind(
        {"torque": 0.5},
        "torque",
        lambda v: {"notch": v["torque"], "notch_at": v["place"], "notch_width": v["width"]},
        drawn={"place": PHASE, "width": between(0.3, 0.7)},
        signed=True,
    ),
    "spring_stop": Kind(
        {"stiffness": 15.0},
        "weight",
        lambda v: {"stop": v["stiffness"], "stop_at": v["place"]},
        drawn={"place": between(0.3, 0.6)},
    ),
    "one_sided_motor": Kind({"share": 0.15}, machine=lambda v: {"one_sided": v["share"]}, signed=True),
    "gust": Kind(
        {"force": 3.0},
        "weight",
        lambda v: {"gust": v["force"], "gust_at": v["time"]},
        drawn={"time": between(3.0, 7.0)},
        signed=True,
    ),
    "bowed_tilt": Kind({"bow": 3.0}, sensors=lambda v: {"bow": v["bow"]}, signed=True),
}
"""Functions of one variable that the library does not have; for `benchmarks.free_form`, and in no stratum."""

ALL = {**STRUCTURAL, **SHEET, **FOREIGN, **LATER, **SHAPES}

SAME = ({"com_offset", "imu_mount_angle"},)
"""Effects that no sensor of the robot tells apart, as docs/effects.md declares."""

ALIKE = ({"coulomb_friction", "stribeck_friction"}, {"backlash", "backlash_behind_encoder"}, *SAME)
"""Of these one is a case of the other, or the same: they are hidden one at a time, and left out together."""


def alike(name: str) -> set[str]:
    """An effect and those that are left out with it."""
    return next((group for group in ALIKE if name in group), {name})


def equivalents(name: str) -> set[str]:
    """An effect and those that are declared the same."""
    return next((group for group in SAME if name in group), {name})


def size(unit: str, sheet: RobotParameters) -> float:
    """One of a unit for a robot, over that of the paper's robot at 50 Hz."""
    weight = (sheet.body_mass + 2.0 * sheet.wheel_mass) * GRAVITY
    return {
        "torque": torque_unit(sheet),
        "period": sheet.control_period / 0.02,
        "weight": weight / (12.0 * GRAVITY),
        "": 1.0,
    }[unit]


def drawn_values(name: str, severity: float, sheet: RobotParameters, rng: np.random.Generator) -> Values:
    """Values of a hidden effect; those of a limit that is met are left at its neutral value, for `limited`."""
    kind = ALL[name]
    spread = 1.0 + SPREAD * rng.uniform(-1.0, 1.0)
    sign = -1.0 if kind.signed and rng.uniform() < 0.5 else 1.0
    values: Values = {}
    for key, usual in kind.sizes.items():
        away = (usual - kind.neutral) * spread * severity * size(kind.unit, sheet)
        values[key] = kind.neutral if kind.met else kind.neutral + sign * away
    if name == "rotor_inertia":
        values["share"] = min(values["share"], 0.9)
    for key, draw in {**kind.drawn, **kind.own}.items():
        values[key] = draw(rng)
    return values


def put(name: str, values: Values, machine: Machine, sensors: Sensors) -> tuple[Machine, Sensors]:
    """A robot with one more effect."""
    kind = ALL[name]
    if kind.machine:
        machine = _changed(machine, kind.machine(values))
    if kind.sensors:
        sensors = _changed(sensors, kind.sensors(values))
    if name == "flexible_mast":
        machine = _with_mast(machine, values["share"], values["own_frequency"], 0.05, 1.8)
    if name == "flexible_frame":
        machine = _with_mast(machine, *(values[key] for key in ("share", "frequency", "damping", "height")))
        machine = machine._replace(mast_hardening=values["own_hardening"])
    return machine, sensors


def _with_mast(machine: Machine, share: float, frequency: float, damping: float, height: float) -> Machine:
    mass, pace = share * machine.mass, 2.0 * pi * frequency
    return machine._replace(
        mast_mass=mass,
        mast_height=height * machine.height,
        mast_stiffness=mass * pace**2,
        mast_damping=2.0 * damping * mass * pace,
    )


def _changed(part: Any, changes: Mapping[str, float]) -> Any:
    for key, value in changes.items():
        name = key.lstrip("+*")
        before = getattr(part, name)
        part = part._replace(**{name: before + value if key[0] == "+" else before * value if key[0] == "*" else value})
    return part
