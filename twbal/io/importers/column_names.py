"""What a column may be by its name: its quantity, its side, its unit; and names that stand in comments."""

import re
from collections.abc import Sequence
from typing import NamedTuple

from twbal.io.importers.column_units import SPEEDS, stated_unit
from twbal.io.importers.mapping import UNITS

DUTY = "duty cycle"
"""What a drive is given in place of a voltage: no quantity of a mapping, but one needs only be scaled."""

CURRENT, QUATERNION = "current", "quaternion"
"""What a torque and a tilt can be worked out of: no quantities of a mapping."""

COUNTING = {"count", "counts", "tick", "ticks", "pulse", "pulses"}
"""Words of columns that an encoder counts."""

_RATE = {"rate", "vel", "velocity", "speed", "dot", "omega", "rpm", "rps", "dq", "qd"}
_ANGLE = {"angle", "pos", "position", "rad", "deg", "q", *COUNTING}
_BODY = {"tilt", "pitch", "roll", "lean", "inclination"}
_YAW = {"yaw", "heading"}
_WHEEL = {"wheel", "wheels", "motor", "motors"}
_ENCODER = {"enc", "encoder", "encoders"}
_GYRO = {"gyro", "gyr", "gyroscope"}
_ACCELEROMETER = {"acc", "accel", "accelerometer", "acceleration"}
_INSTANT = {"time", "timestamp", "stamp", "clock", "millis", "micros", "elapsed"}
_TIME = {"t", "sec", "secs", "seconds", "ms", "us", "ns", *_INSTANT}
_MOTION = {*_RATE, *_BODY, *_YAW, *_WHEEL, *_ENCODER, *_GYRO, "rad", "deg"}
"""Words of columns that are no time, also where they have a word of one: that may be of a unit (`gyro_y foo/sec`)."""
_ZONES = {"utc", "gmt", "local", *("pst", "pdt", "mst", "mdt", "cst", "cdt", "est", "edt", "bst", "cet", "cest", "jst")}
_DRIVE = {"torque": "command", "tau": "command", "voltage": "voltage", "volt": "voltage", "volts": "voltage"} | {
    word: DUTY for word in ("duty", "pwm")
}
_WAY = {"dist", "distance", "odo", "odometry", "travel"}
_PLACE = {"pose", "pos", "position", "odom"}
_AXES = {"x", "y", "z"}
_CURRENT = {"current", "currents", "amps"}
_QUATERNION = {"quaternion", "quat", "orientation"}
_VAGUE = {  # a letter that books use for this and for that; a command of what it does not say
    **{"theta": "tilt", "psi": "tilt", "phi": "wheel_angle", "dtheta": "tilt_rate", "dpsi": "tilt_rate"},
    **{"theta dot": "tilt_rate", "psi dot": "tilt_rate", "phi dot": "wheel_rate"},
    **{"dphi": "wheel_rate", "u": "command", "command": "command", "cmd": "command", "control": "command"},
    **{"effort": "command", "effort command": "command", "wheel": "wheel_angle", "wheels": "wheel_angle"},
}
_OF_SIDES = {
    "rpm": "wheel_rate",
    "rps": "wheel_rate",
    "tick": "wheel_angle",
    "ticks": "wheel_angle",
    "counts": "wheel_angle",
}
_PERHAPS_OF_SIDES = {"pos": "wheel_angle", "position": "wheel_angle", "angle": "wheel_angle", "speed": "wheel_rate"} | {
    word: "wheel_rate" for word in ("vel", "velocity")
}
"""What else has a left and a right one is of the wheels; a speed may be in m/s."""
_SIDES = {"left": "left", "l": "left", "right": "right", "r": "right"}
_ELSE = {
    *("ref", "reference", "target", "setpoint", "desired", "des", "limit", "max", "min", "error", "err", "offset"),
    *("bias", "accumulated", "integral", "sum", "delay", "kp", "ki", "kd", "gain", "status", "temp", "temperature"),
    *("batt", "battery", "supply"),
}
"""Words of columns that are about a quantity and not the quantity."""
FUSED = {"complementary", "kalman", "ekf", "madgwick", "mahony", "dmp", "fused", "fusion"}
"""Words of columns that filters made of a gyro and an accelerometer."""

