"""Runs of Algorithm 1 beside each other: how well, at what real cost, and whether a difference is more than chance."""

import math
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import bdtr

from twbal.algorithm.iteration import PARTS
from twbal.algorithm.summary import Summary

METRICS = {
    "success": ("share of trials that succeed, best policy", "", True),
    "upright": ("share of upright trials, best policy", "", True),
    "settled": ("share of settled trials, best policy", "", True),
    "in_place": ("share of trials in place, best policy", "", True),
    "quiet": ("share of quiet trials, best policy", "", True),
    "seconds": ("driven to learn until all trials succeed", "s", False),
    "trial_seconds": ("driven in trials until then", "s", False),
    "cost": ("real long-term cost, best policy", "", False),
    "coverage": ("real states in the 95 % band, best policy", "", True),
    "crps_ratio": ("CRPS over that of the trials' own spread, best policy", "", False),
    "tilt_band": ("widest 95 % band of the tilt, best policy", "rad", False),
    "farthest": ("late distance from the start, best policy", "m", False),
    "farthest_worst": ("late distance from the start in the worst trial, best policy", "m", False),
    "command_change": ("change of the command from step to step over the torque limit, best policy", "", False),
    "oscillation": ("late oscillation of the tilt, best policy", "rad", False),
    "drift": ("drift in a trial, best policy", "m", False),
    "search": ("computed in fits and searches", "s", False),
}
"""What is compared: in words, its unit, and whether more is better."""

BY_RULE = ("success", "upright", "settled", "in_place", "quiet", "seconds", "trial_seconds")
"""Metrics that the rule of success decides."""
BY_RULE_TIMES = ("farthest", "farthest_worst", "command_change", "oscillation", "drift")
"""Metrics that are measured over a part of a trial which the times of the rule say."""

