"""What a run of Algorithm 1 achieved, measured on its trials."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, isfinite, isinf

import numpy as np

from twbal.algorithm.iteration import Base, DiagnosisOutcome, Iteration, PolicyFile, Search
from twbal.algorithm.learned import LearnedPolicy, RunResult
from twbal.algorithm.prediction import Prediction
from twbal.algorithm.ranking import Shown
from twbal.algorithm.reasons import reason_for, reason_in_words
from twbal.algorithm.steps import K, M, P, R, S, Steps
from twbal.algorithm.summary import SimData, Summary
from twbal.core.channels import Channels
from twbal.core.cost import Cost
from twbal.core.coverage import coverage95, half_widths95
from twbal.core.episode import Episode
from twbal.core.evaluation import PlaceBy, SuccessCriterion, TrialVerdict, drift, judged, real_cost
from twbal.core.gaussian import Array
from twbal.core.scores import scores


@dataclass(frozen=True)
class Measures:
    """By what trials are measured.

    Attributes:
        rule: what makes a success.
        cost: of a state.
        horizon: over which costs are summed [control periods].
        channels: the state.
    """

    rule: SuccessCriterion
    cost: Cost
    horizon: int
    channels: Channels


@dataclass(frozen=True)
class IterationFindings:
    """One iteration.

    Attributes:
        iteration: its line of the summary.
        prediction: what the model expected; None where none was asked.
        trials: what the robot did.
    """

    iteration: Iteration
    prediction: Prediction | None
    trials: tuple[Episode, ...]


def findings(result: RunResult[R, M, P], steps: Steps[R, M, P, S, K], measures: Measures) -> list[IterationFindings]:
    """What is known of each policy.

    Args:
        result: what was learned.
        steps: that it was learned by.
        measures: by what to measure.
    """
    found: list[IterationFindings] = []
    for learned in result.policies:
        prediction = steps.prediction(learned.policy) if learned.predicted else None
        trials = () if learned.trials is None else steps.episodes([learned.trials])
        driven, policy = steps.episodes(learned.rollouts), steps.policy_file(learned.policy)
        before = [earlier.iteration for earlier in found]
        iteration = _iteration(learned, policy, prediction, driven, trials, measures, before)
        found.append(IterationFindings(iteration, prediction, trials))
    return found


def summarise(
    found: Sequence[IterationFindings],
    simulated: Sequence[Episode],
    robot: str,
    seed: int,
    wall_s: float,
    rule: SuccessCriterion,
    oscillation_limit: float | None,
) -> Summary:
    """The summary of a run.

    The best policy is the one with the largest share of successes over all of its trials. Among equals it is one
    under which the tilt oscillates by at most `oscillation_limit` [rad] in every trial, or the one under which it
    oscillates least, then one that no trial brings close to failing (`Shown`), both by the first trials of a
    policy. Among these it is the newest that was searched for margin and succeeds in all trials, or else the one
    with the lowest mean cost on the robot. Where nothing was tried, it is the newest of those that the long model
    rollouts liked best.
    """
    iterations = tuple(each.iteration for each in found)
    having: dict[int, list[Iteration]] = {}
    for iteration in iterations:
        having.setdefault(iteration.first_had, []).append(iteration)
    return Summary(
        robot=robot,
        seed=seed,
        wall_s=wall_s,
        sim=SimData(len(simulated), sum(map(len, simulated))),
        iterations=iterations,
        best_iteration=min(having, key=lambda policy: _rank(having[policy], oscillation_limit)),
        tilt_limit=rule.tilt_limit,
    )


def _rank(having: Sequence[Iteration], most: float | None) -> tuple[float, ...]:
    """Of a policy, by the iterations that had it; lower is better."""
    first, last = having[0].index, having[-1]
    tried = [iteration for iteration in having if iteration.trials_of is None]
    costs = [iteration.real_cost for iteration in tried if iteration.real_cost is not None]
    if not costs:
        return (0.0, 0.0, -(last.judged_success or 0.0), -first)
    share = sum(i.successes for i in tried) / sum(i.trials for i in tried)
    decisive = having[0]  # by whose trials a run decides which policy to recalibrate
    used = inf if decisive.used_worst is None else decisive.used_worst
    oscillation = inf if isinf(used) else decisive.oscillation_worst or 0.0
    shown = Shown(share, oscillation, used)
    has_margin = share == 1.0 and any(iteration.margin is not None for iteration in having)
    return (*shown.rank(most), -first if has_margin else 1.0, float(np.mean(costs)), first)


def _iteration(
    learned: LearnedPolicy[R, M, P],
    policy: PolicyFile,
    prediction: Prediction | None,
    driven: Sequence[Episode],
    trials: Sequence[Episode],
    measures: Measures,
    before: Sequence[Iteration],
) -> Iteration:
    channels = measures.channels
    costs = [real_cost(trial, measures.cost, measures.horizon) for trial in trials]
    bands = _tilt_bands(prediction, channels)
    verdicts = [judged(trial, measures.rule) for trial in trials]
    compared = trials if any(map(len, trials)) else ()  # of none but their first samples nothing was predicted
    iteration = Iteration(
        index=learned.index,
        real_episodes=len(driven),
        real_samples=sum(map(len, driven)),
        real_seconds=_duration(driven),
        predicted_cost=min(prediction.cost, float(measures.horizon)) if prediction else None,
        real_cost=float(np.mean(costs)) if costs else None,
        successes=sum(verdict.succeeded for verdict in verdicts),
        trials=len(trials),
        coverage95=coverage95(prediction.states, compared, channels.measured) if compared and prediction else None,
        fit_s=round(learned.fit_s, 3),
        search_s=round(learned.search_s, 3),
        drift_m=float(np.median([drift(trial, channels.wheel_radius) for trial in trials])) if trials else None,
        judged_success=prediction.best.judged_success if prediction else None,
        policy=policy,
        note="",
        trial_seconds=_duration(trials if learned.trials_of is None else ()),
        same_policy_as=next((i.index for i in before if i.policy.sha256 == policy.sha256), None),
        basis=learned.basis,
        search=_search(learned, prediction),
        diagnosis=learned.diagnosis,
        tilt_band_median=float(np.median(bands)) if len(bands) else None,
        tilt_band_widest=float(np.max(bands)) if len(bands) else None,
        success_probability=prediction.best.success_probability if prediction else None,
        reason=reason_for(learned.index, learned.recalibrates, prediction),
        base=learned.base if prediction else None,
        evidence_gain=learned.evidence_gain,
        log_evidences={str(base): value for base, value in learned.log_evidences.items()} or None,
        predicted_by=prediction.predictors[0].by if prediction else None,
        margin=prediction.best.margin if prediction else None,
        tilt_unknown=_tilt_unknown(prediction, channels),
        trials_of=learned.trials_of,
    )
    iteration = _with_scores(_with_parts(iteration, verdicts), prediction, compared, measures)
    notes = (
        _note(iteration, before, learned.searches),
        reason_in_words(iteration.reason, prediction, before),
        _predicted_by(prediction),
    )
    return replace(iteration, note=" ".join(filter(None, notes)))


def _with_scores(
    iteration: Iteration, prediction: Prediction | None, trials: Sequence[Episode], measures: Measures
) -> Iteration:
    """The iteration with the scores of its predicted bands; as it is without trials or a prediction."""
    if not trials or prediction is None:
        return iteration
    found = scores(prediction.states, trials, measures.channels.measured, np.asarray(measures.cost.widths))
    return iteration if found is None else replace(iteration, **found._asdict())


def _with_parts(iteration: Iteration, verdicts: Sequence[TrialVerdict]) -> Iteration:
    """The iteration with what its trials show part by part."""
    swings = [verdict.oscillation for verdict in verdicts if verdict.oscillation is not None]
    away = [verdict.farthest for verdict in verdicts if verdict.farthest is not None]
    place_sources = {verdict.place_by for verdict in verdicts if verdict.farthest is not None}
    used = max((verdict.used for verdict in verdicts), default=inf)
    return replace(
        iteration,
        upright=_count(verdict.upright for verdict in verdicts),
        settled=_count(verdict.settled for verdict in verdicts),
        in_place=_count(verdict.in_place for verdict in verdicts),
        quiet=_count(verdict.quiet for verdict in verdicts),
        place_by=PlaceBy.ODOMETRY if PlaceBy.ODOMETRY in place_sources else next(iter(place_sources), None),
        farthest_median_m=_median(away),
        farthest_worst_m=max(away, default=None),
        command_change=_median([v.command_change for v in verdicts if v.command_change is not None]),
        oscillation=_median(swings),
        oscillation_worst=max(swings, default=None),
        used_worst=used if isfinite(used) else None,
    )


def _count(shown: Iterable[bool | None]) -> int | None:
    """How many are so; None where it was not asked of all, or of none."""
    parts = list(shown)
    return None if not parts or None in parts else sum(map(bool, parts))


def _median(values: Sequence[float]) -> float | None:
    return float(np.median(values)) if values else None


def _search(learned: LearnedPolicy[R, M, P], prediction: Prediction | None) -> Search:
    """What the last search came to."""
    if prediction is None or learned.recalibrates:
        return Search.NOT_MADE
    return Search.FOUND if prediction.best.earlier is None else Search.KEPT


def _tilt_bands(prediction: Prediction | None, channels: Channels) -> Array:
    """Half widths of the predicted band of the tilt, at most π [rad]; empty without a prediction."""
    if prediction is None or "tilt" not in channels.names:
        return np.empty(0)
    return np.minimum(half_widths95(prediction.states, channels.names.index("tilt")), np.pi)


def _tilt_unknown(prediction: Prediction | None, channels: Channels) -> float | None:
    """Share of the tilt's variance that is due to what is not known; None without a prediction that tells it."""
    if prediction is None or "tilt" not in channels.names:
        return None
    return prediction.unknown_share(channels.names.index("tilt"))


