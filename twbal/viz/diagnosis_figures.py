"""What a diagnosis found, as pictures: where the gap is, who explains it, and how it shrank."""

from collections.abc import Mapping, Sequence
from math import isclose
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import StrMethodFormatter
from scipy.stats import binomtest

from twbal.core.palette import GOOD, INK, MUTED, PAPER, PREDICTED, REAL
from twbal.diagnosis.calibration import Bin
from twbal.diagnosis.record import Gap, Region, ResidualAutocorrelation, Rival
from twbal.viz.canvas import aslant, legend, logarithmic, over_horizons, panels, short, shown, styled
from twbal.viz.map_axes import AXES, DIRECTION, direction_text, edge_texts

_SHADES = (  # of a diverging map: predicted too high, right, too low
    (0.0, PREDICTED.light),
    (0.5, PAPER.light),
    (1.0, REAL.light),
)
_DARK, _LIGHT = "#000000", "#fefefe"  # text on fields; not of the palette, as pages recolour that, and never fields
_LUMINANCE = 0.22  # of a field, above which its text is dark; on 0.18 black and white have the same contrast
_MOST_EDGES = 9  # that are labelled on an axis
_ROW = 36  # characters that find room side by side below a panel
_LABEL = 46  # characters of a line of effects' names
_WIDE = (
    9.6  # inch; about as wide as the figures of several panels, so that a page that scales all to its width keeps fonts
)
_NEAR = 10.0  # evidence up to which differences are drawn linearly; those beyond, by their logarithm
_ROOM = 10.0  # times the longest bar, for what is written beside it
_COMPARED = (
    "Probabilities compare the fitted sets with each other. The report's table adds up the sets that hold an effect,\n"
    "and lowers its probability where objections speak against it or the chosen set."
)
_MAPPED = (
    "Number: root mean square error over what noise alone would cause (1: no disagreement).\n"
    "Colour: mean error. Blue: measured lower than predicted; orange: higher."
)
_NOTE = 0.4  # inch; height of that note
_MOST_RMS = 999.5  # of a field; more has no room in it
_LEAST = 1e-3  # that is drawn on a logarithmic axis, where 0 has no place
_SPARE = 0.5  # factor below the least and above the largest bar, for the numbers at their ends
_ABOVE = 1.12  # end of the axis of shares: room for the numbers above them
_ALIKE = 1e-3  # relative difference of probabilities that is none


@styled
def disagreement_figure(regions: Sequence[Region], channels: Sequence[str]) -> Figure:
    """Draw a map of the one-step errors: a row for each channel, a panel for each axis, a field for each range.

    The number in a field is the root mean square error over the noise as fitted, its colour the mean error over that.
    A note below says so.
    """
    axes_names = [name for name in AXES if any(region.axis == name for region in regions)]
    width = max(3.6, _WIDE / len(axes_names))  # room for the note below
    figure, drawn = panels(len(axes_names), columns=3, width=width, height=0.5 + 0.45 * len(channels))
    for panel, name in zip(drawn, axes_names, strict=True):
        _draw_map(panel, [region for region in regions if region.axis == name], channels, name)
    figure.set_figheight(figure.get_figheight() + _NOTE)
    figure.supxlabel(_MAPPED, fontsize=9, color=MUTED.light)
    return figure


