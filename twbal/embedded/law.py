"""What the header, its check and its estimate need to know of a policy's law."""

from typing import NamedTuple

from twbal.core.gaussian import Array

UNIT = 2.0**-24
"""Largest relative error of one operation in single precision."""


class Operations(NamedTuple):
    """Operations of single precision in one call of a law.

    Attributes:
        add: sums, differences and comparisons.
        multiply: products.
        divide: quotients.
        read: constants read from flash.
        exp, sin, asin, tanh: calls of functions.
    """

    add: int = 0
    multiply: int = 0
    divide: int = 0
    read: int = 0
    exp: int = 0
    sin: int = 0
    asin: int = 0
    tanh: int = 0


class Law(NamedTuple):
    """A policy's law as C.

    Attributes:
        formula: what it computes, for the comment at the top.
        constants: definitions.
        body: statements that take `float x[TWBAL_POLICY_CHANNELS]` and return the command.
        helpers: functions that the statements call.
        numbers: float32 constants.
        scratch: floats on the stack.
        operations: of one call.
    """

    formula: str
    constants: str
    body: str
    helpers: str
    numbers: int
    scratch: int
    operations: Operations


class Rounding(NamedTuple):
    """A command in double precision, and how far the same law in single precision may be off.

    Attributes:
        command: (n,) [N·m].
        bound: (n,) [N·m].
    """

    command: Array
    bound: Array
