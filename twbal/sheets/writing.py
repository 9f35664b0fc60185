"""The text of a new sheet, with unit and source beside each value."""

import re
from collections.abc import Mapping
from decimal import ROUND_DOWN, Decimal

from twbal.core.errors import ConfigError
from twbal.core.robot_sheet import ValueProvenance, robot_sheet
from twbal.sheets.answer import Answer
from twbal.sheets.questions import QUESTIONS

_MAKER = "by `twbal new-robot`"
_HEAD = f"""\
# {{name}}, {_MAKER}. Each comment is the unit and where the number comes from.
_target_: twbal.core.robot_sheet.robot_sheet
name: {{name}}
"""
_DIGITS = 6
_SINGLE = 6e-8  # share by which single precision rounds
_NAME = re.compile(r"[A-Za-z]\w{0,63}", re.ASCII)


def check_name(name: str) -> None:
    """Raise ConfigError where a robot, and its file, cannot be called so."""
    if not _NAME.fullmatch(name):
        raise ConfigError(
            f"A robot cannot be called {name!r}: expected are letters, digits and _, a letter first, as my_robot."
        )


def is_of_interview(text: str) -> bool:
    """Whether the text of a sheet was made by `sheet_text`: its first line says so."""
    return _MAKER in text.partition("\n")[0]


def number(value: float) -> str:
    """A number as every reader of yaml takes it for one: 1.5, 2.02e-05, 3.0e-05."""
    text = f"{value:.{_DIGITS}g}"
    mantissa, e, exponent = text.partition("e")
    return f"{mantissa}{'' if '.' in mantissa else '.0'}{e}{exponent}" if e else text


def written(value: float) -> float:
    """What is read where a number was written."""
    return float(number(value))


def written_at_most(value: float) -> float:
    """The nearest number that is written and no more than a positive one, but for what single precision rounds."""
    exact = Decimal(value * (1.0 + _SINGLE))
    digit = Decimal(1).scaleb(exact.adjusted() - _DIGITS + 1)
    return written(float(exact.quantize(digit, ROUND_DOWN)))


def sheet_text(name: str, values: Mapping[str, Answer]) -> str:
    """The text of a robot's sheet.

    Args:
        name: of the robot.
        values: all of the sheet.

    Raises:
        ConfigError: no robot can have them.
    """
    by_kind = {
        str(kind): [key for key, answer in values.items() if answer.provenance is kind] for kind in ValueProvenance
    }
    given = {kind: keys for kind, keys in by_kind.items() if keys}
    robot_sheet(name=name, provenance=given, **{key: float(number(answer.value)) for key, answer in values.items()})
    words = {key: f"{key}: {number(answer.value)}" for key, answer in values.items()}
    width = max(map(len, words.values()))
    lines = [f"{words[key]:{width}}  # {_comment(key, answer)}\n" for key, answer in values.items()]
    kinds = [f"  {kind}: [{', '.join(keys)}]\n" for kind, keys in given.items()]
    return "".join([_HEAD.format(name=name), *lines, "provenance:\n", *kinds])


def _comment(key: str, answer: Answer) -> str:
    source = " ".join(answer.source.split())
    return f"{QUESTIONS[key].unit}; {source or answer.provenance.replace('_', ' ')}"
