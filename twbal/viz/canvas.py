"""What the figures have in common: their style, their panels, and files that are the same byte for byte."""

import io
import re
from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from pathlib import Path
from typing import Any, Literal, ParamSpec

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.legend_handler import HandlerTuple
from matplotlib.ticker import MaxNLocator, NullLocator

from twbal.core.errors import ConfigError
from twbal.core.files import write_atomically
from twbal.core.gaussian import Array
from twbal.core.palette import INK, LINE, MUTED, PAPER, REAL

STYLE: Any = {  # Any: matplotlib's own type for this lists every setting of one version
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],  # comes with matplotlib: the same figure on every machine
    "font.size": 10,
    "text.color": INK.light,
    "axes.axisbelow": True,
    "axes.edgecolor": MUTED.light,
    "axes.facecolor": PAPER.light,
    "axes.grid": True,
    "axes.labelcolor": INK.light,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 10.5,
    "axes.titlepad": 8,
    "axes.titleweight": "bold",
    "figure.constrained_layout.h_pad": 0.09,
    "figure.constrained_layout.use": True,
    "figure.constrained_layout.w_pad": 0.09,
    "figure.facecolor": PAPER.light,
    "figure.titlesize": 12,
    "figure.titleweight": "bold",
    "grid.color": LINE.light,
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "lines.linewidth": 1.6,
    "lines.solid_capstyle": "round",
    "savefig.facecolor": PAPER.light,
    "svg.fonttype": "none",  # text stays text: it can be searched, read aloud and recoloured
    "svg.hashsalt": "twbal",  # without it the ids in an SVG are random
    "text.parse_math": False,  # names of robots and files may have dollar signs
    "xtick.color": MUTED.light,
    "ytick.color": MUTED.light,
}

# Matplotlib writes paths to a millionth of a point; a hundredth halves the file and cannot be seen.
_PATH = re.compile(r' d="[^"]*"')
_SURPLUS_DIGITS = re.compile(r"(\.\d\d)\d+")
_LEGEND_SHARE = 0.95  # of the figure's width that a legend may take: fonts differ where an SVG is shown
_LOG_STEPS = ((1.0,), (1.0, 3.0), (1.0, 2.0, 5.0), tuple(range(1, 10)))  # ticks of a decade, the fewest first
_FEWEST_TICKS = 3
_ROUNDING = 1e-9  # of the largest value of a course; what varies by less is constant
_NOTE = (4, 20)  # points above a panel at which a note begins, and the title over it
_DEGREES = {"rad": "°", "rad/s": "°/s"}
_PAST_COMMANDS = {"command_1": "last command", "command_2": "2nd last command"}
_PAST_COMMANDS |= {f"command_{k}": f"{k}th last command" for k in range(4, 10)} | {"command_3": "3rd last command"}

P = ParamSpec("P")


