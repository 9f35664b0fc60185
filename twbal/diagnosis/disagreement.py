"""Which recording disagrees with the others: in which value, by how much, and how surely.

All recordings of a fit share its values. Here one value of one recording may differ from that of the others by δ, while
all else stays shared and free; or it has an effect that the others do not have. One Gauss-Newton step from the fit
gives δ and its standard error (a score test; C. R. Rao: Large sample tests of statistical hypotheses concerning several
parameters with applications to problems of estimation, Mathematical Proceedings of the Cambridge Philosophical Society
44 (1), 1948, 50-57). The error is that of the curvature or that of the sandwich, whichever is wider (as in
`sysid.intervals`, with blocks inside of recordings). Of a recording's values, the one for which the data ask most
stands for it; but one that all share, if it does about as well. Its p-value is that of an error that is wider still, by
the share of its size by which the robot's form of an effect may differ from ours, or by the least size of an effect
that is worth naming: a difference that is sure but small does not count. It is multiplied by the number of values and
recordings (Bonferroni). The recording with the least one is left out, and the others are tested again.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.special import stdtr

from twbal.core.gaussian import Array
from twbal.diagnosis.candidates import Candidate
from twbal.diagnosis.data_sheet import DATA_SHEET
from twbal.diagnosis.follow_up import Disagreement
from twbal.diagnosis.hypothesis import FittedHypothesis
from twbal.diagnosis.model_comparison import ModelComparison
from twbal.sysid.intervals import curvature, prior_slopes
from twbal.sysid.model import Data, Field, Model, Offsets, offsets_of
from twbal.sysid.prediction_error_fit import Fit, slopes
from twbal.sysid.recording import Recording

_SURE = 0.05  # p-value below which a recording disagrees
_BLOCK = 0.5  # length of a block [s], long beside the time for which errors remember
_SMALL = 0.2  # share of its usual size at which an effect's slope is taken
_LEFT_OUT = 0.5  # a pseudoinverse times its matrix has 1 on the diagonal, and 0 for a direction that it left out
_LIKE = 0.9  # of the surest value's statistic, from which on another value explains a disagreement as well


class SharedValue(NamedTuple):
    """A value that may differ from recording to recording.

    Attributes:
        name: `effect.parameter`.
        unit: "" for a plain number.
        slope: (N,) of the whitened errors.
        fitted: to all recordings.
        form: standard deviation by which it may differ as the robot's form of the effect is not ours.
        sign: of differences that can be; 0: of either.
        is_shared: whether all recordings have it, and not one alone.
    """

    name: str
    unit: str
    slope: Array
    fitted: float
    form: float
    sign: float = 0.0
    is_shared: bool = True


class ValueDifference(NamedTuple):
    """By how much a value of one recording differs from that of the others.

    Attributes:
        value: which.
        delta: the difference, in the value's unit.
        error: its standard error by the data alone; infinite where they do not tell.
        freedom: degrees of freedom of that error.
    """

    value: SharedValue
    delta: float
    error: float
    freedom: int

    @property
    def size(self) -> float:
        """Of the difference; negative where it has a sign that cannot be."""
        return self.value.sign * self.delta if self.value.sign else abs(self.delta)

    @property
    def sigmas(self) -> float:
        """How much the data ask for it: its size in standard errors."""
        return self.size / self.error

    @property
    def wide(self) -> float:
        """Its standard error with that of the form."""
        return float(np.hypot(self.error, self.value.form))

    @property
    def p_value(self) -> float:
        """Probability of at least as large a difference, either way, if there is none (Student's t)."""
        return float(2.0 * stdtr(self.freedom, -self.size / self.wide))


@dataclass(frozen=True, eq=False)
class Pooled:
    """Several recordings about the values that are fitted to them together.

    Attributes:
        model: with these values.
        J: (N, P) slopes of the whitened errors.
        white: (N,) the errors.
        curvature: (P, P) of the prior.
        pull: (P,) half the slope of the prior's cost.
        blocks: of the errors of each recording.
        excess: as of `Data.slope_excess`.
    """

    model: Model
    J: Array
    white: Array
    curvature: Array
    pull: Array
    blocks: Sequence[Sequence[slice]]
    excess: float = 1.0

    def difference(self, number: int, value: SharedValue, left: Sequence[int]) -> ValueDifference:
        """Of a value in one recording from the others among those that are left."""
        H, gradient = np.zeros((self.J.shape[1] + 1,) * 2), np.zeros(self.J.shape[1] + 1)
        H[:-1, :-1] += self.curvature
        gradient[:-1] += self.pull
        parts = dict[int, Array]()
        for k in left:
            pulls = []
            for block in self.blocks[k]:
                own = value.slope[block] if k == number else np.zeros(block.stop - block.start)
                A = np.column_stack([self.J[block], own])
                pulls.append(A.T @ self.white[block])
                H += A.T @ A / self.excess
            parts[k] = np.array(pulls)
            gradient += parts[k].sum(axis=0)
        row = np.linalg.pinv(H, hermitian=True)[-1]
        variance = sum(_scatter(pulls @ row) for pulls in parts.values())
        is_identifiable = abs(float(H[-1] @ row) - 1.0) < _LEFT_OUT  # else the pseudoinverse left it out
        error = float(np.sqrt(max(row[-1], variance))) if is_identifiable else np.inf
        return ValueDifference(value, float(-row @ gradient), error, sum(len(pulls) - 1 for pulls in parts.values()))


def _scatter(pulls: Array) -> float:
    """Variance of a sum of independent parts, about their mean."""
    count = len(pulls)
    return count / max(count - 1, 1) * float(np.sum((pulls - pulls.mean()) ** 2))


def disagreements(comparison: ModelComparison, more: Sequence[Recording]) -> tuple[Disagreement, ...]:
    """Recordings that disagree with the others, the surest first; none of fewer than two.

    Args:
        comparison: of effects, with the recordings that were fitted.
        more: whole recordings that were not fitted.
    """
    data, chosen, allowed = comparison.data, comparison.chosen, comparison.allowed
    recordings = (*data.recordings, *more)
    if len(recordings) < 2:
        return ()
    data = replace(data, recordings=recordings)
    pooled = _pooled(data, chosen.fit)
    values = [*_shared(chosen, pooled, allowed), *_added(data, chosen, pooled, comparison.candidates, allowed)]
    left, found = list(range(len(recordings))), list[Disagreement]()
    while len(left) > 1:
        tested = {k: [pooled.difference(k, value, left) for value in values] for k in left}
        explaining = {k: _explaining(tested[k]) for k in left}
        number = min(left, key=lambda k: explaining[k][0].p_value)
        worst, *alike = explaining[number]
        p_value = min(worst.p_value * len(left) * len(values), 1.0)
        if not p_value < _SURE:
            break
        left.remove(number)
        found.append(
            Disagreement(
                recording=recordings[number].name,
                others=tuple(recordings[k].name for k in left),
                parameter=worst.value.name,
                fitted=worst.value.fitted,
                difference=worst.delta,
                error=worst.wide,
                unit=worst.value.unit,
                p_value=p_value,
                alike=tuple(each.value.name for each in alike),
            )
        )
    return tuple(found)


def _explaining(tested: Sequence[ValueDifference]) -> list[ValueDifference]:
    """The differences that explain a recording about as well as the best one, shared values first."""
    most = max(each.sigmas for each in tested)
    found = [each for each in tested if each.sigmas >= _LIKE * most]
    return sorted(found, key=lambda each: (not each.value.is_shared, -each.sigmas))


def _shared(chosen: FittedHypothesis, pooled: Pooled, allowed: Mapping[Field, float]) -> list[SharedValue]:
    """Parameters of effects, but for frequencies and phases of waves, and values of the data sheet."""
    model, found = chosen.fit.model, []
    columns = {free.field: i for i, free in enumerate(chosen.fit.free_parameters)}
    for candidate in chosen.candidates:
        for p in candidate.parameters[:1] if candidate.is_wave else candidate.parameters:
            field = candidate.field(p)
            fitted = model.value(field)
            slope = pooled.J[:, columns[field]]
            found.append(SharedValue(f"{candidate.name}.{p.name}", p.unit, slope, fitted, allowed[field]))
    for field, factor in DATA_SHEET.items():
        if factor.effect not in chosen.names:
            slope = pooled.J[:, columns[field]]
            found.append(
                SharedValue(f"{factor.effect}.{factor.parameter}", "", slope, model.value(field), allowed[field])
            )
    return found


def _added(
    data: Data,
    chosen: FittedHypothesis,
    pooled: Pooled,
    candidates: Sequence[Candidate],
    allowed: Mapping[Field, float],
) -> list[SharedValue]:
    """Sizes of effects that the set does not have, but for waves, limits and values of the data sheet."""
    found = []
    for candidate in candidates:
        size = candidate.parameters[0]
        if candidate.name in chosen.names or candidate.in_data_sheet or candidate.is_wave or size.is_limit:
            continue
        step = _SMALL * (size.start - size.none)
        if size.low < size.none:  # a tangent, as of offsets of recordings, some of which do the same
            step = candidate.free_parameters[0].nudge
        values = {candidate.field(p): p.start for p in candidate.parameters} | {candidate.field(size): size.none + step}
        slope = (data.white(pooled.model.put(values), chosen.fit.kalman) - pooled.white) / step
        if np.isfinite(slope).all():
            form = allowed[candidate.field(size)]
            sign = float(np.sign(step)) if size.none <= size.low else 0.0
            found.append(SharedValue(f"{candidate.name}.{size.name}", size.unit, slope, size.none, form, sign, False))
    return found


def _pooled(data: Data, fit: Fit) -> Pooled:
    """Recordings about a fit to the first of them."""
    free_parameters, model = fit.free_parameters, fit.model
    if model.offsets:
        known = len(model.offsets)
        more = range(known, len(data.recordings))
        free_parameters = (*free_parameters, *offsets_of(free_parameters, more))
        model = model._replace(offsets=(*model.offsets, *(Offsets() for _ in more)))
    white = data.white(model, fit.kalman)
    J = slopes(data, model, fit.kalman, free_parameters, white)
    ends = np.cumsum([0, *(len(recording) for recording in data.recordings)])
    blocks = [_blocks(begin, end, data.period) for begin, end in pairwise(ends.tolist())]
    prior, pull = curvature(free_parameters, J[:0]), prior_slopes(free_parameters, model)
    return Pooled(model, J, white, prior, pull, blocks, data.slope_excess)


def _blocks(begin: int, end: int, period: float) -> list[slice]:
    """Those of a recording between two instants, of about `_BLOCK` each, of flat errors."""
    count = max(round((end - begin) * period / _BLOCK), 2)
    edges = np.linspace(begin, end, count + 1).astype(int) * 4
    return [slice(a, b) for a, b in pairwise(edges.tolist())]
