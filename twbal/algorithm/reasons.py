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
    if reason is Reason.MARGIN and prediction is not None and best_earlier(prediction) is None:
        return (
            f"Searched for more margin: it succeeds with {prediction.best.margin:.0%} of sampled robots that changed. "
            "No earlier policy was a candidate: under each of them the robot fell in a trial, or its tilt oscillated "
            "in the worst one."
        )
    rival = best_earlier(prediction) if prediction is not None else None
    if prediction is None or rival is None or rival.earlier is None or reason not in _COMPARED:
        return ""
    than = f"policy {before[rival.earlier].first_had}"
    if reason is Reason.MARGIN:
        return _margins(prediction.best, rival, than)
    ours, theirs = prediction.best.success_probability, rival.success_probability
    if ours is None or theirs is None:
        return ""
    if reason is Reason.BETTER:
        return f"Expected to be better: to succeed with probability {ours:.2f}, {than} with {theirs:.2f}."
    return (
        f"Expected to succeed about as often as {than} (probability {ours:.2f} and {theirs:.2f}); chosen as it ranks "
        "first by how the sampled robots balance."
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