_FILLING = {
    *("estimated", "est", "filtered", "raw", "measured", "meas", "mean", "avg", "loop", "start", "cycle"),
    *("angular", "imu", "robot", "body", "sensor", "axle"),
    *("data", "joint", "joints", "states", "controller", "header", "linear"),
    *("euler", "rpy", "ypr", "yrp", *FUSED),
}
"""Words of columns that change nothing about their quantity."""
_GLUED = (  # words that are written as one
    (r"([a-z0-9])([A-Z])", r"\1 \2"),
    (r"(?i)\b(gyro|gyr|acc|accel)([xyz])\b", r"\1 \2"),
    (r"(?i)\bg([xyz])\b", r"gyro \1"),
    (r"(?i)\bq([wxyz])\b", r"quaternion \1"),
    (r"(?i)\b(pwm|duty|torque|enc|encoder|ticks|pos|speed|vel|rpm|rps|wheel|motor)([lr])\b", r"\1 \2"),
    (r"(?i)(wheel|motor|encoder|pitch|tilt|yaw|roll|body)(?=angle|rate|speed|vel|pos|dot|count|tick)", r"\1 "),
    (r"([A-Za-z])(\d)", r"\1 \2"),
    (r"(?i)\bper\s+(s|sec|second)\b", "rate"),
    (r"(?i)\b(counts?|ticks?|pulses?|steps)\s*/\s*(s|sec|second)\b", r"\1 rate"),
)
_NUMBERED = re.compile(r"((?:\d+\s+)+)([A-Za-z].*)")


class Meaning(NamedTuple):
    """What a name says.

    Attributes:
        quantity: of a mapping, or `DUTY`; None where the name says nothing.
        certain: whether every word of the name is understood.
        side: "left" or "right" wheel, or "".
        stem: the name without side and unit; a left and a right column of one quantity have the same.
        unit: that it states; "" without one.
    """

    quantity: str | None
    certain: bool
    side: str
    stem: tuple[str, ...]
    unit: str


def meaning_of(name: str) -> Meaning:
    """What a column's name says."""
    unit, bare = stated_unit(name)
    words = _words(bare)
    may_have_side = len(words) > 1 or (unit in UNITS["rad/s"] and words not in (["l"], ["r"]))  # `r` may be a yaw rate
    sides = [_SIDES[word] for word in words if word in _SIDES] if may_have_side else []
    stem = tuple(word for word in words if not (sides and word in _SIDES))
    if _ELSE & set(stem):
        return Meaning(None, False, "", stem, unit)
    quantity, understood = _quantity(set(stem), unit)
    if sides and (quantity is None or stem == ("angle",)):
        if not stem and unit in UNITS["rad/s"]:
            quantity = "wheel_rate"
        elif len(stem) == 1:
            quantity = _OF_SIDES.get(stem[0], _PERHAPS_OF_SIDES.get(stem[0], quantity))
            understood = set(_OF_SIDES)
    certain = not set(stem) - understood - _FILLING and len(sides) < 2
    return Meaning(quantity, certain, sides[0] if len(sides) == 1 else "", stem, unit)


def is_of_wheel_speed(meaning: Meaning) -> bool:
    """Whether a name says the speed of the wheels or of the robot, in whichever unit."""
    if meaning.quantity == "wheel_rate":
        return True
    words = set(meaning.stem)
    return meaning.unit in SPEEDS and bool(words & _RATE) and not words - _RATE - _WHEEL - _ENCODER - _FILLING


def is_axis_of_accelerometer(meaning: Meaning) -> bool:
    """Whether a name says one axis of an accelerometer: `acc_x`, `ax`."""
    words = set(meaning.stem)
    return bool(words & _ACCELEROMETER and words & _AXES) or words in ({"ax"}, {"ay"}, {"az"})


def names_in_comments(comments: Sequence[str], fields: Sequence[Sequence[str]], width: int) -> list[str]:
    """Names of columns as comments tell them, "" where they do not.

    Known forms: a line with as many words as there are columns, and lines of column numbers with names behind, such as
    `%  8  9 Motor voltage [V] left, right: 1.00 1.07`. Numbers with others between them (`10 13 ...`) may be a list or
    a range, and tell nothing.

    Args:
        comments: lines before the first row.
        fields: of each of them, without the sign that begins a comment.
        width: number of columns.
    """
    names = [""] * width
    for line in comments:
        found = _NUMBERED.fullmatch(line)
        numbers = [int(word) for word in found[1].split()] if found else []
        if found and numbers == [k for k in range(numbers[0], numbers[-1] + 1) if 1 <= k <= width]:
            for number, name in zip(numbers, _listed(found[2], len(numbers)), strict=False):
                names[number - 1] = name
    if not any(names):
        rows = [row for row in fields if len(row) == width and all(re.search("[A-Za-z]", word) for word in row)]
        names = list(rows[-1]) if rows and width > 1 else names
    return names