@styled
def rivals_figure(rivals: Sequence[Rival], most: int) -> Figure:
    """Draw how far the BIC of sets of effects is above the lowest, with their probabilities as sets compare.

    Drawn are the `most` sets of the lowest BIC, the likeliest, and the data sheet alone. The likeliest need not have
    the lowest BIC (`verdict.probabilities`); that is marked, too.
    """
    known = sorted(rivals, key=lambda rival: -rival.score)
    highest = max(rival.probability for rival in known)
    likeliest = [rival for rival in known if isclose(rival.probability, highest, rel_tol=_ALIKE)]
    sets = [rival for rival in known if rival.names]
    drawn = [rival for rival in sets if rival in sets[:most] or rival in likeliest]
    drawn += [rival for rival in known if not rival.names]
    names = [fill(" + ".join(rival.names).replace("_", " ") or "data sheet refitted alone", _LABEL) for rival in drawn]
    lines = max((name.count("\n") + 1 for name in names), default=1)
    figure, (panel,) = panels(1, columns=1, width=_WIDE, height=1.1 + (0.12 + 0.16 * lines) * len(drawn))
    places = np.arange(len(drawn))[::-1]
    above = [known[0].score - rival.score for rival in drawn]
    panel.barh(places, above, height=0.5, color=MUTED.light)
    panel.set_yticks(places, names)
    for place, rival, difference in zip(places, drawn, above, strict=True):
        said = "lowest BIC" if rival is known[0] else f"{difference:.0f}"
        said += f" ({rival.probability:.0%}{', likeliest' if rival in likeliest else ''})"
        colour = GOOD.light if rival in likeliest else INK.light
        panel.annotate(said, (difference, place), (5, 0), textcoords="offset points", va="center", color=colour)
    panel.set_xscale("symlog", linthresh=_NEAR)
    panel.xaxis.set_major_formatter(StrMethodFormatter("{x:.6g}"))
    panel.set_xlim(0.0, _ROOM * max(*above, _NEAR))
    panel.grid(visible=False, axis="y")
    panel.set_xlabel(f"difference in BIC (logarithmic from {_NEAR:g} on)")
    panel.set_title("BIC of each set above the lowest (probability of the set)")
    figure.supxlabel(_COMPARED, fontsize=9, color=MUTED.light)
    return figure


@styled
def gap_figure(gaps: Sequence[Gap], units: Mapping[str, str], after: str | None) -> Figure:
    """Draw the error of the simulation on held-out data over its horizons, before, refitted, after, and by noise alone.

    Errors are in SI units, as in the table beside the figure.

    Args:
        gaps: errors of each channel over each horizon.
        units: of the channels.
        after: what was added to the data sheet refitted; None where nothing was.
    """
    channels = list(dict.fromkeys(gap.channel for gap in gaps))
    figure, drawn = panels(len(channels), columns=2, width=4.4, height=2.7)
    for panel, channel in zip(drawn, channels, strict=True):
        rows = [gap for gap in gaps if gap.channel == channel]
        horizons = [1e3 * gap.horizon for gap in rows]
        kinds = {
            "data sheet": ("before", REAL, "s-"),
            "data sheet refitted": ("refitted", MUTED, "d--"),
            **({after: ("after", PREDICTED, "o-")} if after else {}),
            "sensor noise alone": ("noise_floor", INK, ":"),
        }
        for name, (kind, colour, form) in kinds.items():
            panel.plot(horizons, [getattr(g, kind) for g in rows], form, color=colour.light, label=name)
        over_horizons(panel, channel, units[channel])
    legend(figure, drawn[0])
    return figure


@styled
def autocorrelation_figure(found: Sequence[ResidualAutocorrelation], after: str | None) -> Figure:
    """Draw the residual autocorrelation of each channel, before and after; bars begin at 1, which is white.

    Args:
        found: of each channel.
        after: what was added to the data sheet refitted; None where nothing was.
    """
    figure, (panel,) = panels(1, columns=1, width=_WIDE, height=2.7)
    places = np.arange(len(found))
    fitted = (after, PREDICTED) if after else ("data sheet refitted", MUTED)
    values = [each.before for each in found], [each.after for each in found]
    for aside, heights, (name, colour) in zip((-0.2, 0.2), values, (("data sheet", REAL), fitted), strict=True):
        above = [max(value, _LEAST) - 1.0 for value in heights]
        bars = panel.bar(places + aside, above, 0.38, bottom=1.0, color=colour.light, label=name)
        panel.bar_label(bars, [short(value) for value in heights], padding=2)
    panel.axhline(1.0, color=INK.light, linestyle=":", linewidth=1.2)
    panel.set_xticks(places, [each.channel.replace("_", " ") for each in found])
    panel.set_ylim(_SPARE * max(min(1.0, *map(min, values)), _LEAST), max(1.0, *map(max, values)) / _SPARE)
    logarithmic(panel, "y")
    panel.grid(visible=False, axis="x")
    panel.set_ylabel("autocorrelation")
    panel.set_title("Ljung-Box statistic of the residuals (1: white noise)")
    legend(figure, panel)
    return figure


