"""Groups of runs beside each other: every run a dot, medians as lines."""

from collections.abc import Mapping, Sequence
from textwrap import fill

import numpy as np
from matplotlib.figure import Figure

from twbal.algorithm.comparison import METRICS, Run
from twbal.core.palette import MUTED, PREDICTED, REAL
from twbal.viz.canvas import panels, styled

_TITLE = 38  # characters of a line of a panel's title


@styled
def comparison_figure(groups: Mapping[str, Sequence[Run]]) -> Figure:
    """Draw each metric of each run; runs that never got there stand in a row of their own, on top."""
    figure, axes = panels(len(METRICS), columns=3, width=3.6, height=2.7)
    jitter = np.random.default_rng(0)
    for panel, (metric, (what, unit, _)) in zip(axes, METRICS.items(), strict=True):
        known = [run.values[metric] for runs in groups.values() for run in runs if np.isfinite(run.values[metric])]
        top = 1.15 * max(known, default=1.0) or 1.0
        for place, runs in enumerate(groups.values()):
            values = np.array([run.values[metric] for run in runs])
            values = values[~np.isnan(values)]
            across = place + 0.12 * jitter.uniform(-1, 1, len(values))
            never = np.isinf(values)
            panel.plot(across[~never], values[~never], "o", color=REAL.light, markersize=4, alpha=0.7)
            panel.plot(across[never], np.full(never.sum(), top), "x", color=MUTED.light, markersize=6)
            if (~never).any():
                middle = float(np.median(values))  # infinite where half of the runs never got there
                panel.plot([place - 0.25, place + 0.25], [min(middle, top)] * 2, color=PREDICTED.light, linewidth=2.2)
        if any(np.isinf(run.values[metric]) for runs in groups.values() for run in runs):
            panel.annotate("never", (-0.45, top), (0, 3), textcoords="offset points", color=MUTED.light)
        panel.set_xticks(range(len(groups)), list(groups))
        panel.set_xlim(-0.5, len(groups) - 0.5)
        panel.set_ylim(0.0, 1.12 * top)
        panel.set_title(fill(f"{what} [{unit}]" if unit else what, _TITLE), fontsize=8.5)
    return figure
