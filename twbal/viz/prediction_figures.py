"""What the model predicted and what the robot did: the paper's Fig. 4 and 5."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from twbal.core.gaussian import HALF_WIDTH_95, Array, Gaussian
from twbal.core.palette import MUTED, PREDICTED, REAL
from twbal.viz.canvas import ended_at, in_words, label, legend, limits, notes_above, panels, short, shown, styled

_ROOM = 0.6  # of the range that the robot used, left above and below it: what the model says beyond is cut off
_BAND, _WITHIN = 0.25, 0.3  # opacity of the band, and of the one over it of what varies from rollout to rollout


@styled
def prediction_figure(
    predicted: Sequence[Gaussian],
    trajectories: Sequence[Array],
    channels: Sequence[str],
    units: Sequence[str],
    control_period: float,
    title: str,
    unknown: Array | None = None,
) -> Figure:
    """Draw the predicted 95 % band of each channel with the real trajectories over it.

    A darker band within is that of what varies from rollout to rollout, if the robot were known.

    Args:
        predicted: p(x_t) for t = 0 .. H.
        trajectories: (T + 1, D) states of each trial, of any length; steps after H are not drawn. A trial that ends
            before H ends in a cross. Their range is that of the axes; a band that goes far beyond it is cut, and a note
            over the panel says how far it goes.
        channels: names of the D channels.
        units: their units.
        control_period: [s].
        title: of the whole figure.
        unknown: (H + 1, D) variances that are due to what is not known of the robot; None: no darker band.
    """
    figure, axes = panels(len(channels), columns=3, width=3.4, height=2.6)
    mean = np.array([p.mean for p in predicted])  # (H + 1, D)
    variance = np.array([p.sd**2 for p in predicted])  # (H + 1, D)
    half_width = HALF_WIDTH_95 * np.sqrt(variance)
    varies = None if unknown is None else HALF_WIDTH_95 * np.sqrt(np.maximum(variance - unknown, 0.0))
    notes = []
    for i, panel in enumerate(axes):
        factor, unit = shown(units[i])
        courses = [factor * x[: len(predicted), i] for x in trajectories]
        within = None if varies is None else factor * varies[:, i]
        band = factor * mean[:, i], factor * half_width[:, i]
        notes.append(_draw_channel(panel, control_period, *band, within, courses))
        panel.set_title(in_words(channels[i]))
        panel.set_xlabel("time [s]")
        panel.set_ylabel(label(channels[i], unit))
    notes_above(axes, notes, MUTED.light)
    figure.suptitle(title, x=0.01, ha="left")
    legend(figure, axes[0])
    return figure


def _draw_channel(
    axes: Axes, period: float, mean: Array, half_width: Array, varies: Array | None, courses: Sequence[Array]
) -> str:
    """Draw a channel, and return how far its band goes where it is cut."""
    time = period * np.arange(len(mean))
    low, high = mean - half_width, mean + half_width
    axes.fill_between(time, low, high, color=PREDICTED.light, alpha=_BAND, linewidth=0, label="predicted, 95 %")
    if varies is not None:
        axes.fill_between(time, mean - varies, mean + varies, color=PREDICTED.light, alpha=_WITHIN, linewidth=0)
        seen = 1.0 - (1.0 - _BAND) * (1.0 - _WITHIN)  # one band over the other
        patch = Rectangle((0.0, 0.0), 0.0, 0.0, color=PREDICTED.light, alpha=seen, linewidth=0)
        patch.set_label("varies from rollout to rollout")
        axes.add_patch(patch)
    axes.plot(time, mean, color=PREDICTED.light, linewidth=1.5, zorder=3, label="predicted, mean")
    for i, course in enumerate(courses):
        name = f"robot, {len(courses)} trial{'' if len(courses) == 1 else 's'}" if i == 0 else None
        axes.plot(time[: len(course)], course, color=REAL.light, linewidth=0.9, alpha=0.8, label=name)
        if len(course) < len(mean):
            ended_at(axes, time[len(course) - 1], course[-1])
    axes.set_xlim(0.0, time[-1])
    bottom, top = limits(np.concatenate([[], *courses]), np.concatenate([low, high]), _ROOM)
    axes.set_ylim(bottom, top)
    is_cut = low.min() < bottom or high.max() > top
    return f"band: {short(low.min())} to {short(high.max())}" if is_cut else ""