_SHOWN = 3  # significant digits
_LATEX = {mark: f"\\{mark}" for mark in "&%#_${}"}
_LATEX |= {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"}
_INFINITE = re.compile(r"\binf\b")


class Run(NamedTuple):
    """One run.

    Attributes:
        key: what it shares with the run of another group that it is compared with (robot, seeds).
        values: by metric; infinite where a robot was never solved, NaN where nothing was measured.
    """

    key: tuple[str, ...]
    values: Mapping[str, float]


class MedianEstimate(NamedTuple):
    """A median with its 95 % interval by order statistics; fewer than 6 runs have none."""

    value: float
    low: float | None
    high: float | None

    @property
    def words(self) -> str:
        """As in a table."""
        if self.low is None or self.high is None:
            return _number(self.value)
        return f"{_number(self.value)} ({_number(self.low)} to {_number(self.high)})"


class Paired(NamedTuple):
    """One group against another, run by run.

    Attributes:
        better, worse: how many of the runs that both have are so; ties are neither.
        p: two-sided, of the sign test; 1 without pairs that differ.
        pairs: of runs that were both measured, ties too.
    """

    better: int
    worse: int
    p: float
    pairs: int

    @property
    def words(self) -> str:
        """As in a table."""
        return f"{self.better}, {self.worse}, {self.pairs}, {self.p:.2g}" if self.pairs else "-"


def run_values(summary: Summary) -> dict[str, float]:
    """The metrics of one run.

    The best policy is measured by the trials of all iterations that had it, and its band is that of the newest model.
    """
    successes, trials = summary.count(summary.best_iteration)
    tried, shown = summary.tried(summary.best_iteration), summary.parts(summary.best_iteration)
    newest = summary.having(summary.best_iteration)[-1]
    solved = [i for i in summary.iterations if i.trials and i.successes == i.trials]
    return {
        "success": successes / trials if trials else math.nan,
        "seconds": solved[0].real_seconds if solved else math.inf,
        "trial_seconds": _trial_seconds(summary, solved[0].index) if solved else math.inf,
        "cost": _mean(i.real_cost for i in tried),
        "coverage": _or_nan(newest.coverage95),
        "crps_ratio": _or_nan(newest.crps_ratio),
        "tilt_band": _or_nan(newest.tilt_band_widest),
        **{part: shown.get(name, math.nan) / trials if trials else math.nan for part, name in PARTS.items()},
        "farthest": _mean(i.farthest_median_m for i in tried),
        "farthest_worst": max((i.farthest_worst_m for i in tried if i.farthest_worst_m is not None), default=math.nan),
        "command_change": _mean(i.command_change for i in tried),
        "oscillation": _mean(i.oscillation for i in tried),
        "drift": _mean(i.drift_m for i in tried),
        "search": sum(i.fit_s + i.search_s for i in summary.iterations),
    }


def estimate(values: Sequence[float]) -> MedianEstimate | None:
    """Median of what was measured, with an interval between two of the values; None where nothing was measured.

    Each value lies below the true median with a probability of a half, so the number of those below is binomial. (The
    percentiles of a bootstrap say 95 % of three values, too, which hold the median in three of four cases.)

    Of an even number the median is the mean of the two in the middle, which is infinite where one of them is: then half
    of the runs never got there.

    Args:
        values: may be infinite; NaN is left out.
    """
    known = np.sort([value for value in values if not math.isnan(value)])
    if not len(known):
        return None
    middle = float(np.median(known))
    rank = sum(bool(bdtr(k, len(known), 0.5) <= 0.025) for k in range(len(known)))  # of the low end
    if not rank:
        return MedianEstimate(middle, None, None)
    return MedianEstimate(middle, float(known[rank - 1]), float(known[-rank]))


def paired(group: Sequence[Run], other: Sequence[Run], metric: str) -> Paired:
    """`group` against `other` in one metric, over runs whose key both have once, by the sign test."""
    mine, theirs = _by_key(group), _by_key(other)
    values = [(mine[key].values[metric], theirs[key].values[metric]) for key in mine if key in theirs]
    more = sum(a > b for a, b in values)  # neither, where one of them is NaN
    less = sum(a < b for a, b in values)
    better, worse = (more, less) if METRICS[metric][2] else (less, more)
    p = min(2.0 * float(bdtr(min(better, worse), better + worse, 0.5)), 1.0) if better + worse else 1.0
    return Paired(better, worse, p, sum(not (math.isnan(a) or math.isnan(b)) for a, b in values))


def without_pairs(groups: Mapping[str, Sequence[Run]]) -> list[str]:
    """The groups of which no run has a key of the first group, so that they are not compared run by run."""
    first, *others = groups
    keys = _by_key(groups[first]).keys()
    return [name for name in others if keys.isdisjoint(_by_key(groups[name]))]


def unmeasured(groups: Mapping[str, Sequence[Run]], metrics: Collection[str]) -> dict[str, list[Run]]:
    """The same runs without some of their metrics, as those that do not compare: NaN stands in their place.

    Args:
        groups: runs by the name of their group.
        metrics: of `METRICS`.
    """
    gone = dict.fromkeys(metrics, math.nan)
    return {name: [Run(run.key, {**run.values, **gone}) for run in runs] for name, runs in groups.items()}


def rows(groups: Mapping[str, Sequence[Run]]) -> list[dict[str, str]]:
    """One row a group, in words: each metric, and how it does against the first group.

    Of the second, runs that do better, and worse, than the run of the first group with the same robot and seeds, the
    number of such pairs, and p of the sign test; "-" where there is no pair.
    """
    first = next(iter(groups.values()))
    found = []
    for name, runs in groups.items():
        row = {"group": name, "runs": str(len(runs))}
        for metric, (what, unit, _) in METRICS.items():
            value = estimate([run.values[metric] for run in runs])
            row[f"{what} [{unit}]" if unit else what] = "-" if value is None else value.words
        if runs is not first:
            for metric, (what, *_) in METRICS.items():
                row[f"{what}: better, worse, pairs, p"] = paired(runs, first, metric).words
        found.append(row)
    return found


def latex(table: Sequence[Mapping[str, str]]) -> str:
    """The rows as a LaTeX table: a line for each figure, a column for each group."""
    names = list(dict.fromkeys(key for row in table for key in row))
    lines = [r"\begin{tabular}{l" + "r" * len(table) + "}"]
    for name in names:
        cells = [_escaped(row.get(name, "")) for row in table]
        if name != "group":  # a name may be that word; a figure is infinite
            cells = [_INFINITE.sub(r"$\\infty$", cell) for cell in cells]
        lines.append(" & ".join([_escaped(name), *cells]) + r" \\")
        if name == "group":
            lines.append(r"\hline")
    return "\n".join([*lines, r"\end{tabular}", ""])


def _escaped(text: str) -> str:
    return "".join(_LATEX.get(letter, letter) for letter in text)


def _by_key(runs: Sequence[Run]) -> dict[tuple[str, ...], Run]:
    """Runs whose key no other one has."""
    keys = [run.key for run in runs]
    return {run.key: run for run in runs if keys.count(run.key) == 1}


def _trial_seconds(summary: Summary, last: int) -> float:
    """How long the robot was driven in the trials of the iterations up to `last` [s]."""
    return sum(_or_nan(i.trial_seconds) for i in summary.iterations[: last + 1])


def _mean(values: Iterable[float | None]) -> float:
    """Of what was measured; NaN where nothing was."""
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if known else math.nan


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value


def _number(value: float) -> str:
    return f"{value:.{_SHOWN}g}"
