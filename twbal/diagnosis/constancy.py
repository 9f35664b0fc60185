"""Whether a named effect is of one size wherever it acts.

An effect of the wrong form is fitted to a mean: it would have to be larger in one part of the data and smaller in the
other. A friction that grows with the cube of the rate closes the gap as a viscous one, which would have to be larger
where the wheels are fast.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array
from twbal.diagnosis.hypothesis import FittedHypothesis
from twbal.sysid.intervals import curvature, prior_slopes
from twbal.sysid.model import Data
from twbal.sysid.prediction_error_fit import slopes_of

_SURE = 5.0  # standard errors of the difference, below which it may be chance


class Inconstancy(NamedTuple):
    """An effect that differs in size between two halves of the data.

    Attributes:
        effect: its name.
        axis: what parts the halves: `speed` of the wheels, `time` since the start, or size of the `command`.
        share: by which it would be larger in the upper half than in the lower, of its size, whatever its sign.
        sigmas: that difference in standard errors.
    """

    effect: str
    axis: str
    share: float
    sigmas: float


def inconstant_effects(data: Data, hypothesis: FittedHypothesis, most: float) -> tuple[Inconstancy, ...]:
    """Effects of a fitted set whose size differs by more than `most` of it between two halves of the data.

    From the slopes at the optimum: the effect's own is parted in two, and all else is free to make up.
    """
    if not hypothesis.effects:
        return ()
    model, free_parameters, white = hypothesis.fit.model, hypothesis.fit.free_parameters, hypothesis.fit.white
    J, pull = slopes_of(data, hypothesis.fit), prior_slopes(free_parameters, model)
    fields = [free.field for free in free_parameters]
    axes = _axes(data, [prediction.states for prediction in data.predictions(model, hypothesis.fit.kalman)])
    found = []
    for candidate in hypothesis.effects:
        size = candidate.parameters[0]
        column = fields.index(candidate.field(size))
        value = size.size(model.value(fields[column]))
        if value == 0.0:
            continue
        for axis, values in axes.items():
            side = np.where(values > np.median(values), 0.5, -0.5)
            A = np.column_stack([J, J[:, column] * np.repeat(side, 4)])
            H = np.zeros((len(free_parameters) + 1,) * 2)
            H[:-1, :-1] = curvature(free_parameters, J[:0])
            H += A.T @ A / data.slope_excess
            covariance, gradient = np.linalg.pinv(H), A.T @ white
            gradient[:-1] += pull
            difference = float(-(covariance @ gradient)[-1])
            error = float(np.sqrt(covariance[-1, -1]))
            if abs(difference) > most * abs(value) and abs(difference) > _SURE * error > 0.0:
                found.append(Inconstancy(candidate.name, axis, difference / value, difference / error))
    return tuple(sorted(found, key=lambda inconstant: -abs(inconstant.share)))


def _axes(data: Data, states: list[Array]) -> Mapping[str, Array]:
    """What may part the data, at each prediction error (N / 4,)."""
    return {
        "speed": np.abs(np.concatenate([path[1:, 3] for path in states])),
        "time": np.concatenate([np.arange(len(recording), dtype=float) for recording in data.recordings]),
        "command": np.abs(np.concatenate([recording.commands for recording in data.recordings])),
    }
