"""Numbers that were written with a decimal comma."""

import re
from typing import Any

_COMMA_NUMBER = re.compile(r"[+-]?\d+,\d+([eE][+-]?\d+)?( [^\W\d][^,]*)?")  # with or without a unit


def is_comma_number(value: Any) -> bool:
    """Whether a value is a text such as `0,9` or `0,9 kg`."""
    return isinstance(value, str) and _COMMA_NUMBER.fullmatch(value) is not None
