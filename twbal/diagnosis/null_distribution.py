"""What chance alone makes the best candidate score: its null distribution, by simulation, to first order.

Where nothing is missing beside a set, its whitened prediction errors are white. A candidate that is small changes them
along one direction, of which a part is left that nothing else that is free makes up for. What it gains in -2 log
likelihood is then the squared length of the errors' projection on that part: of one direction a chi-squared variable.
The projections on all directions of all candidates are normal, with the directions' inner products as covariance. So
they are drawn as they are, without a series and without a fit, and the best score of each draw is kept. Commands and
noise are in the directions.

Limits, and what begins with a kink, change the errors along other directions where they are larger; some sizes are
tried of each, and the best counts. Of a wave the direction is a plane, as its phase is free, and its frequency is
searched: the largest of as many independent planes as S. O. Rice's rate of upcrossings gives (Bell System Technical
Journal 24, 1945, 46-156): about three for each period that the recordings tell apart.

Errors of real robots stay autocorrelated, and gain more by as much; a score is a gain, less the penalty, over the
residual autocorrelation. And a robot's form of an effect is never ours: what that leaves gains, too. So for least
scores gains are multiplied by a factor, the setting `temperature`. Of an effect with several parameters only the first
one is moved, so what chance makes of the others is left out.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array
from twbal.core.threads import in_threads
from twbal.diagnosis.candidates import Candidate, CandidateParameter
from twbal.diagnosis.hypothesis import FittedHypothesis, bic_penalty
from twbal.diagnosis.linear_errors import slopes_by
from twbal.diagnosis.null_record import NullScore
from twbal.diagnosis.score_test import ScoredCandidate, resonance_frequencies, sizes_of, values_of
from twbal.diagnosis.settings import LeastScores
from twbal.sysid.likelihood import weights_of, whitened
from twbal.sysid.model import Data

_DRAWS = 10_000
_SMALL_AND_LARGE = (0.001, 0.4, 1.0)  # sizes of what is no limit, as shares of its start values
_PLANES = 3.0  # independent planes for each period that the recordings tell apart
_ALONE = 1e-4  # least share of a change, as of lengths, that nothing else may make up for
_DIVERGED = 1e100  # errors from which on predictions diverge, and squares overflow
_SEED = 0
_RIDGE = 1e-3  # of what has no prior, as of `sysid.intervals`
_JITTER = 1e-9  # added to the variances of directions, some of which are the same


class NullDistribution(NamedTuple):
    """Scores of the best candidate in draws in which nothing is missing.

    Attributes:
        effects: (n,) of the best effect.
        data_sheet: (n,) of the best value of the data sheet.
        gains: by name of an effect that is no wave, what the recorded errors gain in the same way, over their
            autocorrelation.
    """

    effects: Array
    data_sheet: Array
    gains: Mapping[str, float]

    def exceeded_with(self, probability: float) -> LeastScores:
        """Scores that the best candidate exceeds with a probability; none is worth its penalty below a score of 0."""
        known = np.maximum([self.effects, self.data_sheet], 0.0)
        return LeastScores(*np.quantile(known, 1.0 - probability, axis=1).tolist())


class _Directions(NamedTuple):
    """Along which a candidate changes the whitened errors, each of length 1.

    Attributes:
        candidate: which.
        rows: (m, N + P), of the errors and of the priors of what is free.
        recorded: (m,) projections of the recorded errors on these, against the direction of a positive size.
    """

    candidate: Candidate
    rows: Array
    recorded: Array

    def gain(self, projections: Array) -> Array:
        """Gains (n,) by projections on the directions (n, m): a positive size answers errors against it."""
        kept = projections if _has_two_sides(self.candidate.parameters[0]) else np.maximum(projections, 0.0)
        return np.asarray((kept**2).max(axis=1))


def null_distribution(
    data: Data,
    beside: FittedHypothesis,
    candidates: Sequence[Candidate],
    along: Mapping[str, float],
    temperature: float,
    autocorrelation: float = 1.0,
) -> NullDistribution:
    """The null distribution of the best score of candidates beside a set.

    Args:
        data: recordings.
        beside: the set.
        candidates: that it does not hold.
        along: how far the recordings go, by the parameter of a wave that counts its periods there (`Extent.along`).
        temperature: factor on gains by chance.
        autocorrelation: of the residuals, over which scores are counted.
    """
    generator = np.random.default_rng(_SEED)
    known = [each for each in _directions(data, beside, candidates) if len(each.rows)]
    best = {True: np.full(_DRAWS, -np.inf), False: np.full(_DRAWS, -np.inf)}

    def add(candidate: Candidate, gains: Array) -> None:
        of = best[candidate.in_data_sheet]
        penalty = bic_penalty([candidate], data.count) / autocorrelation
        np.maximum(of, temperature * gains - penalty, out=of)

    if known:
        rows = np.concatenate([each.rows for each in known])
        root = np.linalg.cholesky(rows @ rows.T + _JITTER * np.eye(len(rows)))
        drawn = generator.standard_normal((_DRAWS, len(rows))) @ root.T
        begin = 0
        for each in known:
            add(each.candidate, each.gain(drawn[:, begin : begin + len(each.rows)]))
            begin += len(each.rows)
    for candidate in candidates:
        if candidate.is_wave:
            add(candidate, _largest_of_planes(_planes(candidate, along), generator.random(_DRAWS)))
    gains = {each.candidate.name: float(each.gain(each.recorded[None])[0]) / autocorrelation for each in known}
    return NullDistribution(best[False], best[True], gains)


def null_score(
    data: Data, null: NullDistribution, scored: Sequence[ScoredCandidate], beside: FittedHypothesis
) -> NullScore | None:
    """What the best effect scores beside a set, and how often chance alone makes one score more; None of no effects.

    To first order, as the null distribution; of waves by their fit.

    Args:
        data: recordings.
        null: distribution beside the set.
        scored: candidates, scored beside the set.
        beside: the set.
    """
    scores = {
        each.candidate.name: null.gains.get(each.candidate.name, max(each.gain, 0.0) / beside.autocorrelation)
        - bic_penalty([each.candidate], data.count) / beside.autocorrelation
        for each in scored
        if not each.candidate.in_data_sheet
    }
    if not (scores and np.isfinite(null.effects).all()):
        return None
    best = max(scores, key=lambda name: scores[name])
    above = int((null.effects >= scores[best]).sum())
    median, high = (float(each) for each in np.quantile(null.effects, (0.5, 0.99)))
    return NullScore(best, scores[best], (above + 1) / (len(null.effects) + 1), median, high)


def _directions(data: Data, beside: FittedHypothesis, candidates: Sequence[Candidate]) -> list[_Directions]:
    """Of all candidates that are no waves, without what else is free can make up for.

    The priors of what is free are P errors more, beside the N of the recordings: of unit variance, too, where nothing
    is missing. A candidate that is free already within its prior is one without it.
    """
    fit = beside.fit
    errors = data.errors(fit.model, fit.kalman)
    weights = weights_of(errors, data.usable, fit.kalman)
    slopes = in_threads(lambda free: slopes_by(free, data, fit.model, fit.kalman, errors), fit.free_parameters)
    J = np.array([whitened(fit.kalman, weights, each) for each in slopes])  # (P, N)
    shifts = [(fit.model.value(free.field) - free.mean) / free.sd for free in fit.free_parameters]
    recorded = np.append(whitened(fit.kalman, weights, errors), shifts)
    priors = np.diag([1.0 / free.sd + _RIDGE / (free.high - free.low) for free in fit.free_parameters])
    taken = np.linalg.qr(np.hstack([J, priors]).T)[0].T  # orthonormal rows

    def of(candidate: Candidate) -> _Directions:
        own = [i for i, free in enumerate(fit.free_parameters) if free.field in values_of(candidate, "start")]
        changes = [np.append(np.zeros(J.shape[1]), priors[i] / priors[i, i]) for i in own]
        for values in () if own else _tried(candidate):
            moved = data.errors(fit.model.put(values), fit.kalman)
            if all(np.abs(each).max() < _DIVERGED for each in moved):  # nor any that is no number
                change = whitened(fit.kalman, weights, [a - b for a, b in zip(moved, errors, strict=True)])
                changes.append(np.append(change, np.zeros(len(J))))
        rows = []
        for change in changes:
            left = change - taken.T @ (taken @ change)
            length, whole = np.linalg.norm(left), np.linalg.norm(change)
            if length > _ALONE * whole:
                rows.append(left / length)
        own_rows = np.array(rows).reshape(len(rows), taken.shape[1])
        return _Directions(candidate, own_rows, -own_rows @ recorded)

    return in_threads(of, [candidate for candidate in candidates if not candidate.is_wave])


def _tried(candidate: Candidate) -> list[dict[str, float]]:
    """Values of a candidate at the sizes, or frequencies, that are tried, by field."""
    none, start, low, high = (values_of(candidate, which) for which in ("none", "start", "low", "high"))
    sizes = sizes_of(candidate) if candidate.parameters[0].is_limit else _SMALL_AND_LARGE
    found = [{f: min(max(none[f] + size * (start[f] - none[f]), low[f]), high[f]) for f in start} for size in sizes]
    if candidate.resonance is None:
        return found
    field = candidate.field(candidate.resonance)
    return [{**found[0], field: frequency} for frequency in resonance_frequencies(candidate.resonance)]


def _has_two_sides(size: CandidateParameter) -> bool:
    """Whether it may be more or less than nothing."""
    return size.low < size.none < size.high


def _planes(candidate: Candidate, along: Mapping[str, float]) -> float:
    """Independent planes among which a wave is looked for."""
    counter = candidate.counter
    if counter is None:
        return 1.0
    return 1.0 + _PLANES * (counter.high - counter.low) * along[counter.name]


def _largest_of_planes(planes: float, uniform: Array) -> Array:
    """Largest of so many chi-squared variables of two degrees of freedom, by uniform ones."""
    return np.asarray(-2.0 * np.log1p(-(uniform ** (1.0 / planes))))
