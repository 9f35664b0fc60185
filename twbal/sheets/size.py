"""Which numbers are believed without their unit, of a robot of which mass and wheels are known."""

from typing import NamedTuple

from twbal.core.robot_parameters import GRAVITY
from twbal.sheets.questions import Question, Values

_MOST_TORQUE = 16.0  # times m g r; of packaged robots the Balboa has most, 15
_USUAL_TORQUE = 0.5  # times the same; with less a robot hardly drives
_MOST_WHEEL_INERTIA = 10.0  # times m r² of the whole robot; with its geared rotors an EV3 segway has 4.5
_LEAST_GYRATION = 5e-3  # radius of gyration of a body [m]; that of a cube of 12 mm
_MOST_LENGTH = 25.0  # times the wheels' radius; of packaged robots the esp32 has the widest track, 7.4
_LEAST_BODY = 0.5  # times the mass of a wheel; of packaged robots the paper's has the lightest body, 10
_MOTORS = {"torque_limit": 1, "stall_torque": 2}  # by which the torque of both is divided
LONGEST_LEVER = 3.0
"""Most of com_height over the body's radius of gyration in pitch; of packaged robots upkie has the longest, 1.9."""
USUAL_LEVER = 0.3
"""Least of the same; of packaged robots the Tumbller has the shortest, 0.5."""
_MASSES = ("body_mass", "wheel_mass", "wheel_radius")


class Range(NamedTuple):
    """Numbers that are believed.

    Attributes:
        low: lowest, in the SI unit of the question.
        high: highest.
        usual: lowest that is thought of where another number may have had another unit.
        why: where the range comes from; empty where it is that of all robots.
    """

    low: float
    high: float
    usual: float
    why: str = ""

    def in_words(self, unit: str) -> str:
        """It in words."""
        return f"{self.low:.3g} to {self.high:.3g} {unit}".strip()


def believed_range(question: Question, known: Values) -> Range:
    """The range of a question, narrowed by the size of the robot where that is known.

    Args:
        question: of a value.
        known: values of earlier answers, in SI units.
    """
    everyone = Range(question.low, question.high, question.low)
    if question.key in _MOTORS and all(key in known for key in _MASSES):
        mass = known["body_mass"] + 2.0 * known["wheel_mass"]
        lifting = mass * GRAVITY * known["wheel_radius"] / _MOTORS[question.key]
        why = f"{question.what}: at most {_MOST_TORQUE:g} times what lifts {mass:.3g} kg at the rim of the wheels"
        return Range(question.low, min(question.high, _MOST_TORQUE * lifting), _USUAL_TORQUE * lifting, why)
    if question.key == "wheel_inertia" and all(key in known for key in _MASSES):
        mass = known["body_mass"] + 2.0 * known["wheel_mass"]
        most = _MOST_WHEEL_INERTIA * mass * known["wheel_radius"] ** 2
        why = f"{question.what}: at most as hard to turn as {_MOST_WHEEL_INERTIA * mass:.3g} kg at the wheel's rim"
        return Range(question.low, min(question.high, most), question.low, why)
    if question.key in ("track", "com_height") and "wheel_radius" in known:
        most = _MOST_LENGTH * known["wheel_radius"]
        why = f"{question.what}: at most {_MOST_LENGTH:g} times the wheels' radius of {known['wheel_radius']:.3g} m"
        least = question.low
        if question.key == "track" and known.get("wheel_width", 0.0) > least:
            least = known["wheel_width"]
            why = f"{why}, and no less than the wheels' width of {least:.3g} m, or they would touch"
        return Range(least, min(question.high, most), least, why)
    if question.key == "body_mass" and "wheel_mass" in known:
        least = max(question.low, _LEAST_BODY * known["wheel_mass"])
        why = f"{question.what}: at least {_LEAST_BODY:g} times the mass of a wheel, {known['wheel_mass']:.3g} kg"
        return Range(least, question.high, least, why)
    if question.key.startswith("body_inertia") and "body_mass" in known:
        least = known["body_mass"] * _LEAST_GYRATION**2
        why = f"{question.what}: a body of {known['body_mass']:.3g} kg that is no lump of {_LEAST_GYRATION * 1e3:g} mm"
        return Range(max(question.low, least), question.high, max(question.low, least), why)
    return everyone
