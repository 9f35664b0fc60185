"""A model of the recordings: the twin with values for what is free, and what it leaves of the data."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array
from twbal.planar.parameters import TwinParameters
from twbal.sysid.autocorrelation import whiteness
from twbal.sysid.noise import UNSENSED, Filter, Noise, fit_noise, kalman_filter, linearise_period, tame, whiten
from twbal.sysid.predictor import Prediction, predict
from twbal.sysid.recording import Mask, Recording

ANGLE_LEAD = "angle_lead"
"""Name of the one free value that is no field of the twin: time by which measured angles run ahead of rates [s]."""
TILT_OFFSET = "tilt_offset_"
"""Begins the names of the values that belong to one recording each: a constant that is added to its tilt [rad]."""
_ROUNDING = 1e-9  # rad, rad/s; smaller changes are those of the numbers in the file
_ONE_WAY = 0.98  # less the share of changes against them, the share of changes in one direction
_LAGS = 20  # control periods over which errors may remember


class Free(NamedTuple):
    """A value that a fit may change.

    Attributes:
        field: of `TwinParameters`, `ANGLE_LEAD`, or `TILT_OFFSET` and the number of a recording.
        low: lower bound.
        high: upper bound.
        mean: of its prior.
        sd: of its prior; infinite without one.
        nudge: step of finite differences.
    """

    field: str
    low: float
    high: float
    mean: float
    sd: float
    nudge: float


class Model(NamedTuple):
    """A twin and its noise.

    Attributes:
        twin: with all values put in.
        angle_lead: [s].
        noise: levels of noise, from which the filter's gain follows.
        offsets: of the tilt of each recording [rad]; none where they are all 0.
    """

    twin: TwinParameters
    angle_lead: float
    noise: Noise
    offsets: tuple[float, ...] = ()

    def value(self, field: str) -> float:
        """The value of a field."""
        if field.startswith(TILT_OFFSET):
            return self.offsets[int(field.removeprefix(TILT_OFFSET))]
        return self.angle_lead if field == ANGLE_LEAD else float(getattr(self.twin, field))

    def put(self, values: Mapping[str, float]) -> "Model":
        """The model with other values of some fields."""
        fields = dict(values)
        lead = fields.pop(ANGLE_LEAD, self.angle_lead)
        offsets = [fields.pop(f"{TILT_OFFSET}{k}", offset) for k, offset in enumerate(self.offsets)]
        return self._replace(twin=self.twin._replace(**fields), angle_lead=lead, offsets=tuple(offsets))

    def twin_for(self, recording: int) -> TwinParameters:
        """The twin, with the tilt's offset in a recording."""
        if not self.offsets:
            return self.twin
        angle = self.twin.imu_mount_angle_angle + self.offsets[recording]
        return self.twin._replace(imu_mount_angle_angle=angle)


@dataclass(frozen=True, eq=False)
class Data:
    """Recordings of one robot, and how finely the twin steps through them.

    Attributes:
        recordings: at least one.
        substeps: physics steps of a control period.
    """

    recordings: Sequence[Recording]
    substeps: int

    @property
    def period(self) -> float:
        """Control period [s]."""
        return self.recordings[0].period

    @property
    def usable(self) -> list[Mask]:
        """Which instants count, per recording (T + 1,)."""
        return [recording.usable for recording in self.recordings]

    @property
    def sensed(self) -> Mask:
        """(4,) which channels were measured."""
        return self.recordings[0].sensed

    @cached_property
    def resolution(self) -> Array:
        """(4,) standard deviations that the sensors' steps alone make: no sensor's noise is less.

        A sensor's step is taken to be the least change between two of its readings, but for one in a hundred; the least
        change of these changes, where it runs one way throughout.
        """
        changes, bends = (
            np.concatenate([np.diff(recording.measured, n=order, axis=0) for recording in self.recordings])
            for order in (1, 2)
        )
        runs = np.abs(np.sign(changes).mean(axis=0)) > _ONE_WAY
        steps = []
        for column in (np.abs(bends[:, i] if runs[i] else changes[:, i]) for i in range(4)):
            steps.append(np.quantile(column[column > _ROUNDING], 0.01) if (column > _ROUNDING).any() else 0.0)
        return np.asarray(np.array(steps) / np.sqrt(12.0))

    @property
    def count(self) -> int:
        """Instants that count."""
        return int(sum(recording.usable[1:].sum() for recording in self.recordings))

    def filter(self, model: Model) -> Filter:
        """The Kalman filter of a model."""
        return kalman_filter(linearise_period(model.twin, self.period), model.noise)

    def predictions(self, model: Model, kalman: Filter) -> list[Prediction]:
        """What a model predicts of each recording with a filter."""
        lead = 0.5 * self.period / self.substeps - model.angle_lead
        found = [
            predict(model.twin_for(k), recording, self.substeps, lead, kalman.gains)
            for k, recording in enumerate(self.recordings)
        ]
        for prediction in found:
            prediction.errors[:, ~self.sensed] = 0.0
        return found

    def errors(self, model: Model, kalman: Filter) -> list[Array]:
        """Its prediction errors, (T + 1, 4) each."""
        return [prediction.errors for prediction in self.predictions(model, kalman)]

    def white(self, model: Model, kalman: Filter) -> Array:
        """Its prediction errors over all recordings, decorrelated and in standard deviations, flat (N,)."""
        parts = [
            whiten(errors, recording.usable, kalman.whiteners, kalman.measured)
            for errors, recording in zip(self.errors(model, kalman), self.recordings, strict=True)
        ]
        return np.concatenate(parts).ravel()

    def colour(self, errors: Sequence[Array], kalman: Filter) -> Array:
        """Whiteness of prediction errors that were made with a filter, per channel (4,); 1 is white."""
        tamed = [tame(e, u, kalman.whiteners, kalman.measured) for e, u in zip(errors, self.usable, strict=True)]
        return whiteness(tamed, self.count, _LAGS)

    def with_noise(self, model: Model, iterations: int) -> Model:
        """The model with its noise refitted."""
        errors = self.errors(model, self.filter(model))
        linear = linearise_period(model.twin, self.period)
        lowest = np.where(self.sensed, self.resolution, UNSENSED)
        highest = np.where(self.sensed, np.inf, UNSENSED)
        return model._replace(noise=fit_noise(linear, model.noise, errors, self.usable, (lowest, highest), iterations))
