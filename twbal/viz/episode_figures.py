"""What a robot did over time: every channel of an episode, and what a simulation made of the same commands."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from twbal.core.channels import MEASURED_UNITS
from twbal.core.episode import Episode
from twbal.core.gaussian import Array
from twbal.core.palette import MUTED, PREDICTED, REAL
from twbal.core.plant import Observation
from twbal.viz.canvas import label, legend, limits, notes_above, panels, short, shown, styled

_UNITS = {**MEASURED_UNITS, "wheel_angle": "rad", "wheel_rate": "rad/s", "command": "N·m"}
_CHANNELS = ("tilt", "tilt_rate", "wheel_angle", "wheel_rate", "acceleration", "command")
_ROOM = 0.6  # of the range of what was measured, left above and below it for the simulation
_MOST_POINTS = 1500  # of a line; more are drawn as the band between their least and their most


class Stretch(NamedTuple):
    """A piece of a simulated course.

    Attributes:
        time: (k,) [s].
        observations: (k, 7) in the order of `Observation`.
    """

    time: Array
    observations: Array


@styled
def courses_figure(episode: Episode, title: str, simulated: Sequence[Stretch] = ()) -> Figure:
    """Draw each channel over time; channels that no sensor measured are drawn in grey.

    The axes are those of what was measured. Where the simulation goes far beyond it, a note over the panel says how
    far.

    Args:
        episode: what was measured.
        title: over the figure.
        simulated: pieces to draw beside it.
    """
    figure, axes = panels(len(_CHANNELS), columns=2, width=5.4, height=2.0)
    estimated = {e.channel for e in episode.estimated}
    time = episode.observations[:, 0]
    notes = [""] * len(axes)
    for place, (panel, name) in enumerate(zip(axes, _CHANNELS, strict=True)):
        factor, unit = shown(_UNITS[name])
        values = _column(episode, name)
        colour = MUTED.light if name in estimated else REAL.light
        _line(panel, time[: len(values)], factor * values, colour, "worked out" if name in estimated else "measured")
        for number, piece in enumerate(simulated):
            if name != "command":
                column = factor * _simulated_column(piece, name)
                told = None if number else _simulated(simulated)
                panel.plot(piece.time, column, _mark(column), color=PREDICTED.light, linewidth=1.1, label=told)
        panel.set_ylabel(label(name, unit))
        panel.set_xlabel("time [s]")
        panel.margins(x=0)
        if name in estimated:
            panel.set_title("estimated, not measured", color=MUTED.light)
        if simulated and name != "command":
            every = np.concatenate([_simulated_column(piece, name) for piece in simulated])
            notes[place] = _fit(panel, factor * values, factor * every)
    notes_above(axes, notes, PREDICTED.light)
    figure.suptitle(title)
    if simulated:
        legend(figure, *axes)
    return figure


def _fit(axes: Axes, values: Array, simulated: Array) -> str:
    """Set the range of an axis: a simulated robot that falls would make a line of one that stands.

    Returns how far the simulation goes, where that is beyond the axis.
    """
    bottom, top = limits(values, simulated, _ROOM)
    axes.set_ylim(bottom, top)
    if not (simulated.min() < bottom or simulated.max() > top):
        return ""
    for drawn in (*axes.get_lines()[:1], *axes.collections):  # what was measured, over what hides it
        drawn.set_zorder(3.0)
    return f"simulated: {short(simulated.min())} to {short(simulated.max())}"


def _mark(values: Array) -> str:
    """Form of a line, of which a single point would be nothing."""
    return "o" if len(values) == 1 else "-"


def _simulated_column(piece: Stretch, name: str) -> Array:
    """One quantity of a piece; a tilt that turns over goes on and does not jump from 180 to -180 degrees."""
    column: Array = piece.observations[:, Observation._fields.index(name)]
    return np.unwrap(column) if name == "tilt" else column


def _simulated(pieces: Sequence[Stretch]) -> str:
    """What the simulated lines are."""
    if len(pieces) == 1:
        return "simulated"
    every = float(pieces[1].time[0] - pieces[0].time[0])
    return f"simulated under the same commands, put back onto the measured motion every {every:.3g} s"


def _column(episode: Episode, name: str) -> Array:
    return episode.commands if name == "command" else episode.observations[:, Observation._fields.index(name)]


def _line(axes: Axes, time: Array, values: Array, colour: str, name: str) -> None:
    every = len(values) // _MOST_POINTS
    if every < 2:
        axes.plot(time, values, _mark(values), color=colour, linewidth=1.2, label=name)
        return
    rows = len(values) // every * every
    parts = values[:rows].reshape(-1, every)
    axes.fill_between(time[:rows:every], parts.min(axis=1), parts.max(axis=1), color=colour, linewidth=0.5, label=name)
