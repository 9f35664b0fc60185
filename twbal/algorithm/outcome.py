"""What a run of Algorithm 1 came to, in words: the same for the terminal and the report.

Every sentence is made from what `summary.json` notes of each iteration, none from the method that was asked for.
"""

from math import degrees
from statistics import median

from twbal.algorithm.iteration import Iteration
from twbal.algorithm.summary import Summary
from twbal.algorithm.tables import angle, iterations_table, trials_table
from twbal.core.evaluation import PlaceBy, SuccessCriterion
from twbal.core.text import counted

COSTS_PART = 3.0
"""By this factor predicted and real cost must differ for a warning; costs below 1, one lost step, count as 1."""
SHARES_PART = 0.5
"""By this much the shares of successes in long model rollouts and in real trials must differ for a warning."""

SCORES_PART = 2.0
"""By this factor the CRPS of the predicted bands must exceed that of the trials' own spread for a warning."""


def headline(summary: Summary) -> str:
    """Whether the robot is balanced, by which policy, and what that policy was learned from."""
    best = summary.best
    successes, trials = summary.count(best.index)
    if not trials:
        return f"No trial was driven, so nothing is known of how policy {best.index} balances the robot."
    if not successes:
        driven, upright = sum(each.own_trials for each in summary.iterations), summary.parts(best.index)
        fails = "stays upright, but not as is asked" if upright.get("upright") == trials else "is not balanced"
        return f"The robot {fails}: no policy succeeded in any of {counted(driven, 'trial')}.{_parts(summary)}"
    if successes == trials:
        said = "The robot is balanced: policy"
    elif summary.solved:
        said = "The robot is balanced in most trials: policy"
    else:
        return (
            f"The robot is not reliably balanced: the best, policy {best.index}, succeeded in {successes} of {trials} "
            f"trials. {_learned_from(summary)}{_parts(summary)}"
        )
    return f"{said} {best.index} succeeded in {successes} of {trials} trials. {_learned_from(summary)}{_place(summary)}"


def rule_in_words(rule: SuccessCriterion, control_period: float) -> str:
    """When a trial succeeds, as a sentence.

    Args:
        rule: the criterion.
        control_period: of the robot [s].
    """
    settle, place, end = (f"{control_period * n:.3g} s" for n in (rule.settle_step, rule.place_step, rule.steps))
    parts = [f"the tilt stays within {_degrees(rule.tilt_limit)} for {end}"]
    if rule.settled_tilt_limit < rule.tilt_limit or rule.settle_step < rule.steps:
        parts.append(f"under {_degrees(rule.settled_tilt_limit)} from {settle} on")
    if rule.place_limit is not None:
        parts.append(f"the robot is within {rule.place_limit:.3g} m of where it was put from {place} on")
    if rule.command_change is not None:
        share = f"{rule.command_change:.3g} of the torque limit"
        parts.append(f"the command changes by less than {share} from step to step from {settle} on (root mean square)")
    *firsts, last = parts
    return f"A trial succeeds when {', '.join(firsts)}{', and ' if firsts else ''}{last}."


def _parts(summary: Summary) -> str:
    """What the trials of the best policy show of each part of a success; empty where that is not noted."""
    best = summary.best.index
    shown = [f"{count} are {part}" for part, count in summary.parts(best).items()]
    if not shown:
        return ""
    trials = summary.count(best).trials
    return f" Of the {counted(trials, 'trial')} of policy {best}, {', '.join(shown)}."


def _place(summary: Summary) -> str:
    """How far from where it was put the best policy lets the robot go, in all of its trials."""
    best, tried = summary.best, [i for i in summary.tried(summary.best.index) if i.trials]
    medians = [i.farthest_median_m for i in tried if i.farthest_median_m is not None]
    worst = max((i.farthest_worst_m for i in tried if i.farthest_worst_m is not None), default=None)
    if not medians or worst is None:
        return "" if best.drift_m is None else f" In a trial it rolled {best.drift_m:.1f} m away (median)."
    place_source = "odometry" if best.place_by is PlaceBy.ODOMETRY else "its true pose"
    return (
        f" Late in a trial it was at most {median(medians):.2f} m from where it was put (median; "
        f"{worst:.2f} m in the worst), by {place_source}."
    )


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
    """Warnings where the prediction of an iteration and the robot part, or where the prediction says nothing.

    Args:
        iteration: with its prediction and trials; a warning is left out where one of them is missing.
        tilt_limit: beyond which the robot has fallen [rad].
    """
    i, found = iteration, []
    if i.predicted_cost is not None and i.real_cost is not None:
        low, high = sorted((max(i.predicted_cost, 1.0), max(i.real_cost, 1.0)))
        if high > COSTS_PART * low:
            found.append(
                f"The prediction of iteration {i.index} is far off: it expected a cost of {i.predicted_cost:.1f}, "
                f"the robot's was {i.real_cost:.1f}."
            )
    if i.tilt_band_widest is not None and tilt_limit is not None and i.tilt_band_widest > tilt_limit:
        found.append(
            f"The 95 % bands of iteration {i.index} say little: that of the tilt reaches "
            f"±{angle(i.tilt_band_widest)}, more than the tilt limit of ±{angle(tilt_limit)}. "
            "That real states lie in it is no merit."
        )
    if i.crps_ratio is not None and i.crps_ratio > SCORES_PART:
        found.append(
            f"The predicted bands of iteration {i.index} have {i.crps_ratio:.1f} times the CRPS of the trials' own "
            "spread: they lie beside what the robot does, or are wider."
        )
    if i.judged_success is not None and i.trials and abs(i.judged_success - i.successes / i.trials) > SHARES_PART:
        found.append(
            f"Of iteration {i.index}, {100 * i.judged_success:.0f} % of the long simulated rollouts succeed; "
            f"the robot succeeded in {i.successes} of {i.trials} trials."
        )
    return found


def summary_table(summary: Summary) -> str:
    """The iterations as lines of plain text, the best one marked, and what to make of them."""
    trials, best = trials_table(summary), summary.best
    notes = [f"Iteration {i.index}: {i.note}" for i in summary.iterations if i.note]
    warnings = [f"Warning: {doubt}" for doubt in warnings_on(summary, summary.iterations[-1])]
    lines = [
        *iterations_table(summary),
        *(["", *trials] if trials else []),
        *("", headline(summary), f"{driving(summary)} Learning took {summary.wall_s:.0f} s."),
        *notes,
        *warnings,
        f"Best policy: {best.policy.path} (sha256 {best.policy.sha256[:12]})",
    ]
    return "\n".join(lines)


def _degrees(radians: float) -> str:
    return f"{degrees(radians):.3g}°"
