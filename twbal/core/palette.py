"""The few colours that the figures and the report share, each for light and for dark surroundings.

Prediction and reality are blue and vermilion (Okabe and Ito 2008), which stay apart for colour-blind eyes and in grey
print.
"""

from typing import NamedTuple


class Colour(NamedTuple):
    """One role.

    Attributes:
        name: of the role, and of its CSS variable.
        light: hexadecimal colour on a light page.
        dark: hexadecimal colour on a dark page.
    """

    name: str
    light: str
    dark: str

    @property
    def parts(self) -> tuple[float, float, float]:
        """Red, green and blue of `light`, from 0 to 1."""
        red, green, blue = (int(self.light[i : i + 2], 16) / 255 for i in (1, 3, 5))
        return red, green, blue


PAPER = Colour("paper", "#ffffff", "#15191f")
INK = Colour("ink", "#1f2630", "#e4e8ee")
MUTED = Colour("muted", "#5e6873", "#9aa5b1")
LINE = Colour("line", "#d5dae0", "#38414c")
PREDICTED = Colour("predicted", "#0072b2", "#5cb8ee")
REAL = Colour("real", "#d55e00", "#ff8f45")
GOOD = Colour("good", "#00805c", "#3fc79c")

PALETTE = (PAPER, INK, MUTED, LINE, PREDICTED, REAL, GOOD)