def styled(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """Make `draw` see the style of these figures, and leave that of the caller alone."""

    @wraps(draw)
    def in_style(*args: P.args, **kwargs: P.kwargs) -> Figure:
        with matplotlib.rc_context(STYLE):
            return draw(*args, **kwargs)

    return in_style


def panels(count: int, columns: int, width: float, height: float) -> tuple[Figure, list[Axes]]:
    """A figure of `count` panels in rows of at most `columns`.

    Args:
        count: number of panels, at least one.
        columns: the most panels in a row.
        width: of one panel [inch].
        height: of one panel [inch].
    """
    across = min(count, columns)
    rows = -(-count // across)
    figure = Figure(figsize=(width * across, height * rows + 0.4))
    return figure, [figure.add_subplot(rows, across, i + 1) for i in range(count)]


def shown(unit: str) -> tuple[float, str]:
    """Factor and unit in which a quantity is drawn: angles in degrees, all else in SI."""
    return (float(np.degrees(1.0)), _DEGREES[unit]) if unit in _DEGREES else (1.0, unit)


def in_words(name: str) -> str:
    """Name of a channel as people read it: `tilt_rate` -> `tilt rate`, `command_1` -> `last command`."""
    return _PAST_COMMANDS.get(name) or name.replace("_", " ")


def label(name: str, unit: str) -> str:
    """Axis label of a channel: `tilt_rate`, `rad/s` -> `tilt rate [rad/s]`."""
    return f"{in_words(name)} [{unit}]"


def short(value: float) -> str:
    """A number with two digits at least, and without an exponent."""
    return f"{value:.2g}" if abs(value) < 10.0 else f"{value:.0f}"


def logarithmic(axes: Axes, which: Literal["x", "y"]) -> None:
    """Make an axis of what was drawn logarithmic, with ticks that are plain numbers: 0.5 and not 5 × 10⁻¹.

    Where nothing was drawn, as no value is finite and positive, the panel says so.
    """
    axis = axes.xaxis if which == "x" else axes.yaxis
    if not np.isfinite(axis.get_minpos()):
        text = axes.annotate("no finite values above 0", (0.5, 0.5), xycoords="axes fraction")
        text.set(ha="center", va="center", color=MUTED.light)
        text.set_bbox({"facecolor": PAPER.light, "linewidth": 0.0})  # over a line of zeros
        axis.set_ticks([])
        return
    axes.set(**{f"{which}scale": "log"})
    low, high = axis.get_view_interval()
    decades = 10.0 ** np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1)
    for steps in _LOG_STEPS:
        ticks = np.outer(decades, steps).ravel()
        ticks = ticks[(low <= ticks) & (ticks <= high)]
        if len(ticks) >= _FEWEST_TICKS:
            break
    else:
        ticks = np.asarray(MaxNLocator(4).tick_values(low, high))
        ticks = ticks[(low <= ticks) & (ticks <= high)]
    axis.set_ticks(ticks.tolist(), labels=[f"{tick:.6g}" for tick in ticks])
    axis.set_minor_locator(NullLocator())


def aslant(axes: Axes) -> None:
    """Turn the labels below `axes`, which are too long to stand side by side."""
    for text in axes.get_xticklabels():
        text.set(rotation=45, ha="right", rotation_mode="anchor")


def over_horizons(axes: Axes, channel: str, unit: str) -> None:
    """Name axes on which the error of a channel [unit] stands over the time that was predicted ahead [ms]."""
    logarithmic(axes, "y")  # errors near the noise are far below those of the data sheet
    axes.set_xlim(left=0)
    axes.set_xlabel("horizon [ms]")
    axes.set_ylabel(label(f"error of {channel}", unit))
    axes.set_title(channel.replace("_", " "))


def legend(figure: Figure, *axes: Axes, named: Mapping[str, Artist | tuple[Artist, ...]] | None = None) -> None:
    """Put the legend of `axes` below all panels, where it hides no data, in as few rows as fit its width.

    What several of them have, by its name, is in it once.

    Args:
        figure: to which the legend is added.
        axes: whose labelled drawings are in it.
        named: what comes first, by name; several drawings of one name stand side by side. Names that people gave belong
            here, as matplotlib leaves out of `axes` what has a label with a leading underscore.
    """
    found: dict[str, Artist | tuple[Artist, ...]] = dict(named or {})
    for panel in axes:
        for handle, name in zip(*panel.get_legend_handles_labels(), strict=True):
            found.setdefault(name, handle)
    handles: list[Any] = list(found.values())  # Any: matplotlib's own type for this has no tuples
    names = list(found)
    for columns in range(len(names), 0, -1):
        placed = figure.legend(
            handles,
            names,
            loc="outside lower center",
            ncols=columns,
            handler_map={tuple: HandlerTuple(ndivide=None)},
        )
        if columns == 1 or placed.get_window_extent().width <= _LEGEND_SHARE * figure.bbox.width:
            return
        placed.remove()


def notes_above(axes: Sequence[Axes], notes: Sequence[str], colour: str) -> None:
    """Write a small note over each panel that has one, and move the titles above the notes.

    A note has a line of its own, so that it overlaps no title, however long both are.

    Args:
        axes: panels of one figure, with their titles.
        notes: one for each; "" for none.
        colour: of the notes.
    """
    if not any(notes):
        return
    begin, title = _NOTE
    for panel, note in zip(axes, notes, strict=True):
        panel.set_title(panel.get_title("left"), pad=title)
        if note:
            text = panel.annotate(note, (0.0, 1.0), (0, begin), xycoords="axes fraction", textcoords="offset points")
            text.set(va="bottom", fontsize=8, color=colour)


def ended_at(axes: Axes, time: float, value: float) -> None:
    """Draw the cross in which the course of a trial ends that ends early."""
    axes.plot(
        *([time], [value], "x"),
        color=REAL.light,
        markersize=6.5,
        markeredgewidth=1.9,
        linestyle="none",
        label="trial ends early",
    )


def limits(seen: Array, others: Array, room: float) -> tuple[float, float]:
    """Range of an axis: all that was seen, and of the others what does not dwarf it.

    Where what was seen is constant, it has no range that could be dwarfed, and all others are in range.

    Args:
        seen: what the robot did; where it is empty, all others are in range.
        others: what a model or a simulation says.
        room: share of the range of `seen` that is left for the others above and below it.
    """
    seen, others = (values[np.isfinite(values)] for values in (seen, others))
    every = np.concatenate([seen, others])
    if not len(every):
        return -1.0, 1.0
    bottom, top = float(every.min()), float(every.max())
    least, most = (float(seen.min()), float(seen.max())) if len(seen) else (0.0, 0.0)
    if most - least > _ROUNDING * max(abs(least), abs(most)):
        spare = room * (most - least)
        bottom, top = max(bottom, least - spare), min(top, most + spare)
    margin = 0.06 * (top - bottom) or 0.06 * abs(top) or 1.0
    return bottom - margin, top + margin


def svg(figure: Figure) -> str:
    """The figure as SVG text; the same figure gives the same text.

    The canvas is asked itself, as `savefig` draws everything once more before it writes, a third of the time.
    """
    page = io.StringIO()
    with matplotlib.rc_context(STYLE):
        canvas = FigureCanvasSVG(figure)
        canvas.print_svg(page, metadata={"Date": None, "Creator": None})  # type: ignore[no-untyped-call]
    return _PATH.sub(lambda path: _SURPLUS_DIGITS.sub(r"\1", path[0]), page.getvalue())


def save(figure: Figure, path: Path, dots_per_inch: float = 160) -> None:
    """Write the figure as `.svg` or `.png`, by the ending of `path`.

    Raises:
        ConfigError: the path ends in something else.
        DataError: the file cannot be written.
    """
    if path.suffix == ".svg":
        write_atomically(path, svg(figure))
    elif path.suffix == ".png":
        pixels = io.BytesIO()
        with matplotlib.rc_context(STYLE):
            figure.savefig(pixels, format="png", dpi=dots_per_inch, metadata={"Software": None})
        write_atomically(path, pixels.getvalue())
    else:
        raise ConfigError(f"A figure is written as .svg or .png; found {path.name!r}.")
