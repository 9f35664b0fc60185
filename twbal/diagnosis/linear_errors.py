"""Prediction errors of a model to first order: in its free values, in constants, and in functions of a variable."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from twbal.core.gaussian import Array
from twbal.diagnosis.free_form_candidates import (
    JOINT,
    OUTSIDE,
    TILT,
    FreeFormCandidate,
    VariableSeries,
    courses,
    means_over,
    values_of,
)
from twbal.planar.constants import constants
from twbal.sysid.kalman import Filter, LinearPlanarModel, first_reading
from twbal.sysid.likelihood import whitened
from twbal.sysid.linear_response import respond_each
from twbal.sysid.model import Data, FreeParameter, Model
from twbal.sysid.noise_fit import refilter
from twbal.sysid.smooth_function import Smooth, smooth_over
from twbal.sysid.smooth_regression import Projected, projected

_CONSTANTS = (0.1, 0.1, 0.05)  # prior of constants: torques over the torque limit, and the tilt [rad]
_RIDGE = 1e-6  # of values without a prior, over their ranges, as of `sysid.intervals`


@dataclass(frozen=True, eq=False)
class LinearErrors:
    """A model's errors, and how they change with what is free in it.

    Attributes:
        data: recordings.
        model: about which errors are linear.
        free_parameters: what is free in it.
        kalman: filter that made the errors.
        linear: the linear model of the model.
        errors: (T + 1, 4) of each recording.
        slopes: (T + 1, 4, P + 3) of each recording: derivatives by the free values, and by less a constant of each
            quantity (`_CONSTANTS`).
        precision: (P + 3,) of the prior of all these.
        off: (P + 3,) by which their priors' means are off their values now.
        courses: the variables over each recording.
        weights: (T + 1,) of each recording: roots of the instants' weights, 0 where they do not count.
    """

    data: Data
    model: Model
    free_parameters: tuple[FreeParameter, ...]
    kalman: Filter
    linear: LinearPlanarModel
    errors: list[Array]
    slopes: list[Array]
    precision: Array
    off: Array
    courses: dict[str, list[VariableSeries]]
    weights: list[Array]

    def functions(self, candidate: FreeFormCandidate) -> Smooth:
        """The smooth functions of a candidate's variable, over the data."""
        values = values_of(self.courses[candidate.variable], self.data.usable, candidate.is_periodic)
        return smooth_over(values, candidate.is_periodic)

    def left_by(self, candidate: FreeFormCandidate, functions: Smooth) -> list[Array]:
        """Errors (T + 1, 4, m) of each recording that a weight of 1 of each function leaves."""
        return [
            responses(self, candidate.quantity, _inputs(candidate, functions, course))
            for course in self.courses[candidate.variable]
        ]

    def white(self, parts: Sequence[Array]) -> Array:
        """Errors, or columns of them (T + 1, 4, m), whitened, weighted and flat: (N,) or (N, m)."""
        return whitened(self.kalman, self.weights, parts)

    def against(self, left: Sequence[Array]) -> Projected:
        """What the errors say of weights that leave such errors, beside all that is free."""
        J, y = self.white_slopes
        return projected(self.white(left), y, J, self.precision)

    @cached_property
    def white_slopes(self) -> tuple[Array, Array]:
        """The slopes, whitened (N, P + 3), and the errors with free values at their priors' means (N,)."""
        J = self.white(self.slopes)
        return J, self.white(self.errors) + J @ self.off

    def corrected(self, left: Sequence[Array], weights: Array, moved: Array) -> list[Array]:
        """Errors without those that the weights leave, with free values moved from their priors' means."""
        steps = moved + self.off
        return [e - A @ weights + J @ steps for e, A, J in zip(self.errors, left, self.slopes, strict=True)]

    def moved(self, moved: Array) -> Model:
        """The model with its free values moved from their priors' means, within their bounds."""
        values = {}
        for free, step in zip(
            self.free_parameters, (moved + self.off)[: len(self.free_parameters)].tolist(), strict=True
        ):
            values[free.field] = min(max(self.model.value(free.field) + step, free.low), free.high)
        return self.model.put(values)


