"""What the robot did in the long trials: how it tilted, and how far it rolled away."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from twbal.core.evaluation import SuccessCriterion
from twbal.core.gaussian import Array
from twbal.core.palette import GOOD, MUTED, REAL
from twbal.viz.canvas import ended_at, legend, panels, styled

_COLUMNS = 3  # panels in a row of the drift figure


class Trials(NamedTuple):
    """The trials of one policy.

    Attributes:
        title: what is written over them.
        courses: one quantity of each trial over its control instants, (T + 1,) each.
    """

    title: str
    courses: Sequence[Array]


@styled
def tilt_figure(groups: Sequence[Trials], control_period: float, rule: SuccessCriterion) -> Figure:
    """Draw the tilt of the trials of some policies side by side, with the limits that make a success.

    Args:
        groups: say, before and after learning; their courses are tilts [rad].
        control_period: [s].
        rule: what makes a success.
    """
    figure, axes = panels(len(groups), columns=2, width=4.8, height=2.9)
    for panel, group in zip(axes, groups, strict=True):
        _draw_rule(panel, control_period, rule)
        _draw_courses(panel, [np.degrees(course) for course in group.courses], control_period, rule.steps)
        panel.set_title(group.title)
        panel.set_xlim(0.0, rule.steps * control_period)
        panel.set_ylim(*(1.25 * np.degrees([-rule.tilt_limit, rule.tilt_limit])))
        panel.set_xlabel("time [s]")
        panel.set_ylabel("tilt [°]")
    legend(figure, *axes)  # below, where no course runs
    return figure


@styled
def drift_figure(groups: Sequence[Trials], control_period: float, rule: SuccessCriterion) -> Figure:
    """Draw how far the robot rolls away in the trials of each policy, and where it must be; all panels have one scale.

    Args:
        groups: one for each iteration; their courses are positions since the start [m].
        control_period: [s].
        rule: what makes a success; a trial that is shorter ends in a cross.
    """
    steps = rule.steps
    figure, axes = panels(len(groups), columns=_COLUMNS, width=3.4, height=2.5)
    seen = np.concatenate([[0.0], *(course for group in groups for course in group.courses)])
    margin = 0.08 * float(np.ptp(seen)) or 1.0
    for i, (panel, group) in enumerate(zip(axes, groups, strict=True)):
        panel.axhline(0.0, color=MUTED.light, linewidth=0.8)
        if rule.place_limit is not None:
            late = [control_period * rule.place_step, control_period * steps]
            name, green = f"must stay in here from {late[0]:.3g} s on", GOOD.light
            panel.fill_between(
                late, -rule.place_limit, rule.place_limit, color=green, alpha=0.15, linewidth=0, label=name
            )
        _draw_courses(panel, group.courses, control_period, steps)
        panel.set_title(group.title)
        panel.set_xlim(0.0, steps * control_period)
        panel.set_ylim(float(seen.min()) - margin, float(seen.max()) + margin)
        panel.set_xlabel("time [s]")
        panel.set_ylabel("position [m]" if i % _COLUMNS == 0 else "")
    legend(figure, *axes)
    return figure


def _draw_rule(axes: Axes, period: float, rule: SuccessCriterion) -> None:
    end, settled = period * rule.steps, period * rule.settle_step
    inner, outer = float(np.degrees(rule.settled_tilt_limit)), float(np.degrees(rule.tilt_limit))
    if settled < end:
        name = f"must stay in here from {settled:.3g} s on"
        axes.fill_between([settled, end], -inner, inner, color=GOOD.light, alpha=0.15, linewidth=0, label=name)
    for side, name in ((-outer, "_"), (outer, "falls")):
        axes.axhline(side, color=MUTED.light, linestyle="--", linewidth=1.1, label=name)


def _draw_courses(axes: Axes, courses: Sequence[Array], period: float, steps: int) -> None:
    for course in courses:
        drawn = course[: steps + 1]
        time = period * np.arange(len(drawn))
        axes.plot(time, drawn, color=REAL.light, linewidth=1.0, alpha=0.85)
        if len(drawn) <= steps:
            ended_at(axes, time[-1], drawn[-1])
