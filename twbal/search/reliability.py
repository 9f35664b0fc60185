"""Probabilities of success, corrected by how often policies really succeed."""

import numpy as np
from scipy.special import expit, logit

AS_IT_IS = (0.0, 1.0)
"""Reliability of a probability that is not corrected."""

_LEAST_MEASURED = 0.1
_NEVER = (1e-6, 1.0 - 1e-6)


def success_probability(share: float, robots: int, reliability: tuple[float, float] = AS_IT_IS) -> float:
    """Probability of success of a policy under which a share of sampled robots succeeds, never 0 or 1.

    With k of n it is p = (k + ½) / (n + 1), the mean of Jeffreys' posterior: n robots do not tell a rare success from
    an impossible one (Brown, Cai and DasGupta, Interval estimation for a binomial proportion, Statistical Science
    2001). Where it was measured how often policies of a p succeed, it is corrected to 1 / (1 + exp(-a - b logit p))
    (J. Platt: Probabilistic outputs for support vector machines, Advances in Large Margin Classifiers, MIT Press 1999).
    No policy of a p below 0.1 was ever driven for that: there it falls to 0 in proportion to p.

    Args:
        share: of the sampled robots.
        robots: n.
        reliability: a and b.
    """
    intercept, slope = reliability
    smoothed = (share * robots + 0.5) / (robots + 1)
    found = expit(intercept + slope * logit(smoothed))
    if reliability != AS_IT_IS and smoothed < _LEAST_MEASURED:
        found = smoothed / _LEAST_MEASURED * expit(intercept + slope * logit(_LEAST_MEASURED))
    return float(np.clip(found, *_NEVER))
