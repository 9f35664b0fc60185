"""Draw the pictures of docs/new_robot.md: `python scripts/new_robot_pictures.py`."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon, Rectangle

from twbal.core.palette import INK, LINE, MUTED
from twbal.viz.canvas import save, styled

FOLDER = Path(__file__).resolve().parent.parent / "docs" / "pictures" / "new_robot"
_BODY, _EDGE, _FAINT, _MARK = LINE.light, INK.light, MUTED.light, "#d55e00"


def balanced(axes: Axes) -> None:
    """The body without wheels, on an edge: where it balances is its centre of mass."""
    axes.add_patch(Rectangle((-0.9, 0.0), 2.2, 0.7, facecolor=_BODY, edgecolor=_EDGE))
    axes.add_patch(Polygon([(0, 0), (-0.18, -0.5), (0.18, -0.5)], facecolor=_FAINT))
    axes.plot([-1.6, 1.8], [-0.5, -0.5], color=_FAINT)
    axes.add_patch(Circle((-0.7, 0.35), 0.07, facecolor=_EDGE))
    axes.annotate("axle", (-0.7, 0.35), (-1.5, 0.9), arrowprops={"arrowstyle": "-", "color": _FAINT})
    axes.plot([0], [0.35], "o", color=_MARK)
    _length(axes, (-0.7, 0.95), (0.0, 0.95), "com_height")
    axes.text(0.25, -0.4, "edge of a ruler", color=_FAINT)


def swinging(axes: Axes) -> None:
    """The body hangs below its axle, whose ends lie on two supports, and swings."""
    turned = [(_turn(x, y, 0.25)) for x, y in ((-0.35, 0.25), (0.35, 0.25), (0.35, -1.6), (-0.35, -1.6))]
    axes.add_patch(Polygon(turned, facecolor=_BODY, edgecolor=_EDGE))
    axes.plot([0, 0], [0, -1.9], ":", color=_FAINT)
    axes.add_patch(Circle((0, 0), 0.07, facecolor=_EDGE))
    axes.plot([-0.9, -0.1], [-0.09, -0.09], color=_FAINT, linewidth=4)
    axes.plot([0.1, 0.9], [-0.09, -0.09], color=_FAINT, linewidth=4)
    mass = _turn(0.0, -0.9, 0.25)
    axes.plot(*mass, "o", color=_MARK)
    _length(axes, (0.0, 0.0), mass, "")
    axes.text(mass[0] + 0.45, mass[1] + 0.2, "com_height", color=_MARK)
    arc = np.linspace(-0.25, 0.25, 30)
    axes.plot(1.95 * np.sin(arc), -1.95 * np.cos(arc), color=_EDGE)
    axes.text(0, -2.25, "there and back: swing_period", ha="center")
    axes.text(1.0, -0.14, "supports of the axle", color=_FAINT)


def on_strings(axes: Axes) -> None:
    """The body on two parallel strings turns to and fro about the vertical through its centre of mass."""
    axes.plot([-1.1, 1.1], [1.6, 1.6], color=_FAINT, linewidth=4)
    for side in (-0.6, 0.6):
        axes.plot([side, side], [1.6, 0.0], color=_EDGE)
    axes.add_patch(Rectangle((-0.8, -0.9), 1.6, 0.9, facecolor=_BODY, edgecolor=_EDGE))
    axes.plot([0], [-0.45], "o", color=_MARK)
    axes.plot([0, 0], [1.3, -1.1], ":", color=_FAINT)
    _length(axes, (1.0, 0.0), (1.0, 1.6), "")
    axes.text(1.08, 0.75, "strings_length", color=_MARK)
    _length(axes, (-0.6, 1.2), (0.6, 1.2), "")
    axes.text(-0.7, 1.15, "strings_distance", ha="right", color=_MARK)
    turn = np.linspace(-2.6, -0.5, 30)
    axes.plot(0.7 * np.cos(turn), -1.05 + 0.2 * np.sin(turn), color=_EDGE)
    axes.text(0, -1.6, "to and fro: yaw_period, roll_period", ha="center")


def ten_turns(axes: Axes) -> None:
    """The robot is pushed until a mark on the tyre is down again for the tenth time."""
    axes.plot([-0.9, 4.4], [0, 0], color=_FAINT)
    for x in (0.0, 3.5):
        axes.add_patch(Circle((x, 0.5), 0.5, facecolor="none", edgecolor=_EDGE))
        axes.add_patch(Rectangle((x - 0.2, 0.5), 0.4, 1.1, facecolor=_BODY, edgecolor=_EDGE))
        axes.plot([x], [0.04], "o", color=_MARK)
    axes.annotate("", (2.6, 0.9), (0.9, 0.9), arrowprops={"arrowstyle": "->", "color": _FAINT})
    axes.text(1.75, 1.0, "ten turns", ha="center", color=_FAINT)
    _length(axes, (0.0, -0.25), (3.5, -0.25), "")
    axes.text(1.75, -0.6, "ten_turns_distance", ha="center", color=_MARK)


PICTURES: Mapping[str, Callable[[Axes], None]] = {
    "centre_of_mass": balanced,
    "swing": swinging,
    "strings": on_strings,
    "ten_turns": ten_turns,
}
"""By the names of their files."""


@styled
def picture(draw: Callable[[Axes], None]) -> Figure:
    """A drawing without axes, to scale in itself."""
    figure = Figure(figsize=(4.2, 3.0))
    axes = figure.add_subplot()
    draw(axes)
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.margins(0.08)
    axes.axis("off")
    return figure


def _turn(x: float, y: float, angle: float) -> tuple[float, float]:
    return float(x * np.cos(angle) - y * np.sin(angle)), float(x * np.sin(angle) + y * np.cos(angle))


def _length(axes: Axes, start: tuple[float, float], end: tuple[float, float], name: str) -> None:
    """A length between two points, with its name above."""
    arrow = {"arrowstyle": "<->", "color": _MARK, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", end, start, arrowprops=arrow, annotation_clip=False)
    axes.update_datalim([start, end])
    if name:
        axes.text((start[0] + end[0]) / 2, start[1] + 0.08, name, ha="center", color=_MARK)


if __name__ == "__main__":
    for name, draw in PICTURES.items():
        save(picture(draw), FOLDER / f"{name}.svg")