@styled
def reliability_figure(bins: Sequence[Bin]) -> Figure:
    """Draw how often probabilities of effects proved right on robots with a known truth (a reliability diagram).

    Shares have 95 % intervals (Clopper and Pearson).

    Args:
        bins: ranges of the probability.
    """
    figure, (panel,) = panels(1, columns=1, width=_WIDE, height=3.2)
    said, right = [each.said for each in bins], [each.right for each in bins]
    ends = [binomtest(round(each.right * each.pairs), each.pairs).proportion_ci() for each in bins]
    below = [max(share - end.low, 0.0) for share, end in zip(right, ends, strict=True)]
    above = [max(end.high - share, 0.0) for share, end in zip(right, ends, strict=True)]
    panel.plot([0.0, 1.0], [0.0, 1.0], color=MUTED.light, linestyle=":", label="as often as said")
    panel.errorbar(said, right, (below, above), fmt="o", color=REAL.light, capsize=2, label="proved right (95 %)")
    for each, end in zip(bins, ends, strict=True):
        panel.annotate(str(each.pairs), (each.said, end.high), (0, 3), textcoords="offset points", ha="center")
    panel.set_xlim(0.0, 1.0)
    panel.set_ylim(0.0, _ABOVE)
    panel.set_xlabel("probability that was said (a number: how many effects)")
    panel.set_ylabel("share that was there")
    panel.set_title("Probabilities of effects, on robots with a known truth")
    legend(figure, panel)
    return figure


def _draw_map(panel: Axes, regions: Sequence[Region], channels: Sequence[str], axis: str) -> None:
    """Draw the fields of one axis; a range that was left out stays empty."""
    colours = LinearSegmentedColormap.from_list("bias", list(_SHADES))
    edges = sorted({region.low for region in regions} | {region.high for region in regions})
    bias, rms = (np.full((len(channels), len(edges) - 1), np.nan) for _ in range(2))
    for region in regions:
        place = channels.index(region.channel), edges.index(region.low)
        bias[place], rms[place] = region.bias, region.rms
    shades = np.tanh(bias / 2.0)
    panel.imshow(shades, cmap=colours, vmin=-1.0, vmax=1.0, aspect="auto")
    for i, j in np.ndindex(*rms.shape):
        if not np.isnan(rms[i, j]):
            ink = _text_colour(colours(float(0.5 * (1.0 + shades[i, j]))))
            panel.text(j, i, _field_text(float(rms[i, j])), ha="center", va="center", fontsize=8.5, color=ink)
    if axis == DIRECTION:
        ways = {edges.index(region.low): direction_text(region) for region in regions}
        panel.set_xticks(list(ways), list(ways.values()), fontsize=8)
    else:
        _label_edges(panel, axis, edges)
    _, unit = shown(AXES[axis].unit)
    panel.set_yticks(range(len(channels)), [channel.replace("_", " ") for channel in channels])
    panel.grid(visible=False)
    panel.set_title(f"{AXES[axis].title} [{unit}]" if unit else AXES[axis].title)


def _field_text(rms: float) -> str:
    """The number of a field, in at most four characters."""
    if rms >= _MOST_RMS:
        return ">999"
    return f"{rms:.1f}" if rms < 99.95 else f"{rms:.0f}"


def _label_edges(panel: Axes, axis: str, edges: Sequence[float]) -> None:
    """Write the ends of ranges where they are, as many as find room, and aslant where they are long."""
    every = -(-len(edges) // _MOST_EDGES)
    texts = edge_texts(axis, edges[::every])
    panel.set_xticks(np.arange(len(edges))[::every] - 0.5, texts, fontsize=8)
    if (max(map(len, texts)) + 1) * (len(texts) - 1) > _ROW:
        aslant(panel)


def _text_colour(field: Sequence[float]) -> str:
    """Dark or light for a field of a colour (red, green, blue, ...), by its relative luminance of WCAG 2."""
    parts = np.array(field[:3])
    linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    return _DARK if float(linear @ [0.2126, 0.7152, 0.0722]) > _LUMINANCE else _LIGHT
