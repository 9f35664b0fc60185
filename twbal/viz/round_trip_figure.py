"""How long a robot's answers take: a histogram of round trips."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from twbal.core.palette import INK, PREDICTED
from twbal.viz.canvas import legend, logarithmic, panels, styled


@styled
def round_trip_figure(round_trips: Sequence[float], control_period: float, robot: str) -> Figure:
    """Draw the histogram, on a logarithmic axis of time.

    Args:
        round_trips: at least one [s].
        control_period: of the robot, which is marked [s].
        robot: its name.
    """
    times = np.maximum(np.asarray(round_trips), 1e-6) * 1e3  # [ms]
    edges = np.geomspace(
        min(times.min(), control_period * 1e3) * 0.8, max(times.max(), control_period * 1e3) * 1.25, 40
    )
    figure, (panel,) = panels(1, columns=1, width=6.0, height=2.6)
    panel.hist(times, bins=edges.tolist(), color=PREDICTED.light, label=f"{len(times)} answers")
    panel.axvline(control_period * 1e3, color=INK.light, linewidth=1.2, linestyle="--", label="control period")
    logarithmic(panel, "x")
    panel.set_xlabel("round trip [ms]")
    panel.set_ylabel("answers")
    figure.suptitle(f"Round trips to robot {robot}")
    legend(figure, panel)
    return figure
