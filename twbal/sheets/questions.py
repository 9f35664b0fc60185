"""What a person is asked to write a robot's sheet, in the order in which answers are needed."""

from collections.abc import Callable, Mapping
from math import tau
from typing import NamedTuple

from twbal.core.motor import Motor
from twbal.core.robot_sheet import ValueProvenance
from twbal.sheets.formulas import box_inertia, stall_torque, swing_inertia, two_string_inertia, wheel_inertia

Values = Mapping[str, float]
"""Answers in SI units, by their questions."""


class Way(NamedTuple):
    """How a value is computed.

    Attributes:
        name: as it is answered.
        needs: questions whose answers it takes.
        compute: the value of these.
        source: what the sheet says of it; `{key}` stands for an answer.
        provenance: of the value.
    """

    name: str
    needs: tuple[str, ...]
    compute: Callable[[Values], float]
    source: str
    provenance: ValueProvenance = ValueProvenance.COMPUTED


class Question(NamedTuple):
    """One number that a person knows or can find out.

    Attributes:
        key: of the answer; of a value of the sheet, its name there.
        unit: SI unit.
        what: is asked for, in a few words.
        how: to find it, as a sentence.
        low: lowest that is believed without its unit, in SI units.
        high: highest.
        provenance: of an answer that does not say it.
        ways: to compute it.
        offered: the answer of a person who says nothing; empty: there is none.
    """

    key: str
    unit: str
    what: str
    how: str
    low: float
    high: float
    provenance: ValueProvenance = ValueProvenance.MEASURED
    ways: tuple[Way, ...] = ()
    offered: str = ""


def _strings(axis: str) -> Way:
    period = f"{axis}_period"

    def compute(v: Values) -> float:
        return two_string_inertia(v["body_mass"], v["strings_distance"], v["strings_length"], v[period])

    source = f"{{{period}}} s on two strings of {{strings_length}} m, {{strings_distance}} m apart"
    return Way("strings", ("body_mass", "strings_distance", "strings_length", period), compute, source)


def _box(a: str, b: str) -> Way:
    def compute(v: Values) -> float:
        return box_inertia(v["body_mass"], v[a], v[b])

    return Way("box", ("body_mass", a, b), compute, f"of an even box, m ({{{a}}}² + {{{b}}}²) / 12")


_LESS_WHEELS = Way(
    *("less_wheels", ("robot_mass", "wheel_mass"), lambda v: v["robot_mass"] - 2.0 * v["wheel_mass"]),
    *("the whole robot's {robot_mass} kg less its wheels", ValueProvenance.MEASURED),
)
_TEN_TURNS = Way(
    *("ten_turns", ("ten_turns_distance",), lambda v: v["ten_turns_distance"] / (10.0 * tau)),
    *("{ten_turns_distance} m in ten turns", ValueProvenance.MEASURED),
)
_DISK = Way(
    *("disk", ("wheel_mass", "wheel_radius"), lambda v: wheel_inertia(v["wheel_mass"], v["wheel_radius"])),
    "a disk, m r² / 2, and nothing for the rotor",
)
_ROTOR = Way(
    "rotor",
    ("wheel_mass", "wheel_radius", "rotor_inertia", "motor_gear"),
    lambda v: wheel_inertia(v["wheel_mass"], v["wheel_radius"], v["rotor_inertia"], v["motor_gear"]),
    "a disk, m r² / 2, and the rotor's {rotor_inertia} kg·m² times {motor_gear}²",
)
_SWING = Way(
    "swing",
    ("body_mass", "com_height", "swing_period"),
    lambda v: swing_inertia(v["body_mass"], v["com_height"], v["swing_period"]),
    "{swing_period} s a swing below its axle: m g l T² / 4π² - m l²",
)
_STALL = Way(
    *("stall", ("stall_torque",), lambda v: 2.0 * v["stall_torque"]),
    "twice {stall_torque} N·m, the stall torque of one motor",
)
_MOTOR = Way(
    "motor",
    ("motor_voltage", "motor_resistance", "motor_constant", "motor_gear"),
    lambda v: stall_torque(Motor(v["motor_resistance"], v["motor_constant"], v["motor_gear"], v["motor_voltage"])),
    "stall of both motors, 2 N k U / R = 2 * {motor_gear} * {motor_constant} * {motor_voltage} / {motor_resistance}",
)

_DATA_SHEET, _GUESS = ValueProvenance.DATA_SHEET, ValueProvenance.GUESS

