"""What a diagnosis found, as pictures: where the gap is, who explains it, and how it shrank."""

from collections.abc import Sequence
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from twbal.diagnosis import Gap, Region, Rival, Whiteness
from twbal.figures.canvas import label, legend, panels, shown, styled
from twbal.palette import GOOD, INK, MUTED, PAPER, PREDICTED, REAL

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
_LABEL = 36  # characters of a line of effects' names
_DIRECTIONS = {-1.0: "back", 0.0: "forth"}


@styled
def disagreement_figure(regions: Sequence[Region], channels: Sequence[str]) -> Figure:
    """Draw a map of the one-step errors: a row for each channel, a panel for each axis, a field for each range.

    The number in a field is the root mean square error over the sensors' noise, its colour the mean error over that.
    """
    axes_names = [name for name in _AXES if any(region.axis == name for region in regions)]
    figure, drawn = panels(len(axes_names), columns=3, width=3.6, height=0.5 + 0.45 * len(channels))
    for panel, name in zip(drawn, axes_names, strict=True):
        _draw_map(panel, [region for region in regions if region.axis == name], channels, name)
    return figure


@styled
def rivals_figure(rivals: Sequence[Rival], most: int) -> Figure:
    """Draw the scores of the candidates, the best `most` of them, with the probability of each."""
    best = [rival for rival in rivals if rival.names][:most]
    names = [fill(" + ".join(rival.names).replace("_", " "), _LABEL) for rival in best]
    lines = max((name.count("\n") + 1 for name in names), default=1)
    figure, (panel,) = panels(1, columns=1, width=7.2, height=0.9 + (0.12 + 0.16 * lines) * len(best))
    places = np.arange(len(best))[::-1]
    colours = [GOOD.light if rival.probability >= 0.5 else MUTED.light for rival in best]
    panel.barh(places, [rival.score for rival in best], height=0.65, color=colours)
    panel.set_yticks(places, names)
    for place, rival in zip(places, best, strict=True):
        at = max(rival.score, 0.0)
        panel.annotate(f"{rival.probability:.0%}", (at, place), (4, 0), textcoords="offset points", va="center")
    panel.axvline(0.0, color=INK.light, linewidth=0.8)
    panel.margins(x=0.12)
    panel.grid(visible=False, axis="y")
    panel.set_xlabel("evidence gained, less the price of parameters [nats]")
    panel.set_title("what would explain the gap")
    return figure


@styled
def gap_figure(gaps: Sequence[Gap], units: dict[str, str]) -> Figure:
    """Draw the error of the simulation on held-out data over its horizons, before, after and at its floor."""
    channels = list(dict.fromkeys(gap.channel for gap in gaps))
    figure, drawn = panels(len(channels), columns=2, width=4.4, height=2.7)
    for panel, channel in zip(drawn, channels, strict=True):
        rows = [gap for gap in gaps if gap.channel == channel]
        factor, unit = shown(units[channel])
        horizons = [1e3 * gap.horizon for gap in rows]
        kinds = (("before", REAL, "s-"), ("refitted", MUTED, "d--"), ("after", PREDICTED, "o-"), ("floor", INK, ":"))
        names = ("data sheet", "data sheet refitted", "with what was named", "sensor noise alone")
        for (kind, colour, form), name in zip(kinds, names, strict=True):
            panel.plot(horizons, [factor * getattr(g, kind) for g in rows], form, color=colour.light, label=name)
        panel.set_ylim(bottom=0)
        panel.set_xlabel("horizon [ms]")
        panel.set_ylabel(label(f"error of {channel}", unit))
        panel.set_title(channel.replace("_", " "))
    legend(figure, drawn[0])
    return figure


@styled
def whiteness_figure(whiteness: Sequence[Whiteness]) -> Figure:
    """Draw how coloured the residuals of each channel are, before and after; 1 is white."""
    figure, (panel,) = panels(1, columns=1, width=5.2, height=2.7)
    places = np.arange(len(whiteness))
    panel.bar(places - 0.2, [w.before for w in whiteness], width=0.38, color=REAL.light, label="data sheet")
    panel.bar(
        places + 0.2, [w.after for w in whiteness], width=0.38, color=PREDICTED.light, label="with what was named"
    )
    panel.axhline(1.0, color=MUTED.light, linestyle=":", linewidth=1.2)
    panel.set_xticks(places, [w.channel.replace("_", " ") for w in whiteness])
    panel.set_yscale("log")
    panel.grid(visible=False, axis="x")
    panel.set_ylabel("colour of residuals")
    panel.set_title("one-step residuals (1 is white)")
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
