"""Why a policy is driven, as far as its search told: what was expected of it, and what of the policies before it."""

from collections.abc import Sequence

from twbal.algorithm.iteration import Iteration, Reason
from twbal.algorithm.prediction import Assessment, Prediction

_COMPARED = (Reason.BETTER, Reason.AS_LIKELY, Reason.MARGIN)


def reason_for(index: int, recalibrates: bool, prediction: Prediction | None) -> Reason | None:
    """Why the policy of an iteration is driven.

    Args:
        index: of the iteration.
        recalibrates: the policy stays for its model to be learned again.
        prediction: what its search said; None where nothing was searched.

    Returns:
        None where an update makes its policy without a choice, as a regulator of what was identified.
    """
    if index == 0:
        return Reason.FIRST
    if recalibrates:
        return Reason.MODEL
    if prediction is None:
        return None
    if prediction.best.earlier is not None:
        return Reason.KEPT
    rival = best_earlier(prediction)
    if prediction.best.margin is not None:
        return Reason.MARGIN
    if rival is None:
        return Reason.ALONE
    is_better = round(prediction.best.judged_success, 1) > round(rival.judged_success, 1)
    return Reason.BETTER if is_better else Reason.AS_LIKELY


def best_earlier(prediction: Prediction) -> Assessment | None:
    """The earlier policy that the search ranked first; None where none was among its candidates."""
    return next((each for each in prediction.candidates if each.earlier is not None), None)


def reason_in_words(reason: Reason | None, prediction: Prediction | None, before: Sequence[Iteration]) -> str:
    """The numbers behind a choice between a new policy and an earlier one, as a sentence; empty where there was none.

    Args:
        reason: see `reason_for`.
        prediction: likewise.
        before: the iterations before this one.
    """
    if reason is Reason.ALONE:
        return "No earlier policy was a candidate: each was driven twice."
    if prediction is None or reason not in _COMPARED:
        return ""
    rival, left_out = best_earlier(prediction), _driven_twice(prediction, before)
    if rival is None or rival.earlier is None:
        return _without_rival(prediction.best, bool(left_out)) if reason is Reason.MARGIN else ""
    than = f"policy {before[rival.earlier].first_had}"
    said = _compared(reason, prediction.best, rival, than)
    return " ".join([said, *_not_compared(left_out)]) if said else ""


def _driven_twice(prediction: Prediction, before: Sequence[Iteration]) -> list[int]:
    """The policies that were driven for two iterations already and were no candidates, by their first iterations."""
    had = [iteration.first_had for iteration in before]
    judged = {had[each.earlier] for each in prediction.candidates if each.earlier is not None}
    return sorted(policy for policy in set(had) if had.count(policy) > 1 and policy not in judged)


def _not_compared(policies: Sequence[int]) -> list[str]:
    """A sentence that names the policies which were no candidates; none where all were."""
    if not policies:
        return []
    *others, last = map(str, policies)
    if others:
        return [f"Policies {', '.join(others)} and {last}, driven twice already, were no candidates."]
    return [f"Policy {last}, driven twice already, was no candidate."]


def _compared(reason: Reason, best: Assessment, rival: Assessment, than: str) -> str:
    """The numbers of a new policy and those of the best earlier one, which `than` names; empty where some are unknown.

    Args:
        reason: one that compares two policies.
        best: the new one.
        rival: the earlier one.
        than: its name.
    """
    if reason is Reason.MARGIN:
        return _margins(best, rival, than)
    ours, theirs = best.success_probability, rival.success_probability
    if ours is None or theirs is None:
        return ""
    if reason is Reason.BETTER:
        return f"Expected to be better: to succeed with probability {ours:.2f}, {than} with {theirs:.2f}."
    return (
        f"Expected to succeed about as often as {than} (probability {ours:.2f} and {theirs:.2f}); chosen as it ranks "
        "first by how the sampled robots balance."
    )


def _without_rival(best: Assessment, is_one_driven_twice: bool) -> str:
    """What a policy that was searched for margin is expected to do, and why no earlier one was a candidate."""
    whose = "of the others" if is_one_driven_twice else "of them"
    twice = "some were driven twice already, and " if is_one_driven_twice else ""
    return (
        f"Searched for more margin: it succeeds with {best.margin:.0%} of sampled robots that changed. No earlier "
        f"policy was a candidate: {twice}under each {whose} the robot fell in a trial, or its tilt oscillated in the "
        "worst one."
    )


def _margins(best: Assessment, rival: Assessment, than: str) -> str:
    """Under which robots that changed both succeed; empty where that was not asked of both."""
    if best.margin is None or rival.margin is None:
        return ""
    less = "; it ranks first as the robots use less of the limits under it" if best.margin <= rival.margin else ""
    return (
        f"Searched for more margin: it succeeds with {best.margin:.0%} of sampled robots that changed, {than} with "
        f"{rival.margin:.0%}{less}."
    )
