"""Which of several policies is the best, by what their trials show."""

from math import inf

from twbal.algorithm.ranking import Shown, shown_by
from twbal.core.evaluation import TrialVerdict


def verdict(succeeded=True, oscillation=0.03, used=0.5):
    return TrialVerdict(succeeded, succeeded, None, None, None, None, None, oscillation, 10.0, used=used)


def test_the_worst_trial_counts():
    assert shown_by([verdict(), verdict(oscillation=0.05), verdict(used=0.7)]) == Shown(1.0, 0.05, 0.7)
    assert shown_by([verdict(), verdict(False, None, inf)]) == Shown(0.5, inf, inf)


def test_trials_that_are_too_short_to_show_an_oscillation_show_none():
    assert shown_by([verdict(oscillation=None), verdict(oscillation=None)]) == Shown(1.0, 0.0, 0.5)


def test_success_comes_before_oscillation_and_that_before_how_close_it_is_to_failing():
    ordered = [Shown(1.0, 0.05, 0.5), Shown(1.0, 0.05, 0.9), Shown(1.0, 0.05, 0.95), Shown(1.0, 0.12, 0.6)]
    ordered.append(Shown(1.0, 0.13, 0.5))
    ordered.append(Shown(0.9, 0.02, 0.5))
    ranks = [shown.rank(0.087) for shown in ordered]
    assert ranks == sorted(ranks)
    assert len(set(ranks)) == len(ranks)


def test_policies_that_are_far_from_failing_are_equal():
    assert Shown(1.0, 0.05, 0.5).rank(0.087) == Shown(1.0, 0.02, 0.8).rank(0.087)
    assert Shown(1.0, 0.2, 0.5).rank(None) == Shown(1.0, 0.02, 0.5).rank(None)