VALUES: tuple[Question, ...] = (
    Question(
        *("control_period", "s", "time for which each command is held"),
        "Of your firmware's loop; 60 Hz and 1/60 are answers, too.",
        *(0.001, 0.1),
        _DATA_SHEET,
    ),
    Question(
        *("wheel_mass", "kg", "mass of one wheel with its tyre"),
        *("Weigh both wheels together, and halve it.", 0.002, 2.0),
    ),
    Question(
        *("body_mass", "kg", "mass of all that does not turn with the wheels"),
        *("Weigh the body with motors and battery; or the whole robot: answer less_wheels.", 0.05, 50.0),
        ways=(_LESS_WHEELS,),
    ),
    Question(
        *("wheel_radius", "m", "radius of the wheels, half the diameter on the package"),
        *("Half the diameter; better, roll the robot for ten turns of a wheel: answer ten_turns.", 0.008, 0.5),
        ways=(_TEN_TURNS,),
    ),
    Question("wheel_width", "m", "width of a wheel", "With calipers or a ruler, at its tyre.", 0.002, 0.3),
    Question(
        *("track", "m", "distance between the middles of both wheels"),
        *("Measure from the outside of one wheel to the inside of the other.", 0.03, 2.0),
    ),
    Question(
        *("com_height", "m", "distance of the body's centre of mass from the axle"),
        *("Take the wheels off, balance the body on an edge, and measure from there to the axle.", 0.004, 2.0),
    ),
    Question(
        *("com_offset", "rad", "angle of the body's centre of mass before its upright"),
        "0 where the robot sets its tilt to zero at its balance point, or is symmetric.",
        *(-0.3, 0.3),
        provenance=_GUESS,
        offered="0",
    ),
    Question(
        *("wheel_inertia", "kg·m²", "inertia of a wheel about the axle, with the rotor"),
        *("As a rule computed: of a disk (disk), better with the motor's rotor (rotor).", 1e-7, 1.0),
        *(_DATA_SHEET, (_DISK, _ROTOR)),
    ),
    Question(
        *("body_inertia_pitch", "kg·m²", "inertia of the body about its centre of mass"),
        *("Let the body swing below its axle and time it (swing); or take it for a box (box).", 1e-6, 30.0),
        *(ValueProvenance.CAD, (_SWING, _box("body_depth", "body_height"))),
    ),
    Question(
        *("body_inertia_roll", "kg·m²", "the same, leaning sideways"),
        *("Hang the body on two strings, lying, and let it turn (strings); or a box (box).", 1e-6, 30.0),
        *(ValueProvenance.CAD, (_strings("roll"), _box("body_width", "body_height"))),
    ),
    Question(
        *("body_inertia_yaw", "kg·m²", "the same, turning on the spot"),
        *("Hang the body on two strings, upright, and let it turn (strings); or a box (box).", 1e-6, 30.0),
        *(ValueProvenance.CAD, (_strings("yaw"), _box("body_depth", "body_width"))),
    ),
    Question(
        *("torque_limit", "N·m", "largest torque of both motors together"),
        *("From a stall torque (stall), or from voltage, resistance, constant and gear (motor).", 0.01, 300.0),
        *(_DATA_SHEET, (_STALL, _MOTOR)),
    ),
)
"""Of the sheet's values, all of them."""

MEASUREMENTS: tuple[Question, ...] = (
    Question("robot_mass", "kg", "mass of the whole robot", "Weigh it, with its battery.", 0.05, 50.0),
    Question(
        *("ten_turns_distance", "m", "way of the robot in ten turns of a wheel"),
        *(
            "Mark tyre and floor, push the robot under its own weight until the mark was down ten times.",
            0.5,
            32.0,
        ),
    ),
    Question(
        *("swing_period", "s", "time of one swing of the body, there and back"),
        *("Time ten swings of at most 10°, and divide by ten.", 0.1, 6.0),
    ),
    Question("body_depth", "m", "size of the body from front to back", "Of the box that it fills.", 0.01, 2.0),
    Question("body_width", "m", "size of the body from side to side", "Of the box that it fills.", 0.01, 2.0),
    Question("body_height", "m", "size of the body from bottom to top", "Of the box that it fills.", 0.01, 2.0),
    Question("strings_distance", "m", "distance of the two strings", "Between them, all the way up.", 0.01, 2.0),
    Question("strings_length", "m", "length of each string", "From the ceiling to the body.", 0.1, 5.0),
    Question(
        *("roll_period", "s", "time of one turn to and fro, lying"),
        *("Time ten turns of at most 10°, and divide by ten.", 0.1, 20.0),
    ),
    Question(
        *("yaw_period", "s", "time of one turn to and fro, upright"),
        *("Time ten turns of at most 10°, and divide by ten.", 0.1, 20.0),
    ),
    Question(
        *("rotor_inertia", "kg·m²", "inertia of a motor's rotor, before the gear"),
        *("Of the motor's data sheet; often in g·cm².", 1e-9, 1e-3),
    ),
    Question("motor_gear", "", "turns of the rotor for one of the wheel", "Of the data sheet.", 1.0, 500.0),
    Question(
        *("stall_torque", "N·m", "stall torque of one motor with its gear"),
        *("Of its data sheet, at your battery's voltage; 8.5 kg·cm is an answer, too.", 0.005, 150.0),
    ),
    Question("motor_voltage", "V", "voltage of the battery", "Under load, if you know it.", 1.0, 100.0),
    Question(
        *("motor_resistance", "ohm", "resistance of one motor"),
        *("With a multimeter at its terminals; the smallest value as you turn the shaft.", 0.01, 100.0),
    ),
    Question(
        *("motor_constant", "N·m/A", "torque constant of one motor, before the gear"),
        *("Of its data sheet; or voltage less R I, over rotor speed [rad/s], running without load.", 5e-4, 1.0),
    ),
)
"""Of what values are computed from."""

QUESTIONS: Mapping[str, Question] = {question.key: question for question in (*VALUES, *MEASUREMENTS)}
"""All, by key."""
