"""A model of the recordings: the planar model with values for what is free, and what it leaves of the data."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil
from typing import Any, NamedTuple

import numpy as np

from twbal.core.gaussian import Array, Mask
from twbal.planar.parameters import PlanarParameters
from twbal.sysid.autocorrelation import ljung_box_ratio
from twbal.sysid.kalman import Filter, LinearPlanarModel, error_variances, kalman_filter, linearise_period
from twbal.sysid.kalman_predictor import PredictorOutput, predict
from twbal.sysid.likelihood import robustify, whiten
from twbal.sysid.noise import LASTING, UNSENSED, NoiseModel, discrepancy_penalty
from twbal.sysid.noise_fit import fit_noise
from twbal.sysid.recording import Recording
from twbal.sysid.slope_excess import slope_excess

ANGLE_LEAD = "angle_lead"
"""Name of the one free value that is no field of `PlanarParameters`: time by which measured angles run ahead [s]."""
_ROUNDING = 1e-9  # rad, rad/s; smaller changes are those of the numbers in the file
_ONE_WAY = 0.98  # less the share of changes against them, the share of changes in one direction
_NOTHING = 1e-9  # rad, rad/s: what takes no part
_SLOW = 2.0  # control periods for which a wheel angle then shows one value
_NOT_OF_STEPS = 0.3  # share of the standard deviation of a stepped wheel angle that is white
_LAGS = 20  # control periods over which errors may remember


class Offsets(NamedTuple):
    """What differs from recording to recording of one robot.

    Attributes:
        tilt: that is added to the measured tilt [rad].
        torque: by which the motors are stronger than in the mean of the recordings, as a share: the battery.
        slope: by which the ground rises more [rad].
    """

    tilt: float = 0.0
    torque: float = 0.0
    slope: float = 0.0


class LogOffset(NamedTuple):
    """Stands for one of the offsets of one recording.

    Attributes:
        recording: its number.
        kind: field of `Offsets`.
    """

    recording: int
    kind: str


Field = str | LogOffset
"""A field of `PlanarParameters`, `ANGLE_LEAD`, or an offset of a recording."""


class FreeParameter(NamedTuple):
    """A value that a fit may change.

    Attributes:
        field: which.
        low: lower bound.
        high: upper bound.
        mean: of its prior.
        sd: of its prior; infinite without one.
        nudge: step of finite differences.
        effect: that it is a parameter of; "" where it is none.
        parameter: its name there.
        has_bounds: whether a value at an end of its range tells of a misfit.
    """

    field: Field
    low: float
    high: float
    mean: float
    sd: float
    nudge: float
    effect: str = ""
    parameter: str = ""
    has_bounds: bool = True

    @property
    def name(self) -> str:
        """As `effect.parameter`, or what else it is."""
        if isinstance(self.field, LogOffset):
            return f"{self.field.kind}_offset_{self.field.recording}"
        return f"{self.effect}.{self.parameter}" if self.effect else self.field


def offsets_of(free_parameters: Iterable[FreeParameter], recordings: Iterable[int]) -> tuple[FreeParameter, ...]:
    """The offsets that are free in the first recording, for those with these numbers."""
    return tuple(
        free._replace(field=free.field._replace(recording=number))
        for number in recordings
        for free in free_parameters
        if isinstance(free.field, LogOffset) and free.field.recording == 0
    )


class Model(NamedTuple):
    """A planar model and its noise.

    Attributes:
        planar: with all values put in.
        angle_lead: [s].
        noise: levels of noise, from which the filter's gain follows.
        offsets: of each recording; none where they are all 0.
        balanced: number of recordings, from the first one on, from the mean of whose torque offsets all are counted.
    """

    planar: PlanarParameters
    angle_lead: float
    noise: NoiseModel
    offsets: tuple[Offsets, ...] = ()
    balanced: int = 0

    @property
    def apart(self) -> "Model":
        """The same with offsets that are counted from 0."""
        if not self.balanced:
            return self
        mean = sum(each.torque for each in self.offsets[: self.balanced]) / self.balanced
        return self._replace(offsets=tuple(o._replace(torque=o.torque - mean) for o in self.offsets), balanced=0)

    def share(self, field: LogOffset, recording: int) -> float:
        """What an offset adds to that of a recording, of each unit."""
        is_balanced = field.kind == "torque" and field.recording < self.balanced
        return float(field.recording == recording) - (1.0 / self.balanced if is_balanced else 0.0)

    def value(self, field: Field) -> float:
        """The value of a field."""
        if isinstance(field, LogOffset):
            return float(getattr(self.offsets[field.recording], field.kind))
        return self.angle_lead if field == ANGLE_LEAD else float(getattr(self.planar, field))

    def put(self, values: Mapping[Any, float]) -> "Model":  # Any: a mapping of str alone is one of fields, too
        """The model with other values of some fields."""
        offsets = list(self.offsets)
        for field, value in values.items():
            if isinstance(field, LogOffset):
                offsets[field.recording] = offsets[field.recording]._replace(**{field.kind: value})
        fields = {field: value for field, value in values.items() if isinstance(field, str) and field != ANGLE_LEAD}
        lead = values.get(ANGLE_LEAD, self.angle_lead)
        return self._replace(planar=self.planar._replace(**fields), angle_lead=lead, offsets=tuple(offsets))

    def planar_for(self, recording: int) -> PlanarParameters:
        """The planar model, with the offsets of a recording."""
        if not self.offsets:
            return self.planar
        p, own = self.planar, self.apart.offsets[recording]
        return p._replace(
            imu_mount_angle_angle=p.imu_mount_angle_angle + own.tilt,
            torque_gain_gain=p.torque_gain_gain * (1.0 + own.torque),
            ground_slope_angle=p.ground_slope_angle + own.slope,
        )


@dataclass(frozen=True, eq=False)
class Data:
    """Recordings of one robot, and how finely the planar model steps through them.

    Attributes:
        recordings: at least one.
        substeps: physics steps of a control period.
        loudest: greatest levels of noise that a fit may come to; None: any.
        quietest: least standard deviations of the sensors, in the order of `MEASURED`; never less than `resolution`.
    """

    recordings: Sequence[Recording]
    substeps: int
    loudest: NoiseModel | None = None
    quietest: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)

    @property
    def period(self) -> float:
        """Control period [s]."""
        return self.recordings[0].period

    @property
    def lead(self) -> float:
        """Time by which the angles of the planar model's integrator run ahead of its rates [s]."""
        return 0.5 * self.period / self.substeps

    @property
    def usable(self) -> list[Mask]:
        """Which instants count, per recording (T + 1,)."""
        return [recording.usable for recording in self.recordings]

    @property
    def sensed(self) -> Mask:
        """(4,) which channels were measured."""
        return self.recordings[0].sensed

    @property
    def slope_excess(self) -> float:
        """By how much products of the whitened errors' slopes exceed the curvature of the likelihood."""
        return slope_excess(int(self.sensed.sum()))

    @cached_property
    def resolution(self) -> Array:
        """(4,) standard deviations that the sensors' steps alone make: no sensor's noise is less.

        A sensor's step is taken to be the least change between two of its readings, but for one in a hundred; the least
        change of these changes, where it runs one way throughout.
        """
        changes, bends = (
            np.concatenate([np.diff(recording.readings, n=order, axis=0) for recording in self.recordings])
            for order in (1, 2)
        )
        runs = np.abs(np.sign(changes).mean(axis=0)) > _ONE_WAY
        steps = []
        for column in (np.abs(bends[:, i] if runs[i] else changes[:, i]) for i in range(4)):
            steps.append(np.quantile(column[column > _ROUNDING], 0.01) if (column > _ROUNDING).any() else 0.0)
        return np.asarray(np.array(steps) / np.sqrt(12.0))

    @cached_property
    def steps(self) -> float:
        """Control periods for which the wheel angle shows one value before it steps to the next, in the mean."""
        changes = np.concatenate([np.diff(recording.readings[:, 2]) for recording in self.recordings])
        return float(len(changes) / max(int((np.abs(changes) > _ROUNDING).sum()), 1))

    @property
    def count(self) -> int:
        """Instants that count."""
        return int(sum(recording.usable[1:].sum() for recording in self.recordings))

    def shortened(self, instants: int) -> "Data":
        """The beginnings of the recordings, with as many instants that count as asked for or a few more."""
        share = min(instants / self.count, 1.0)
        return replace(self, recordings=[each.part(0, each.instants_until(share, ceil)) for each in self.recordings])

    def linear(self, model: Model) -> LinearPlanarModel:
        """The linear model of a model, with a model discrepancy where its noise has one."""
        linear = linearise_period(model.planar, self.period)
        if not model.noise.has_discrepancy:
            return linear
        return linear.with_discrepancy(self.period, self.steps, model.planar.tilt_filter_rate)

    def filter(self, model: Model) -> Filter:
        """The Kalman filter of a model."""
        return kalman_filter(self.linear(model), model.noise)

    def predictions(self, model: Model, kalman: Filter) -> list[PredictorOutput]:
        """What a model predicts of each recording with a filter."""
        lead = self.lead - model.angle_lead
        found = [
            predict(model.planar_for(k), recording, self.substeps, lead, kalman)
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

    def autocorrelation(self, errors: Sequence[Array], kalman: Filter) -> Array:
        """Autocorrelation of prediction errors that a filter made, per channel (4,); 1 is what white ones have."""
        robust = [robustify(e, u, kalman.whiteners, kalman.measured) for e, u in zip(errors, self.usable, strict=True)]
        return ljung_box_ratio(robust, error_variances(kalman), self.count, _LAGS)

    def penalty(self, model: Model) -> float:
        """-2 log prior of the levels of a model discrepancy, but for a constant; 0 without one."""
        return discrepancy_penalty(model.noise, self._loudest)

    @property
    def _has_steps(self) -> bool:
        """Whether the wheel angle so often stays at one value that its steps are no white noise."""
        return self.steps >= _SLOW

    @property
    def _loudest(self) -> NoiseModel:
        """The greatest levels; nothing for what these data cannot have."""
        any_noise = NoiseModel(np.full(4, np.inf), np.full(2, np.inf), np.full(LASTING, np.inf))
        most = self.loudest or any_noise
        here = np.array([True, True, True, self.sensed[1], self._has_steps, self.sensed[1]])
        return most._replace(discrepancy=np.where(here, most.discrepancy, _NOTHING))

    def with_noise(
        self, model: Model, iterations: int, afresh: bool = False, errors: Sequence[Array] | None = None
    ) -> Model:
        """The model with its noise refitted; arguments as of `fit_noise`, with its own errors where none are given."""
        errors = self.errors(model, self.filter(model)) if errors is None else errors
        linear = self.linear(model)
        least, lasting = np.maximum(self.resolution, self.quietest), np.zeros(LASTING)
        if model.noise.has_discrepancy and self._has_steps:  # it has what the steps of the wheel angle make
            least[2], lasting[4] = _NOT_OF_STEPS * least[2], np.sqrt(1.0 - _NOT_OF_STEPS**2) * least[2]
        limits = (
            NoiseModel(np.where(self.sensed, least, UNSENSED), np.zeros(2), lasting),
            self._loudest._replace(sensors=np.where(self.sensed, self._loudest.sensors, UNSENSED)),
        )
        return model._replace(
            noise=fit_noise(linear, model.noise, list(errors), self.usable, limits, iterations, afresh)
        )
