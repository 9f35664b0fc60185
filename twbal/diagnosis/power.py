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
from twbal.diagnosis.record import LIKELY, DetectionPower, SizePower
from twbal.diagnosis.score_test import ScoredCandidate

_SIZES = (1 / 32, 1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0, 2.0)
"""Shares of the usual size for which the probability is said, as a rule."""

_SURE = 0.8
"""Probability of the least size that is said: a usual one in the design of experiments."""

_FINEST, _GRID = 1e-3, 400  # least share of the usual size that is tried for it, and how many are tried


def detection_power(
    scored: Sequence[ScoredCandidate],
    beside: FittedHypothesis,
    count: int,
    temperature: float,
    log_odds: float,
    shares: Sequence[float] = _SIZES,
) -> tuple[DetectionPower, ...]:
    """Of each effect beside a set, the probability that it would have been found, had it been there.

    Args:
        scored: candidates, scored beside the set.
        beside: the set.
        count: instants of the recordings.
        temperature: by which log likelihood ratios of sets are divided.
        log_odds: of a set with one more effect, before anything was recorded.
        shares: of the usual size, for which the probability is said.
    """
    found = []
    for each in scored:
        if each.candidate.in_data_sheet or not each.detectable:
            continue
        asked = bic_penalty([each.candidate], count) - 2.0 * temperature * log_odds
        sizes = np.geomspace(_FINEST, max(each.detectable), _GRID)
        chances = _chances(each.candidate, gains_at(each.detectable, sizes), asked, beside.autocorrelation)
        enough = np.flatnonzero(chances >= _SURE)
        least = float(sizes[enough[0]]) if len(enough) else None
        said = _chances(each.candidate, gains_at(each.detectable, np.array(shares)), asked, beside.autocorrelation)
        found.append(
            DetectionPower(
                name=each.candidate.name,
                parameter=each.candidate.parameters[0].name,
                unit=each.candidate.parameters[0].unit,
                usual=value_at(each.candidate, 1.0),
                least=None if least is None else value_at(each.candidate, least),
                sizes=tuple(
                    SizePower(share, value_at(each.candidate, share), float(chance))
                    for share, chance in zip(shares, said, strict=True)
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
    known = np.array([(0.0, 0.0), *sorted((size, np.sqrt(max(gain, 0.0))) for size, gain in detectable.items())])
    last, largest = known[-1]
    return np.asarray(np.where(sizes <= last, np.interp(sizes, *known.T), largest * sizes / last) ** 2)


def value_at(candidate: Candidate, share: float) -> float:
    """Value of an effect's first parameter at a share of its usual size."""
    first = candidate.parameters[0]
    return float(first.none + share * (first.start - first.none))


def _chances(candidate: Candidate, gains: Array, asked: float, autocorrelation: float) -> Array:
    """Probabilities that effects which gain so much in the mean gain more than is asked for."""
    freedom = len(candidate.parameters)
    return np.asarray(ncx2.sf(asked / autocorrelation, freedom, np.minimum(gains / autocorrelation, 1e6)))
