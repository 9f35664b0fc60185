"""Answers to the questions of a sheet: `1090 g measured; kitchen scale`, or the name of a way to compute it."""

from typing import NamedTuple

from twbal.core.errors import ConfigError
from twbal.core.robot_sheet import ValueProvenance
from twbal.sheets.questions import QUESTIONS, Question, Values, Way
from twbal.sheets.size import LONGEST_LEVER, USUAL_LEVER, believed_range
from twbal.sheets.units import UNITS, meant, quantity

_OTHER_AXES = 0.1, 10.0  # inertias in roll and yaw over that in pitch, at most


class Answer(NamedTuple):
    """What an answer comes to.

    Attributes:
        value: in the SI unit of its question.
        provenance: where it comes from.
        source: the same in words; may be empty.
    """

    value: float
    provenance: ValueProvenance
    source: str = ""


def way_of(question: Question, text: str) -> Way | None:
    """The way to compute it that an answer names; None where it names none."""
    return next((way for way in question.ways if way.name == text.strip()), None)


def needed(way: Way, known: Values) -> list[str]:
    """Questions that must be answered before a value can be computed in a way."""
    return [key for key in way.needs if key not in known]


def answered(question: Question, text: str, known: Values) -> Answer:
    """What an answer comes to.

    Args:
        question: that it answers.
        text: the answer.
        known: values of earlier answers.

    Raises:
        ConfigError: it is neither a number in a unit of the question nor a way to compute one, or a number that is
            hardly meant; the message says what to answer instead.
    """
    way = way_of(question, text)
    if way is None:
        return _given(question, text, known)
    value = way.compute(known)
    used = {key: f"{known[key]:.6g}" for key in way.needs}
    _check_computed(question, way, value, known)
    return Answer(value, way.provenance, way.source.format(**used))


def _given(question: Question, text: str, known: Values) -> Answer:
    said, _, source = text.partition(";")
    number, provenance = _without_provenance(said.strip().replace("data sheet", ValueProvenance.DATA_SHEET))
    try:
        value, has_unit = quantity(number, question.unit)
    except ConfigError as error:
        ways = ", ".join(way.name for way in question.ways)
        raise ConfigError(f"{question.key}: {error}" + (f" Or compute it: {ways}." if ways else "")) from error
    _check_sign(question, value)
    if not has_unit:
        _check_unit(question, value, number, known)
    return Answer(value, provenance or question.provenance, source.strip())


def _without_provenance(said: str) -> tuple[str, ValueProvenance | None]:
    """An answer without the word at its end that says where it comes from, and that word."""
    number, _, last = said.rpartition(" ")
    return (number, ValueProvenance(last.lower())) if last.lower() in list(ValueProvenance) else (said, None)


def _check_sign(question: Question, value: float) -> None:
    key, unit = question.key, question.unit
    if question.low >= 0.0 and not value > 0.0:
        raise ConfigError(f"{key} must be more than 0 {unit}; found {value:.6g}. It is {question.what}.")


def _check_unit(question: Question, value: float, text: str, known: Values) -> None:
    """Raise ConfigError where a number without a unit is beyond what is expected: a slip of the unit, as a rule."""
    key, unit, expected = question.key, question.unit, believed_range(question, known)
    if expected.low <= value <= expected.high:
        return
    others = _of_a_body(question, value, meant(value, unit, expected.usual, expected.high), known)
    slip = f" Is it in {others[0]}? Then write `{text} {others[0].replace('·', ' ')}`." if others else ""
    insist = f" If it is right, write `{text} {unit.replace('·', ' ')}`." if unit else ""
    found = f"{key} is {value:.6g} {unit}".strip()
    raise ConfigError(f"{found}; expected {expected.in_words(unit)} ({expected.why or question.what}).{slip}{insist}")


def _of_a_body(question: Question, value: float, units: list[str], known: Values) -> list[str]:
    """Units of an inertia of a body, those first in which it belongs to the body's mass and centre of mass, or pitch.

    Args:
        question: that a number without unit answers.
        value: the number.
        units: that it may have.
        known: values of earlier answers.
    """
    if not question.key.startswith("body_inertia") or not {"body_mass", "com_height"} <= known.keys():
        return units
    if question.key != "body_inertia_pitch" and "body_inertia_pitch" in known:
        low, high = (factor * known["body_inertia_pitch"] for factor in _OTHER_AXES)
    else:
        low, high = (known["body_mass"] * (known["com_height"] / lever) ** 2 for lever in (LONGEST_LEVER, USUAL_LEVER))
    return sorted(units, key=lambda name: not low <= value * UNITS[question.unit][name] <= high)


def _check_computed(question: Question, way: Way, value: float, known: Values) -> None:
    """Raise ConfigError where a value cannot be, or where it is beyond what a robot of this size has.

    A way that only takes a quantity of the same unit is believed, as that was asked for with its unit.
    """
    _check_sign(question, value)
    expected = believed_range(question, known)
    if not expected.why or any(QUESTIONS[key].unit == question.unit for key in way.needs):
        return
    if not expected.low <= value <= expected.high:
        unit = question.unit
        raise ConfigError(
            f"{question.key} comes to {value:.4g} {unit} by {way.name}; expected {expected.in_words(unit)} "
            f"({expected.why}). Are the units of {', '.join(way.needs)} right? If it is right, answer "
            f"{question.key} by `{value:.4g} {unit.replace('·', ' ')}`."
        )


def question_of(key: str) -> Question:
    """The question of an answer.

    Raises:
        ConfigError: there is none.
    """
    if key not in QUESTIONS:
        raise ConfigError(f"There is no question {key[:40]!r}. The questions are: {', '.join(QUESTIONS)}.")
    return QUESTIONS[key]
