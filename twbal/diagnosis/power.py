"""What the recordings would have shown: the probability that an effect of some size would have been found.

Had an effect been there, it would have changed the prediction errors. The score test computes that change, less what
everything else that is free makes up for; its squared length λ is what the effect would gain in -2 log likelihood, in
the mean. What one recording gains scatters about that. Where residual autocorrelation is φ, a gain over φ follows a
noncentral chi-squared distribution, with as many degrees of freedom as the effect has parameters, and the noncentrality
λ / φ (of a likelihood ratio: A. Wald, Transactions of the American Mathematical Society 54, 1943, 426-482; φ as in
quasi-likelihood). The effect is found where it gains so much that the set with it is likelier than the set without it.
"""

from collections.abc import Mapping, Sequence
from functools import cache

import numpy as np
from scipy.stats import chi2, ncx2

from twbal.core.gaussian import Array
from twbal.diagnosis.candidates import Candidate
from twbal.diagnosis.hypothesis import FittedHypothesis, bic_penalty
from twbal.diagnosis.power_record import DetectionPower, SizePower
from twbal.diagnosis.record import LIKELY
from twbal.diagnosis.score_test import ScoredCandidate
from twbal.sysid.likelihood import TAIL
from twbal.sysid.model import Data

_SIZES = (1 / 32, 1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0, 2.0)
"""Shares of the usual size for which the probability is said, as a rule."""

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
    shares: Sequence[float] = _SIZES,
) -> tuple[DetectionPower, ...]:
    """Of each effect beside a set, the probability that it would have been found, had it been there.

    Args:
        scored: candidates, scored beside the set.
        beside: the set.
        data: recordings.
        temperature: by which log likelihood ratios of sets are divided.
        log_odds: of a set with one more effect, before anything was recorded.
        shares: of the usual size, for which the probability is said.
    """
    found, per_gain = [], beside.autocorrelation * slope_excess(int(data.sensed.sum()))
    for each in scored:
        if each.candidate.in_data_sheet or not each.detectable:
            continue
        asked = bic_penalty([each.candidate], data.count) - 2.0 * temperature * log_odds
        asked /= beside.autocorrelation
        sizes = np.geomspace(_FINEST, max(each.detectable), _GRID)
        chances = _chances(each.candidate, gains_at(each.detectable, sizes) / per_gain, asked)
        enough = np.flatnonzero(chances >= _SURE)
        least = float(sizes[enough[0]]) if len(enough) else None
        said = _chances(each.candidate, gains_at(each.detectable, np.array(shares)) / per_gain, asked)
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
    known, gains = np.array([(0.0, 0.0), *sorted(detectable.items())]).T
    roots, last = np.sqrt(np.clip(gains, 0.0, _BOUND)), known[-1]
    return np.asarray(np.where(sizes <= last, np.interp(sizes, known, roots), roots[-1] * sizes / last) ** 2)


def value_at(candidate: Candidate, share: float) -> float:
    """Value of an effect's first parameter at a share of its usual size."""
    first = candidate.parameters[0]
    return float(first.none + share * (first.start - first.none))


def _chances(candidate: Candidate, gains: Array, asked: float) -> Array:
    """Probabilities that effects with such mean gains gain more than is asked for; all over the autocorrelation."""
    return np.asarray(ncx2.sf(asked, len(candidate.parameters), np.minimum(gains, _LARGEST)))


@cache
def slope_excess(channels: int) -> float:
    """By how much the squared slope of whitened errors exceeds the mean curvature of -2 log likelihood.

    Errors are weighted as of Student's t, and the squared slope of what is weighted so is more than the curvature where
    the noise is normal: by 19, 23 or 27 % for two, three or four channels.
    """

    def squared_slope(s: Array) -> Array:
        """Of r √(ρ(s) / s) by r, for s = |r|², over directions."""
        rho, slope = (TAIL + channels) * np.log1p(s / (TAIL - 2.0)), (TAIL + channels) / (TAIL - 2.0 + s)
        scale = np.sqrt(rho / s)
        bend = (slope / s - rho / s**2) / (2.0 * scale)
        return np.asarray(scale**2 + 4.0 * scale * bend * s / channels + 4.0 * bend**2 * s**2 / channels)

    def curvature(s: Array) -> Array:
        """Half of that of ρ(|r|²), over directions."""
        slope = (TAIL + channels) / (TAIL - 2.0 + s)
        return np.asarray(slope - 2.0 * slope * s / (channels * (TAIL - 2.0 + s)))

    expected = chi2(channels).expect
    return float(expected(squared_slope) / expected(curvature))