def _listed(text: str, count: int) -> list[str]:
    """The names in `Motor voltage [V] left, right: 1.00 1.07`; none where there are not `count`."""
    head = text.split(":")[0]
    if count == 1:
        return [re.split(r"[\d,;=]", head)[0].strip()]
    units = [unit.strip() for unit in found[1].split(",")] if (found := re.search(r"\[(.*?)\]", head)) else [""]
    first, *others = [part.strip() for part in re.sub(r"\[.*?\]", " ", head).split(",")]
    common, _, first = first.rpartition(" ")
    names = [first, *others]
    if len(names) != count or len(units) not in (1, count):
        return []
    units = units * count if len(units) == 1 else units
    return [f"{common.strip()} {name}" + f" [{unit}]" * bool(unit) for name, unit in zip(names, units, strict=True)]


def _words(name: str) -> list[str]:
    name = name.replace("_", " ")
    for glued, apart in _GLUED:
        name = re.sub(glued, apart, name)
    return [word.lower() for word in re.split(r"[^A-Za-z0-9]+", name) if word]


def _quantity(words: set[str], unit: str) -> tuple[str | None, set[str]]:
    """The quantity that the words of a name say, and those of them that were understood."""
    rate = bool(words & _RATE) or unit in UNITS["rad/s"]
    angle = bool(words & _ANGLE) or unit in UNITS["rad"]
    axis = words & _AXES
    if words - _FILLING - _WHEEL <= _CURRENT and (words & _CURRENT or (unit in ("A", "mA") and words & _WHEEL)):
        return CURRENT, _CURRENT | _WHEEL
    if words & _QUATERNION and (axis or "w" in words):
        return QUATERNION, _QUATERNION | _AXES | {"w"}
    if drive := words & set(_DRIVE):
        return _DRIVE[min(drive)], drive | _WHEEL
    if words & _WHEEL and unit in UNITS["V"]:
        return "voltage", _WHEEL
    if words & _INSTANT and words & _MOTION:
        return None, set()  # when a sensor was read, or how long a motion took
    if words & _TIME and not words & _MOTION:
        return "time", _TIME | _ZONES
    if (words & _GYRO and not words & _ANGLE) or ("angular" in words and axis and rate and not words & _WHEEL):
        return ("yaw_rate" if words & _YAW or "z" in axis else "tilt_rate"), _GYRO | _RATE | _BODY | _YAW | _AXES
    if words & _ACCELEROMETER and (angle or words & _BODY) and not rate:
        return "tilt", _BODY | _ANGLE  # by the direction of gravity alone: not certain
    if words & _ACCELEROMETER:
        return "acceleration", {"acceleration", "forward", "platform"}  # of an IMU it has gravity in it: not certain
    if words & (_WHEEL | _ENCODER) and (rate or angle or words & _ENCODER):
        return ("wheel_rate" if rate else "wheel_angle"), _WHEEL | _ENCODER | _RATE | _ANGLE
    if words & _YAW:
        return ("yaw_rate" if rate else "heading"), _YAW | _RATE | _ANGLE | _PLACE
    if words & (_BODY | _GYRO) or words - _FILLING - _RATE == {"angle"}:
        return ("tilt_rate" if rate else "tilt"), _BODY | _GYRO | _RATE | _ANGLE | _PLACE
    if words & _WAY:
        return "distance", _WAY | _WHEEL
    if len(axis) == 1 and axis <= {"x", "y"} and words <= _AXES | _PLACE:
        return axis.pop(), _AXES | _PLACE
    if words - _PLACE == {"h"}:
        return "heading", {"h"} | _PLACE
    rest = words - _FILLING
    return _VAGUE.get(" ".join(sorted(rest - _WHEEL or rest, reverse=True))), set()
