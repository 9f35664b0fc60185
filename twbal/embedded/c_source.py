"""Numbers and arrays as C source."""

import numpy as np

from twbal.core.errors import ConfigError
from twbal.core.gaussian import Array

_PER_LINE = 6


def real(value: float) -> str:
    """A float32 literal that reads back to the nearest float32.

    Raises:
        ConfigError: it is beyond what float32 holds.
    """
    with np.errstate(over="ignore"):
        rounded = np.float32(value)
    if not np.isfinite(rounded):
        raise ConfigError(f"{value:g} in the policy is no number of single precision, which the header computes with.")
    text = f"{rounded:.9g}"
    return f"{text}f" if set(".e") & set(text) else f"{text}.0f"


def constant_array(name: str, values: Array, size: str) -> str:
    """An array of constants in flash, and a check at compile time that it has `size` elements.

    Args:
        name: of the array.
        values: any shape; written row by row.
        size: C expression of how many there must be.
    """
    numbers = [real(float(value)) for value in np.ravel(values)]
    rows = [", ".join(numbers[at : at + _PER_LINE]) for at in range(0, len(numbers), _PER_LINE)]
    body = ",\n".join(f"    {row}" for row in rows)
    return (
        f"static const float {name}[] TWBAL_FLASH = {{\n{body}}};\n"
        f"TWBAL_ASSERT(sizeof({name}) / sizeof({name}[0]) == ({size}), {name}_has_the_right_size);\n"
    )
