"""The correction of probabilities that makes what happened likeliest."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit, logit

from twbal.core.files import file_hash
from twbal.core.gaussian import Array, Mask
from twbal.diagnosis.calibration import EDGE, Bin, Calibration, FittedOn, Objected

_BEFORE = {
    Objected.NOTHING: 0.98,
    Objected.OTHERS: 0.87,
    Objected.EFFECT: 0.31,
}
"""Means of the priors of the shares, by hand."""

_SD = 1.0  # of the prior of all coefficients, in log odds; those of intercept and slope are about no correction
_FOLDS = 5  # into which robots are divided for the reliability
_LEAST = 0.01  # probability from which on an effect is counted
_IMPOSSIBLE = 1e-9  # least likelihood that is told from 0


class _Pairs(NamedTuple):
    """Robots and effects.

    Attributes:
        robot: (N,) number of the robot.
        odds: (N,) log odds of the probability before its correction.
        kind: (N,) index of what is objected to, in the order of `Objected`.
        right: (N,) whether the effect was there.
    """

    robot: Array
    odds: Array
    kind: Array
    right: Mask

    def only(self, kept: Mask) -> "_Pairs":
        """Some of them."""
        return _Pairs(self.robot[kept], self.odds[kept], self.kind[kept], self.right[kept])


def fitted(records: Path) -> Calibration:
    """The correction that makes what happened likeliest, with a prior.

    Args:
        records: results of `benchmarks.other_robots`.
    """
    sets = json.loads(records.read_text())["sets"]
    pairs = _pairs(sets)
    left_out = np.empty(len(pairs.right))
    for fold in range(_FOLDS):
        inside = pairs.robot % _FOLDS == fold
        left_out[inside] = _corrected(_coefficients(pairs.only(~inside)), pairs.only(inside))
    intercept, slope, *shares = _coefficients(pairs).tolist()
    return Calibration(
        intercept=round(intercept, 4),
        slope=round(slope, 4),
        shares={str(kind): round(float(expit(share)), 4) for kind, share in zip(Objected, shares, strict=True)},
        fitted_on=FittedOn(str(records), file_hash(records), len(sets), len(pairs.right)),
        reliability=reliability(left_out.tolist(), pairs.right.tolist()),
    )


def reliability(said: Sequence[float], right: Sequence[bool], bins: int = 10) -> tuple[Bin, ...]:
    """How often probabilities proved right, by their range; ranges without any are left out.

    Args:
        said: probabilities.
        right: whether what they were said of was there.
        bins: ranges, of one width.
    """
    found = []
    for number in range(bins):
        low, high = number / bins, (number + 1) / bins
        inside = [(p, r) for p, r in zip(said, right, strict=True) if low <= p < high or p == high == 1.0]
        if inside:
            pairs = len(inside)
            found.append(Bin(low, high, pairs, sum(p for p, _ in inside) / pairs, sum(r for _, r in inside) / pairs))
    return tuple(found)


def _pairs(sets: Sequence[Mapping[str, Any]]) -> _Pairs:
    rows = [(number, each) for number, one in enumerate(sets) for each in one["said"] if each["uncalibrated"] >= _LEAST]
    kinds = list(Objected)
    return _Pairs(
        np.array([number for number, _ in rows]),
        logit(np.clip([each["uncalibrated"] for _, each in rows], EDGE, 1.0 - EDGE)),
        np.array([kinds.index(Objected(each["objected"])) for _, each in rows]),
        np.array([each["right"] for _, each in rows]),
    )


def _corrected(coefficients: Array, pairs: _Pairs) -> Array:
    """Probabilities by intercept, slope, and log odds of the shares."""
    return np.asarray(expit(coefficients[2:])[pairs.kind] * expit(coefficients[0] + coefficients[1] * pairs.odds))


def _coefficients(pairs: _Pairs) -> Array:
    before = np.array([0.0, 1.0, *logit([_BEFORE[kind] for kind in Objected])])

    def cost(coefficients: Array) -> float:
        said = _corrected(coefficients, pairs)
        happened = np.maximum(np.where(pairs.right, said, 1.0 - said), _IMPOSSIBLE)
        return float(-np.log(happened).sum() + 0.5 * (((coefficients - before) / _SD) ** 2).sum())

    return np.asarray(minimize(cost, before, method="BFGS").x)
