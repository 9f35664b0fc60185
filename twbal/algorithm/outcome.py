"""What a run of Algorithm 1 came to, in words: the same for the terminal and the report.

Every sentence is made from what `summary.json` notes of each iteration, none from the method that was asked for.
"""

from math import degrees

from twbal.algorithm.summary import Iteration, Summary

COSTS_PART = 3.0
"""By this factor predicted and real cost must differ for a warning; costs below 1, one lost step, count as 1."""
SHARES_PART = 0.5
"""By this much the shares of successes in long model rollouts and in real trials must differ for a warning."""

_COLUMNS = (
    *("iteration", "policy", "real data", "cost predicted", "real", "balances", "trials", "in 95 % band"),
    *("tilt band, widest", "drift", "fit", "search"),
)


def headline(summary: Summary) -> str:
    """Whether the robot is balanced, by which policy, and what that policy was learned from."""
    best = summary.best
    successes, trials = summary.count(best.index)
    if not trials:
        return f"No trial was driven, so nothing is known of how policy {best.index} balances the robot."
    if not successes:
        driven = sum(iteration.trials for iteration in summary.iterations)
        return f"The robot is not balanced: no policy succeeded in any of {counted(driven, 'trial')}."
    if successes == trials:
        said = "The robot is balanced: policy"
    elif summary.solved:
        said = "The robot is balanced in most trials: policy"
    else:
        return (
            f"The robot is not reliably balanced: the best, policy {best.index}, succeeded in {successes} of {trials} "
            f"trials. {_learned_from(summary)}"
        )
    rolled = f" In a trial it rolled {best.drift_m:.1f} m away (median)." if best.drift_m is not None else ""
    return f"{said} {best.index} succeeded in {successes} of {trials} trials. {_learned_from(summary)}{rolled}"


def _learned_from(summary: Summary) -> str:
    """What the best policy took, and how policy 0 did if it is another."""
    best = summary.best
    if not best.real_seconds:
        return "Nothing was learned from the robot for it."
    updates = sum(not iteration.recalibrates for iteration in summary.iterations[1 : best.index + 1])
    said = f"It was learned from {best.real_seconds:.1f} s of driving the robot"
    if not updates:
        return f"{said}."
    first = summary.count(0)
    return f"{said}, in {counted(updates, 'update')}; policy 0 succeeded in {first.successes} of {first.trials}."


def driving(summary: Summary) -> str:
    """How long the robot was driven, and for what."""
    learned = f"The robot was driven for {summary.iterations[-1].real_seconds:.1f} s to learn"
    judged = "" if summary.trial_seconds is None else f", and for {summary.trial_seconds:.1f} s in trials"
    return f"{learned}{judged}."


def warnings_on(summary: Summary, iteration: Iteration) -> list[str]:
    """Warnings on an iteration of a run, as `doubts` has them."""
    return doubts(iteration, summary.tilt_limit)


def doubts(iteration: Iteration, tilt_limit: float | None) -> list[str]:
    """Warnings where the model of an iteration and the robot part, or where the model says nothing.

    Args:
        iteration: with its prediction and trials; a warning is left out where one of them is missing.
        tilt_limit: beyond which the robot has fallen [rad].
    """
    i, found = iteration, []
    if i.predicted_cost is not None and i.real_cost is not None:
        low, high = sorted((max(i.predicted_cost, 1.0), max(i.real_cost, 1.0)))
        if high > COSTS_PART * low:
            found.append(
                f"The model of iteration {i.index} is far off: it expected a cost of {i.predicted_cost:.1f}, "
                f"the robot's was {i.real_cost:.1f}."
            )
    if i.tilt_band_widest is not None and tilt_limit is not None and i.tilt_band_widest > tilt_limit:
        found.append(
            f"The 95 % bands of iteration {i.index} say little: that of the tilt reaches "
            f"±{angle(i.tilt_band_widest)}, more than the tilt limit of ±{angle(tilt_limit)}. "
            "That real states lie in it is no merit."
        )
    if i.judged_success is not None and i.trials and abs(i.judged_success - i.successes / i.trials) > SHARES_PART:
        found.append(
            f"On the model of iteration {i.index}, {100 * i.judged_success:.0f} % of the long rollouts stay up; "
            f"the robot succeeded in {i.successes} of {i.trials} trials."
        )
    return found


def summary_table(summary: Summary) -> str:
    """The iterations as lines of plain text, the best one marked, and what to make of them."""
    rows = [_COLUMNS, *(_cells(iteration, summary.best_iteration) for iteration in summary.iterations)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(_COLUMNS))]
    lines = ["  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    best = summary.best
    notes = [f"Iteration {i.index}: {i.note}" for i in summary.iterations if i.note]
    warnings = [f"Warning: {doubt}" for doubt in warnings_on(summary, summary.iterations[-1])]
    lines += [
        *("", headline(summary), f"{driving(summary)} The stages took {summary.wall_s:.0f} s."),
        *notes,
        *warnings,
        f"Best policy: {best.policy.path} (sha256 {best.policy.sha256[:12]})",
    ]
    return "\n".join(lines)


def counted(number: int, thing: str) -> str:
    """`1 update`, `2 updates`."""
    return f"{number} {thing}" if number == 1 else f"{number} {thing}s"


def tilt_band(iteration: Iteration) -> str:
    """Half width of the predicted band of the tilt, its median and its widest, in degrees."""
    if iteration.tilt_band_median is None or iteration.tilt_band_widest is None:
        return "-"
    return f"±{angle(iteration.tilt_band_median)}, ±{angle(iteration.tilt_band_widest)}"


def _cells(iteration: Iteration, best: int) -> tuple[str, ...]:
    return (
        f"{'*' if iteration.index == best else ' '} {iteration.index}",
        "new" if iteration.same_policy_as is None else f"that of {iteration.same_policy_as}",
        f"{iteration.real_samples} samples, {iteration.real_seconds:.1f} s",
        _number(iteration.predicted_cost, ".1f"),
        _number(iteration.real_cost, ".1f"),
        f"{iteration.successes} of {iteration.trials}" if iteration.trials else "-",
        _number(iteration.trial_seconds, ".1f", " s"),
        _number(iteration.coverage95, ".2f"),
        tilt_band(iteration),
        _number(iteration.drift_m, ".2f", " m"),
        f"{iteration.fit_s:.1f} s",
        f"{iteration.search_s:.1f} s",
    )


def angle(radians: float) -> str:
    """In degrees, with two digits at least."""
    return f"{degrees(radians):.2g}°" if degrees(radians) < 10 else f"{degrees(radians):.0f}°"


def _number(value: float | None, form: str, unit: str = "") -> str:
    return "-" if value is None else f"{value:{form}}{unit}"
