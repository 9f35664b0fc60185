"""Tables and counts in plain text."""

from collections.abc import Sequence


def aligned(rows: Sequence[Sequence[str]], right: bool = False) -> list[str]:
    """Lines with the cells of each column under each other, to the left or to the right of it."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    to_width = str.rjust if right else str.ljust
    return ["  ".join(map(to_width, row, widths)).rstrip() for row in rows]


def counted(number: int, thing: str) -> str:
    """`1 update`, `2 updates`."""
    return f"{number} {thing}" if number == 1 else f"{number} {thing}s"
