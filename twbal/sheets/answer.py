"""Answers to the questions of a sheet: `1090 g measured; kitchen scale`, or the name of a way to compute it."""

from typing import NamedTuple

from twbal.core.errors import ConfigError
from twbal.core.robot_sheet import Provenance
from twbal.sheets.questions import QUESTIONS, Question, Values, Way
from twbal.sheets.units import meant, quantity


class Answer(NamedTuple):
    """What an answer comes to.

    Attributes:
        value: in the SI unit of its question.
        provenance: where it comes from.
        source: the same in words; may be empty.
    """

    value: float
    provenance: Provenance
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
        return _given(question, text)
    value = way.compute(known)
    used = {key: f"{known[key]:.6g}" for key in way.needs}
    return Answer(_believed(question, value, f"{value:.6g}", True), way.provenance, way.source.format(**used))


def _given(question: Question, text: str) -> Answer:
    said, _, source = text.partition(";")
    number, provenance = _without_provenance(said.strip().replace("data sheet", Provenance.DATA_SHEET))
    try:
        value, has_unit = quantity(number, question.unit)
    except ConfigError as error:
        ways = ", ".join(way.name for way in question.ways)
        raise ConfigError(f"{question.key}: {error}" + (f" Or compute it: {ways}." if ways else "")) from error
    return Answer(_believed(question, value, number, has_unit), provenance or question.provenance, source.strip())


def _without_provenance(said: str) -> tuple[str, Provenance | None]:
    """An answer without the word at its end that says where it comes from, and that word."""
    number, _, last = said.rpartition(" ")
    return (number, Provenance(last.lower())) if last.lower() in list(Provenance) else (said, None)


def _believed(question: Question, value: float, text: str, has_unit: bool) -> float:
    """The value; a number of another unit is a slip that is told, unless its unit stands beside it."""
    key, unit = question.key, question.unit
    if question.low >= 0.0 and not value > 0.0:
        raise ConfigError(f"{key} must be more than 0 {unit}; found {value:.6g}. It is {question.what}.")
    if has_unit or question.low <= value <= question.high:
        return value
    expected = f"{question.low:g} to {question.high:g} {unit}".strip()
    others = meant(value, unit, question.low, question.high)
    slip = f" Is it in {others[0]}? Then write `{text} {others[0]}`." if others else ""
    insist = f" If it is right, write `{text} {unit}`." if unit else ""
    found = f"{key} is {value:.6g} {unit}".strip()
    raise ConfigError(f"{found}; expected {expected} ({question.what}).{slip}{insist}")


def question_of(key: str) -> Question:
    """The question of an answer.

    Raises:
        ConfigError: there is none.
    """
    if key not in QUESTIONS:
        raise ConfigError(f"There is no question {key[:40]!r}. The questions are: {', '.join(QUESTIONS)}.")
    return QUESTIONS[key]
