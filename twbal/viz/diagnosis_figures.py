"""What a diagnosis found, as pictures: where the gap is, who explains it, and how it shrank."""

from collections.abc import Mapping, Sequence
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from twbal.core.palette import GOOD, INK, MUTED, PAPER, PREDICTED, REAL
from twbal.diagnosis.record import Gap, Region, Rival, Whiteness
from twbal.viz.canvas import label, legend, panels, shown, styled

_SHADES = (  # of a diverging map: predicted too high, right, too low
    (0.0, PREDICTED.light),
    (0.5, PAPER.light),
    (1.0, REAL.light),
)
_AXES = {
    "speed": ("speed", "m/s"),
    "command": ("command", "N·m"),
    "tilt": ("tilt", "rad"),
    "direction": ("wheels turn", ""),
    "time": ("time", "s"),
}
_LABEL = 46  # characters of a line of effects' names
_WIDE = (
    9.6  # inch; about as wide as the figures of several panels, so that a page that scales all to its width keeps fonts
)
_NEAR = 10.0  # evidence up to which differences are drawn linearly; those beyond, by their logarithm
_ROOM = 10.0  # times the longest bar, for what is written beside it
_DIRECTIONS = {-1.0: "back", 0.0: "forth"}


@styled
def disagreement_figure(regions: Sequence[Region], channels: Sequence[str]) -> Figure:
    """Draw a map of the one-step errors: a row for each channel, a panel for each axis, a field for each range.

    The number in a field is the root mean square error over the noise as fitted, its colour the mean error over that.
    """
    axes_names = [name for name in _AXES if any(region.axis == name for region in regions)]
    figure, drawn = panels(len(axes_names), columns=3, width=3.6, height=0.5 + 0.45 * len(channels))
    for panel, name in zip(drawn, axes_names, strict=True):
        _draw_map(panel, [region for region in regions if region.axis == name], channels, name)
    return figure


@styled
def rivals_figure(rivals: Sequence[Rival], most: int) -> Figure:
    """Draw by how much evidence the best `most` candidates, and the data sheet alone, fall short of the best."""
    known = sorted(rivals, key=lambda rival: -rival.score)
    best = [rival for rival in known if rival.names][:most] + [rival for rival in known if not rival.names]
    names = [fill(" + ".join(rival.names).replace("_", " ") or "data sheet refitted alone", _LABEL) for rival in best]
    lines = max((name.count("\n") + 1 for name in names), default=1)
    figure, (panel,) = panels(1, columns=1, width=_WIDE, height=0.9 + (0.12 + 0.16 * lines) * len(best))
    places = np.arange(len(best))[::-1]
    short = [known[0].score - rival.score for rival in best]
    panel.barh(places, short, height=0.5, color=MUTED.light)
    panel.set_yticks(places, names)
    for place, rival, difference in zip(places, best, short, strict=True):
        first = rival is known[0]
        said = f"{'best' if first else round(difference)} ({rival.probability:.0%})"
        colour = GOOD.light if first else INK.light
        panel.annotate(said, (difference, place), (5, 0), textcoords="offset points", va="center", color=colour)
    panel.set_xscale("symlog", linthresh=_NEAR)
    panel.set_xlim(0.0, _ROOM * max(*short, _NEAR))
    panel.grid(visible=False, axis="y")
    panel.set_xlabel(f"-2 log likelihood and price of parameters, more than the best's (logarithmic from {_NEAR:g} on)")
    panel.set_title("how far each falls short of the best (probability)")
    return figure


@styled
def gap_figure(gaps: Sequence[Gap], units: Mapping[str, str], after: str | None) -> Figure:
    """Draw the error of the simulation on held-out data over its horizons, before, refitted, after, and by noise alone.

    Args:
        gaps: errors of each channel over each horizon.
        units: of the channels.
        after: what was added to the data sheet refitted; None where nothing was.
    """
    channels = list(dict.fromkeys(gap.channel for gap in gaps))
    figure, drawn = panels(len(channels), columns=2, width=4.4, height=2.7)
    for panel, channel in zip(drawn, channels, strict=True):
        rows = [gap for gap in gaps if gap.channel == channel]
        factor, unit = shown(units[channel])
        horizons = [1e3 * gap.horizon for gap in rows]
        kinds = {
            "data sheet": ("before", REAL, "s-"),
            "data sheet refitted": ("refitted", MUTED, "d--"),
            **({after: ("after", PREDICTED, "o-")} if after else {}),
            "sensor noise alone": ("noise_floor", INK, ":"),
        }
        for name, (kind, colour, form) in kinds.items():
            panel.plot(horizons, [factor * getattr(g, kind) for g in rows], form, color=colour.light, label=name)
        panel.set_ylim(bottom=0)
        panel.set_xlabel("horizon [ms]")
        panel.set_ylabel(label(f"error of {channel}", unit))
        panel.set_title(channel.replace("_", " "))
    legend(figure, drawn[0])
    return figure


@styled
def whiteness_figure(whiteness: Sequence[Whiteness], after: str | None) -> Figure:
    """Draw the residual autocorrelation of each channel, before and after; 1 is white.

    Args:
        whiteness: of each channel.
        after: what was added to the data sheet refitted; None where nothing was.
    """
    figure, (panel,) = panels(1, columns=1, width=_WIDE, height=2.7)
    places = np.arange(len(whiteness))
    panel.bar(places - 0.2, [w.before for w in whiteness], width=0.38, color=REAL.light, label="data sheet")
    label = after or "data sheet refitted"
    panel.bar(places + 0.2, [w.after for w in whiteness], width=0.38, color=PREDICTED.light, label=label)
    panel.axhline(1.0, color=MUTED.light, linestyle=":", linewidth=1.2)
    panel.set_xticks(places, [w.channel.replace("_", " ") for w in whiteness])
    panel.set_yscale("log")
    panel.grid(visible=False, axis="x")
    panel.set_ylabel("autocorrelation")
    panel.set_title("residual autocorrelation (1 is white)")
    legend(figure, panel)
    return figure


def _draw_map(panel: Axes, regions: Sequence[Region], channels: Sequence[str], axis: str) -> None:
    """Draw the fields of one axis."""
    colours = LinearSegmentedColormap.from_list("bias", list(_SHADES))
    lows = sorted({region.low for region in regions})
    bias, rms = (np.full((len(channels), len(lows)), np.nan) for _ in range(2))
    for region in regions:
        place = channels.index(region.channel), lows.index(region.low)
        bias[place], rms[place] = region.bias, region.rms
    panel.imshow(np.tanh(bias / 2.0), cmap=colours, vmin=-1.0, vmax=1.0, aspect="auto")
    for i, j in np.ndindex(*rms.shape):
        if np.isfinite(rms[i, j]):
            panel.text(j, i, f"{rms[i, j]:.1f}", ha="center", va="center", fontsize=8.5)
    name, unit = _AXES[axis]
    factor, unit = shown(unit)
    highs = {region.low: region.high for region in regions}
    ranges = [_DIRECTIONS[low] if axis == "direction" else _range(factor * low, factor * highs[low]) for low in lows]
    panel.set_xticks(range(len(lows)), ranges, fontsize=8)
    panel.set_yticks(range(len(channels)), [channel.replace("_", " ") for channel in channels])
    panel.grid(visible=False)
    panel.set_title(f"{name} [{unit}]" if unit else name)


def _range(low: float, high: float) -> str:
    return f"{low:.2g}\n{high:.2g}"
