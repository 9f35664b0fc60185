"""Values of a whole sheet that are hardly meant: as a rule a slip of the unit or of the decimal point."""

from math import sqrt

from twbal.core.robot_parameters import RobotParameters
from twbal.sheets.questions import VALUES, Question, Values
from twbal.sheets.size import LONGEST_LEVER, USUAL_LEVER, Range, believed_range
from twbal.sheets.units import meant

_SELDOM_MEANT = ("in", "mrad")


def doubts(robot: RobotParameters) -> list[str]:
    """A sentence on each value that is beyond what a robot of this size has; none where all are believed.

    A value that is doubted says nothing of what the others may be.

    Args:
        robot: its sheet.
    """
    known = {question.key: float(getattr(robot, question.key)) for question in VALUES}
    found = []
    for question in VALUES:
        value, expected = known[question.key], _expected(question, known)
        if not expected.low <= value <= expected.high:
            found.append(_doubt(robot.name, question, value, expected))
            del known[question.key]
    return found


def _expected(question: Question, known: Values) -> Range:
    """What is believed of a value beside the others."""
    expected = believed_range(question, known)
    if question.key != "com_height" or not {"body_mass", "body_inertia_pitch"} <= known.keys():
        return expected
    gyration = sqrt(known["body_inertia_pitch"] / known["body_mass"])
    longest = LONGEST_LEVER * gyration
    if longest >= expected.high:
        return expected
    why = (
        f"{question.what}: at most {LONGEST_LEVER:g} times the body's radius of gyration of {gyration:.3g} m, by "
        "body_mass and body_inertia_pitch, of which one may be wrong instead"
    )
    return Range(expected.low, longest, max(expected.low, USUAL_LEVER * gyration), why)


def _doubt(name: str, question: Question, value: float, expected: Range) -> str:
    key, unit = question.key, question.unit
    others = [other for other in meant(value, unit, expected.usual, expected.high) if other not in _SELDOM_MEANT]
    slip = f"Is it in {others[0]}?" if others else "Is its decimal point right?"
    found = f"{key} of robot {name!r} is {value:.6g} {unit}"
    return f"{found}; expected {expected.in_words(unit)} ({expected.why or question.what}). {slip}"
