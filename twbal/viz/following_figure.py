"""How a robot followed its reference: place and speed of both over time."""

import numpy as np
from matplotlib.figure import Figure

from twbal.core.channels import Channels
from twbal.core.episode import Episode
from twbal.core.heading import HeadingSample
from twbal.core.palette import INK, REAL
from twbal.core.plant import Observation
from twbal.viz.canvas import legend, panels, styled


@styled
def following_figure(episode: Episode, title: str, wheel_radius: float) -> Figure:
    """Draw place, speed and tilt of the robot over time, and its heading where that was controlled, with references.

    Args:
        episode: that has a reference.
        title: over the figure.
        wheel_radius: of the data sheet [m].
    """
    assert episode.references is not None
    seen = Observation(*episode.observations.T)
    channels = Channels(("speed",), wheel_radius)
    path = channels.path(seen)
    measured = path - path[0], channels.measured_values(seen)["speed"]
    headings = None if episode.headings is None else HeadingSample(*np.degrees(episode.headings.T))
    figure, axes = panels(3 if headings is None else 4, columns=1, width=9.0, height=2.0)
    for panel, values, asked, name in zip(
        axes, measured, episode.references.T, ("place [m]", "speed [m/s]"), strict=False
    ):
        panel.plot(seen.time, values, color=REAL.light, linewidth=1.2, label="robot, by its wheels")
        panel.plot(seen.time, asked, color=INK.light, linewidth=1.2, linestyle="--", label="reference")
        panel.set_ylabel(name)
    axes[2].plot(seen.time, np.degrees(seen.tilt), color=REAL.light, linewidth=1.2)
    axes[2].set_ylabel("tilt [°]")
    if headings is not None:
        axes[3].plot(seen.time, headings.estimate, color=REAL.light, linewidth=1.2)
        axes[3].plot(seen.time, headings.reference, color=INK.light, linewidth=1.2, linestyle="--")
        axes[3].set_ylabel("heading [°]")
    for panel in axes:
        panel.margins(x=0)
    axes[-1].set_xlabel("time [s]")
    figure.suptitle(title)
    legend(figure, axes[0])
    return figure