def _note(iteration: Iteration, before: Sequence[Iteration], searches: int) -> str:
    """What a reader should know of it.

    Args:
        iteration: without its note.
        before: the iterations before it.
        searches: how many policy searches it took.
    """
    notes = []
    same = iteration.same_policy_as
    if iteration.recalibrates:
        seconds = iteration.real_seconds - before[-1].real_seconds
        notes.append(f"The same policy as iteration {same}; only the model is new, from {seconds:.1f} s more driving.")
    elif same is not None and iteration.search is Search.KEPT:
        notes.append(f"The same policy as iteration {same}: the search found nothing better.")
    elif same is not None:
        notes.append(f"The same policy as iteration {same}.")
    if iteration.trials_of is not None:
        notes.append(f"It was not tested again: the trials shown are those of iteration {iteration.trials_of}.")
    if iteration.base is not None and iteration.log_evidences is not None:
        notes.append(_base_in_words(iteration.base, iteration.log_evidences))
    if iteration.diagnosis is DiagnosisOutcome.USED and searches > 1:
        notes.append(f"Searched {searches} times: what came before did not balance in the corrected simulation.")
    better = [other for other in before if other.successes > iteration.successes]
    if better and same is None:
        best = max(better, key=lambda other: (other.successes, -other.index))
        notes.append(f"Worse on the robot than policy {best.first_had} ({best.successes} of {best.trials}).")
    return " ".join(notes)


