"""What a diagnosis takes for granted, and its thresholds."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import ceil, inf
from typing import NamedTuple

from twbal.core.robot_parameters import RobotParameters
from twbal.diagnosis.data_sheet import DATA_SHEET, WHEELS
from twbal.sysid.model import Field

_FINEST = 0.002  # s; physics steps that are fine enough: 10 in a control period of 20 ms
_STIFF = 0.2  # share of the joints' rate that viscous friction may take in a physics step
_MOST_SUBSTEPS = 200


@dataclass(frozen=True)
class Tolerances:
    """Standard deviations of what is always free.

    Attributes:
        data_sheet: of each factor on a data-sheet value that is published; and the limits beyond which it is off
            (`max_tolerance_statistic`).
        rough: that of a value of which hardly anything is known; none that follows from a provenance is larger.
        imu_timing: by which the IMU may be late, one-sided [s].
        angle_timing: by which angles may be read before or after rates [s].
        tilt_offset: by which the tilt of each recording may be off by a constant of its own [rad]; 0: by nothing.
        battery: share by which the motors may be stronger or weaker in each recording, where these are of several runs.
        floor_slope: by which the ground may rise in each recording, likewise [rad].
        effects: share by which effects that the simulation has already may be larger or smaller.
        factors: by value of the robot's sheet, its tolerance in that of a published one; 1 for others.
    """

    data_sheet: float
    rough: float
    imu_timing: float
    angle_timing: float
    tilt_offset: float
    battery: float
    floor_slope: float
    effects: float
    factors: Mapping[str, float] = field(default_factory=dict)

    def of(self, name: Field) -> float:
        """Of a factor on a data-sheet value, by the name of the field that a fit changes."""
        value = DATA_SHEET[name].value if name in DATA_SHEET else str(name)
        largest = max(self.data_sheet, self.rough)
        return min(self.data_sheet * self.factors.get(value, 1.0), largest)

    def limits(self, given: Iterable[Field] = ()) -> Mapping[Field, float]:
        """Shares by which values of the data sheet may be off, and by which sizes of effects that are given may."""
        sheet: dict[Field, float] = {field: self.of(field) for field in (*DATA_SHEET, *WHEELS)}
        return dict.fromkeys(given, self.effects) | sheet

    def without_offsets(self) -> "Tolerances":
        """The same with nothing that differs from recording to recording."""
        return replace(self, tilt_offset=0.0, battery=0.0, floor_slope=0.0)

    def for_robot(self, robot: RobotParameters) -> "Tolerances":
        """The same, with what the robot's sheet says of where its values come from."""
        return replace(self, factors=robot.tolerance_factors)


@dataclass(frozen=True)
class Thresholds:
    """Where decisions are made.

    A score is the gain in -2 log likelihood less the BIC penalty, over the residual autocorrelation that is left: the
    Ljung-Box statistic of the residuals over its expectation, 1 for white ones.

    Attributes:
        false_alarm_probability: that chance makes the best candidate worth its penalty where none is there, its gain
            multiplied by the temperature.
        min_gain_share: of what the effects named so far gain, that another one must gain beside them.
        min_effect_size: of the start values of its parameters, that an effect must have to be named.
        max_autocorrelation: of residuals after the fix, above which nothing in the library explains the gap.
        max_discrepancy: of a model without further effects, in standard deviations of its prior, from which on
            something is missing.
        max_tolerance_statistic: gain, over the residual autocorrelation, of a data sheet that may leave its tolerances,
            from which on it is off.
        min_reported_shift: of a data-sheet value, in standard deviations of its tolerance, that is worth a word.
        max_shift: of a data-sheet value, in standard deviations, beyond which it is no finding any more.
        max_size_difference: share of its size by which a named effect may differ between two halves of the data.
        form_error: share of its size by which an effect's parameter may be off, as a robot's own form of it is never
            ours.
        equivalence_margin: in score, within which a rival counts as an equivalent.
    """

    false_alarm_probability: float
    min_gain_share: float
    min_effect_size: float
    max_autocorrelation: float
    max_discrepancy: float
    max_tolerance_statistic: float
    min_reported_shift: float
    max_shift: float
    max_size_difference: float
    form_error: float
    equivalence_margin: float


class LeastScores(NamedTuple):
    """Scores from which on candidates are worth their penalty (`null_distribution`).

    Attributes:
        effect: of an effect.
        data_sheet: of a value of the data sheet.
    """

    effect: float = inf
    data_sheet: float = inf


NEVER = LeastScores()
"""Of recordings that are not read yet: no candidate is worth its penalty."""


@dataclass(frozen=True)
class Settings:
    """All settings of a diagnosis.

    Attributes:
        tolerances: of what is always free.
        thresholds: where decisions are made.
        substeps: physics steps of a control period, at most; more only where viscous friction makes the joints stiff.
        shortlist: candidates that are fitted in each round.
        exclude: names of effects that are known not to be there.
        include: names of effects that are weighed although they are only where that is asked for.
        max_effects: that are named together, at most.
        tempered_search: whether a search by a tempered likelihood follows, where the first leaves a doubt.
        prior: probability that an effect is missing, before anything was recorded.
        temperature: by which what chance gains is multiplied for the least scores, and by which scores of the friction
            of wheels in the air are divided.
        least_temperature: of the probabilities of sets, over the residual autocorrelation that the best set leaves.
        misfit_share: of what the best set gains beyond a filter of the tilt, which is the temperature of the
            probabilities where that is more. What effects gain by a form that is not quite the robot's grows with the
            data.
        blocks: into which the data are cut for intervals and held-out gains.
        least_scores: by the thresholds and the recordings; known once these are read.
    """

    tolerances: Tolerances
    thresholds: Thresholds
    substeps: int
    shortlist: int
    exclude: Sequence[str]
    include: Sequence[str]
    max_effects: int
    tempered_search: bool
    prior: float
    temperature: float
    least_temperature: float
    misfit_share: float
    blocks: int
    least_scores: LeastScores = NEVER

    def held_against(self, exceeded_with: Callable[[float], LeastScores]) -> "Settings":
        """The same with least scores, by what gives those that chance exceeds with a probability."""
        return replace(self, least_scores=exceeded_with(self.thresholds.false_alarm_probability))

    def for_period(self, period: float, damping_rate: float = 0.0) -> "Settings":
        """The same with no more physics steps of a control period than steps of `_FINEST` take; more in stiff joints.

        Args:
            period: control period [s].
            damping_rate: of the joints, as of `joint_damping_rate` [1/s]. The integration stays stable where a fit
                makes it five times as high.
        """
        fine = min(self.substeps, ceil(period / _FINEST - 1e-9))
        stiff = ceil(min(period * damping_rate / _STIFF, _MOST_SUBSTEPS))
        return replace(self, substeps=max(fine, stiff))