def linear_errors(
    data: Data, model: Model, free_parameters: Sequence[FreeParameter], kalman: Filter, weights: list[Array]
) -> LinearErrors:
    """Linearise the errors that a filter makes of a model, by finite differences forward, or backward at a bound.

    Args:
        data: recordings.
        model: about which errors are linear.
        free_parameters: what is free in it.
        kalman: the filter.
        weights: of instants, as of `likelihood.weights_of`.
    """
    predictions = data.predictions(model, kalman)
    errors = [prediction.errors for prediction in predictions]
    columns = [slopes_by(free, data, model, kalman, errors) for free in free_parameters]
    precision = np.array([1.0 / free.sd**2 + _RIDGE / (free.high - free.low) ** 2 for free in free_parameters])
    off = np.array([(free.mean - model.value(free.field)) / free.sd**2 for free in free_parameters]) / precision
    limit = float(model.planar.torque_limit)
    sds = np.array([limit, limit / constants(model.planar, data.period).radius, 1.0]) * _CONSTANTS
    found = LinearErrors(
        data, model, tuple(free_parameters), kalman, data.linear(model), errors, [], np.append(precision, sds**-2.0),
        np.append(off, np.zeros(len(sds))), courses(data, model, kalman, predictions), weights,
    )  # fmt: skip
    slopes = []
    for number, recording in enumerate(data.recordings):
        of_constants = [
            -responses(found, quantity, np.ones((len(recording) + (quantity == TILT), 1)))
            for quantity in (JOINT, OUTSIDE, TILT)
        ]
        of_frees = [column[number][:, :, None] for column in columns]
        slopes.append(np.concatenate([*of_frees, *of_constants], axis=2))
    return replace(found, slopes=slopes)


def slopes_by(free: FreeParameter, data: Data, model: Model, kalman: Filter, errors: Sequence[Array]) -> list[Array]:
    """Derivatives of the errors of each recording by a free value; 0, so that it stays, where predictions diverge."""
    value = model.value(free.field)
    nudges = (free.nudge, -free.nudge) if value + free.nudge <= free.high else (-free.nudge,)
    for nudge in nudges:
        moved = data.errors(model.put({free.field: value + nudge}), kalman)
        with np.errstate(over="ignore", invalid="ignore"):  # where predictions diverge
            slopes = [(after - before) / nudge for after, before in zip(moved, errors, strict=True)]
        if all(np.isfinite(each).all() for each in slopes):
            return slopes
    return [np.zeros_like(each) for each in errors]


def _inputs(candidate: FreeFormCandidate, functions: Smooth, course: VariableSeries) -> Array:
    """What each function adds: (T, m) over control periods, or (T + 1, m) to readings at instants."""
    return functions.at(course.at) if candidate.quantity == TILT else means_over(functions.at, course)


def responses(at: LinearErrors, quantity: str, inputs: Array) -> Array:
    """Errors (T + 1, 4, m) that inputs leave.

    Args:
        at: the model, and the filter.
        quantity: that the inputs add to.
        inputs: torques [N·m] or forces [N] of control periods (T, m), or readings of the tilt [rad] (T + 1, m).
    """
    linear, kalman = at.linear, at.kalman
    if quantity == TILT:  # the first one makes the first state
        gains = kalman.gains.copy()
        gains[0, :8] = first_reading()
        return np.stack([_misread(at, gains, each) for each in inputs.T], axis=2)
    push = np.ascontiguousarray(linear.B[:, int(quantity == OUTSIDE)])
    scale = constants(at.model.planar, at.data.period).radius if quantity == OUTSIDE else 1.0
    errors = scale * respond_each(linear.F, linear.C, kalman.gains, push, np.ascontiguousarray(inputs))
    errors[:, :, ~at.data.sensed] = 0.0
    return np.ascontiguousarray(np.moveaxis(errors, 0, 2))


def _misread(at: LinearErrors, gains: Array, tilt: Array) -> Array:
    """Errors (T + 1, 4) that readings of the tilt [rad] leave which are off by so much (T + 1,)."""
    readings = np.zeros((len(tilt), 4))
    readings[:, 0] = tilt
    errors = refilter(at.linear.F, at.linear.C, np.zeros_like(gains), gains, readings)
    errors[0], errors[:, ~at.data.sensed] = 0.0, 0.0
    return errors