def _base_in_words(kept: Base, log_evidences: Mapping[str, float]) -> str:
    """What g was learned on top of, and by how much each other candidate is behind, nearest first, in a sentence."""

    def place(base: str) -> str:
        return "without a simulation" if base == Base.NONE else f"on top of the f of the {base} simulation"

    behind = sorted((log_evidences[kept] - value, base) for base, value in log_evidences.items() if base != kept)
    others = " and ".join(f"by {nats:.0f} than {place(base)}" for nats, base in behind)
    return f"g was learned {place(kept)}: the log evidence of the rollouts is higher {others}."


def _predicted_by(prediction: Prediction | None) -> str:
    """Which of several predictions fits the rollouts of the policy best, as a sentence; empty where none was scored."""
    if prediction is None or len(prediction.predictors) < 2 or prediction.predictors[0].crps is None:
        return ""
    first, *others = prediction.predictors
    detail = f" ({first.detail})" if first.detail else ""
    rival = next((other for other in others if other.by is not first.by and other.crps is not None), None)
    than = f"; that of the {rival.by} {rival.crps:.2g}, with an expected cost of {rival.cost:.1f}" if rival else ""
    return (
        f"Of {len(others) + 1} predictions that of the {first.by}{detail} is taken: its CRPS on the calibration "
        f"rollouts is the lowest ({first.crps:.2g}{than})."
    )


def _duration(episodes: Sequence[Episode]) -> float:
    """How long the robot was driven in them [s]."""
    return round(sum((episode.duration for episode in episodes), 0.0), 6)
