"""What a run of Algorithm 1 or a course came to, as tables of plain text."""

from collections.abc import Sequence
from math import degrees

from twbal.algorithm.following import FollowedCourse, FollowedSegment
from twbal.algorithm.iteration import PARTS, Iteration
from twbal.algorithm.summary import Summary
from twbal.core.text import aligned

_ABOVE = ("", "", "", "cost", "", "succeeds", "", "driven in", "in 95 %", "CRPS", "tilt band:", "", "")
_ITERATIONS = (
    *("iteration", "policy", "real data", "predicted", "real", "predicted", "real", "trials"),
    *("band", "/ of trials", "median, widest", "fit", "search"),
)
_TRIALS = (
    *("iteration", "trials", *PARTS.values(), "from where it was put: median, worst", "place by"),
    *("command change", "tilt, peak to peak"),
)
_COURSE = (
    *("trial", "from", "to", "asked", "driven", "speed off by", "farthest from reference", "off at the end"),
    *("asked heading", "heading off at the end"),
)


def iterations_table(summary: Summary) -> list[str]:
    """A line for each iteration, what it learned from and what came of it; the best one is marked."""
    rows = [_of_learning(i, _marked(i, summary)) for i in summary.iterations]
    return aligned([_ABOVE, _ITERATIONS, *rows], right=True)


def trials_table(summary: Summary) -> list[str]:
    """A line for each iteration with trials, what they show part by part; empty where no iteration notes it."""
    return aligned(trials_rows(summary), right=True)


def trials_rows(summary: Summary) -> list[tuple[str, ...]]:
    """The same as cells, the first row being the columns' names."""
    rows = [_of_trials(i, _marked(i, summary)) for i in summary.iterations if i.upright is not None]
    return [_TRIALS, *rows] if rows else []


def tilt_band(iteration: Iteration) -> str:
    """Half width of the predicted band of the tilt, its median and its widest, in degrees."""
    if iteration.tilt_band_median is None or iteration.tilt_band_widest is None:
        return "-"
    return f"±{angle(iteration.tilt_band_median)}, ±{angle(iteration.tilt_band_widest)}"


def crps(iteration: Iteration) -> str:
    """CRPS of the predicted bands and of the trials' own spread, in units of the cost's widths."""
    if iteration.crps is None:
        return "-"
    return " / ".join(_number(value, ".2g") for value in (iteration.crps, iteration.crps_of_trials))


def policy_and_reason(iteration: Iteration) -> str:
    """Whether the policy is new, and why it is driven."""
    which = "new" if iteration.same_policy_as is None else f"that of {iteration.same_policy_as}"
    return which if iteration.reason is None else f"{which}, {iteration.reason}"


def trials_driven(iteration: Iteration) -> str:
    """How long the robot was driven in trials, or whose trials are shown."""
    if iteration.trials_of is not None:
        return f"those of {iteration.trials_of}"
    return _number(iteration.trial_seconds, ".1f", " s")


def distances(iteration: Iteration) -> str:
    """Late distance from where the robot was put, its median over the trials and its worst, in metres."""
    if iteration.farthest_median_m is None or iteration.farthest_worst_m is None:
        return "-"
    return f"{iteration.farthest_median_m:.2f} m, {iteration.farthest_worst_m:.2f} m"


def angle(radians: float) -> str:
    """In degrees, with two digits at least."""
    return f"{degrees(radians):.2g}°" if degrees(radians) < 10 else f"{degrees(radians):.0f}°"


def course_table(trials: Sequence[FollowedCourse]) -> list[str]:
    """A line for each segment that a trial reached."""
    rows = [_of_segment(trial, segment) for trial in trials for segment in trial.segments]
    return aligned([_COURSE, *rows], right=True)


def _of_segment(trial: FollowedCourse, segment: FollowedSegment) -> tuple[str, ...]:
    place = segment.asked_position
    return (
        str(trial.trial),
        f"{segment.begin:.1f} s",
        f"{segment.end:.1f} s",
        f"{segment.asked_speed:.2f} m/s" if place is None else f"to {place:.2f} m",
        _number(segment.speed, ".3f", " m/s"),
        _number(segment.speed_error, "+.1f", " %"),
        f"{segment.farthest:.2f} m",
        f"{segment.off_at_end:+.2f} m",
        "-" if segment.asked_heading is None else f"{degrees(segment.asked_heading):.0f}°",
        "-" if segment.heading_off_at_end is None else f"{degrees(segment.heading_off_at_end):+.1f}°",
    )


def _of_learning(iteration: Iteration, index: str) -> tuple[str, ...]:
    return (
        index,
        policy_and_reason(iteration),
        f"{iteration.real_samples} samples, {iteration.real_seconds:.1f} s",
        _number(iteration.predicted_cost, ".1f"),
        _number(iteration.real_cost, ".1f"),
        _number(iteration.success_probability, ".2f"),
        f"{iteration.successes} of {iteration.trials}" if iteration.trials else "-",
        trials_driven(iteration),
        _number(iteration.coverage95, ".2f"),
        crps(iteration),
        tilt_band(iteration),
        f"{iteration.fit_s:.1f} s",
        f"{iteration.search_s:.1f} s",
    )


def _of_trials(iteration: Iteration, index: str) -> tuple[str, ...]:
    return (
        index,
        str(iteration.trials),
        *("not asked" if getattr(iteration, part) is None else str(getattr(iteration, part)) for part in PARTS),
        distances(iteration),
        iteration.place_by or "-",
        _number(iteration.command_change, ".3f"),
        "-" if iteration.oscillation is None else angle(iteration.oscillation),
    )


def _marked(iteration: Iteration, summary: Summary) -> str:
    return f"{'*' if iteration.index == summary.best_iteration else ' '} {iteration.index}"


def _number(value: float | None, form: str, unit: str = "") -> str:
    return "-" if value is None else f"{value:{form}}{unit}"
