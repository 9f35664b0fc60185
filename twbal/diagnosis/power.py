"""What the recordings would have shown: the probability that an effect of some size would have been found.

Had an effect been there, it would have changed the prediction errors. The score test computes that change, less what
everything else that is free makes up for; its squared length λ is what the effect would gain in -2 log likelihood, in
the mean. What one recording gains scatters about that. Where residual autocorrelation is φ, a gain over φ follows a
noncentral chi-squared distribution, with as many degrees of freedom as the effect has parameters, and the noncentrality
λ / φ (of a likelihood ratio: A. Wald, Transactions of the American Mathematical Society 54, 1943, 426-482; φ as in
quasi-likelihood). The effect is found where it gains so much that the set with it is likelier than the set without it.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.stats import ncx2

from twbal.core.gaussian import Array
from twbal.diagnosis.candidates import Candidate
from twbal.diagnosis.hypothesis import FittedHypothesis, bic_penalty
from twbal.diagnosis.power_record import DetectionPower, SizePower
from twbal.diagnosis.record import LIKELY
from twbal.diagnosis.score_test import ScoredCandidate
from twbal.sysid.model import Data

_SIZES = (1 / 32, 1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0, 2.0)
_LIMITS = (1 / 4, 1 / 2, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
"""Shares of the usual size for which the probability is said; of a limit, the usual value over its own."""

_SURE = 0.8
"""Probability of the least size that is said: a usual one in the design of experiments."""

_LARGEST, _BOUND = 1e6, 1e12  # gains over the autocorrelation, and gains, beyond which more makes no difference
_FINEST, _GRID = 1e-3, 400  # least share of the usual size that is tried for it, and how many are tried


def detection_power(
    scored: Sequence[ScoredCandidate],
    beside: FittedHypothesis,
    data: Data,
    temperature: float,
    log_odds: float,
    shares: Sequence[float] = (),
) -> tuple[DetectionPower, ...]:
    """Of each effect beside a set, the probability that it would have been found, had it been there.

    Args:
        scored: candidates, scored beside the set.
        beside: the set.
        data: recordings.
        temperature: by which log likelihood ratios of sets are divided.
        log_odds: of a set with one more effect, before anything was recorded.
        shares: of the usual size, for which the probability is said; of none, those that are usual.
    """
    found, per_gain = [], beside.autocorrelation * data.slope_excess
    for each in scored:
        if each.candidate.in_data_sheet or not each.detectable:
            continue
        asked = bic_penalty([each.candidate], data.count) - 2.0 * temperature * log_odds
        asked /= beside.autocorrelation
        sizes = np.geomspace(_FINEST, max(each.detectable), _GRID)
        chances = _chances(each.candidate, gains_at(each.detectable, sizes) / per_gain, asked)
        enough = np.flatnonzero(chances >= _SURE)
        least = float(sizes[enough[0]]) if len(enough) else None
        these = shares or (_LIMITS if each.candidate.parameters[0].is_limit else _SIZES)
        ways = np.array([way_to(each.candidate, value_at(each.candidate, share)) for share in these])
        said = _chances(each.candidate, gains_at(each.detectable, ways) / per_gain, asked)
        found.append(
            DetectionPower(
                name=each.candidate.name,
                parameter=each.candidate.parameters[0].name,
                unit=each.candidate.parameters[0].unit,
                usual=value_at(each.candidate, 1.0),
                least=None if least is None else _value_on_way(each.candidate, least),
                sizes=tuple(
                    SizePower(share, value_at(each.candidate, share), float(chance))
                    for share, chance in zip(these, said, strict=True)
                ),
            )
        )
    return tuple(sorted(found, key=lambda power: power.name))


def unseen(powers: Sequence[DetectionPower]) -> list[DetectionPower]:
    """Effects that would more likely not have been found, had they been there at their usual size."""
    return [power for power in powers if power.at_usual < LIKELY]


def gains_at(detectable: Mapping[float, float], sizes: Array) -> Array:
    """Gain in -2 log likelihood of an effect of each size: its square root is linear between sizes that are known.

    Beyond the largest of them it goes on as to first order.

    Args:
        detectable: gain by size, as of `ScoredCandidate`.
        sizes: as shares of the usual size.
    """
    known, gains = np.array([(0.0, 0.0), *sorted(detectable.items())]).T
    roots, last = np.sqrt(np.clip(gains, 0.0, _BOUND)), known[-1]
    return np.asarray(np.where(sizes <= last, np.interp(sizes, known, roots), roots[-1] * sizes / last) ** 2)


def value_at(candidate: Candidate, share: float) -> float:
    """Value of an effect's first parameter at a share of its usual size: a limit of twice the size is half as high."""
    first = candidate.parameters[0]
    return float(first.start / share) if first.is_limit else _value_on_way(candidate, share)


def way_to(candidate: Candidate, value: float) -> float:
    """How far a value of the first parameter is on the way from none to the usual one, and beyond it."""
    first = candidate.parameters[0]
    return (value - first.none) / (first.start - first.none)


def _value_on_way(candidate: Candidate, way: float) -> float:
    first = candidate.parameters[0]
    return float(first.none + way * (first.start - first.none))


def _chances(candidate: Candidate, gains: Array, asked: float) -> Array:
    """Probabilities that effects with such mean gains gain more than is asked for; all over the autocorrelation."""
    return np.asarray(ncx2.sf(asked, len(candidate.parameters), np.minimum(gains, _LARGEST)))
