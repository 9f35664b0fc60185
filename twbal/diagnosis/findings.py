"""What the estimator finds in recordings: everything of a diagnosis but what rollouts in the physics engine say."""

from collections.abc import Mapping
from dataclasses import dataclass

from twbal.core.gaussian import Array
from twbal.diagnosis.model_comparison import ModelComparison
from twbal.diagnosis.null_record import NullScore
from twbal.diagnosis.power_record import DetectionPower
from twbal.diagnosis.record import ProbableEffect, ResidualAutocorrelation, Rival, Shift, Verdict
from twbal.sysid.model import Offsets
from twbal.sysid.noise import NoiseModel

Effects = Mapping[str, Mapping[str, float]]
"""Values of parameters, by effect and by parameter, as the effects of the simulation take them."""


@dataclass(frozen=True, eq=False)
class Trajectory:
    """The motion that a model makes of a recording.

    It is the predictor's state at each control instant, with the measurements up to and at that instant taken in. All
    are (T + 1,) but for one.

    Attributes:
        tilt: [rad].
        tilt_rate: [rad/s].
        speed: of the axle over ground [m/s].
        wheel_angle: true angle of the wheels relative to the body, in the encoders' count [rad].
        wheel_rate: [rad/s].
        position: of the axle along its way since the recording began [m].
        x, y: place of the axle, ahead of where the recording began and to the left of that [m].
        torque: that the motors make: what a lag remembers [N·m].
        gap: of the rotor within the backlash, -½ to ½ of the gap: which side it rests on [rad]; 0 without backlash.
        gap_rate: of the rotor, relative to the wheels [rad/s].
        slip: speed of the axle beyond that of wheels which roll [m/s].
        sway: of the part of the body that swings, ahead of where a rigid frame would hold it [m].
        sway_rate: [m/s].
        dry: (T + 1, 4) dry friction as of `PlanarState`: of the left joint, the right one, the left wheel on the ground
            and the right one [N·m].
        yaw_rate: as measured [rad/s].
        heading: by which the robot has turned since the recording began [rad].
    """

    tilt: Array
    tilt_rate: Array
    speed: Array
    wheel_angle: Array
    wheel_rate: Array
    position: Array
    x: Array
    y: Array
    torque: Array
    gap: Array
    gap_rate: Array
    slip: Array
    sway: Array
    sway_rate: Array
    dry: Array
    yaw_rate: Array
    heading: Array


@dataclass(frozen=True, eq=False)
class FilterResult:
    """What one model makes of the recordings.

    Attributes:
        effects: all that the model has beyond the data sheet, with what the simulation had already. Data-sheet
            parameters that were refitted are among them, as the effects body_mass, torque_gain, ...
        trajectories: per recording.
        errors: per recording (T + 1, 4): measured less predicted from the instant before, in the order of `MEASURED`.
        error_noise: (4,) standard deviations that such errors have by noise alone.
        noise: levels by which its filter weighs measurements.
        angle_lead: time by which measured angles run ahead of rates [s].
        offsets: of each recording; none where they are all 0.
        posterior_covariance: (4, 4) of what a trajectory gets wrong of tilt, wheel angle in space, tilt rate and wheel
            rate in space, where the model is right.
        filter_rate: of the complementary filter that makes the tilt; 0 without one [1/s].
    """

    effects: Effects
    trajectories: tuple[Trajectory, ...]
    errors: tuple[Array, ...]
    error_noise: Array
    noise: NoiseModel
    angle_lead: float
    offsets: tuple[Offsets, ...]
    posterior_covariance: Array
    filter_rate: float

    def effects_in(self, recording: int) -> Effects:
        """The effects as they are in one recording, with its battery and its ground."""
        own = self.offsets[recording] if self.offsets else Offsets()
        found = dict(self.effects)
        if own.torque:
            found["torque_gain"] = {"gain": found.get("torque_gain", {"gain": 1.0})["gain"] * (1.0 + own.torque)}
        if own.slope:
            found["ground_slope"] = {"angle": found.get("ground_slope", {"angle": 0.0})["angle"] + own.slope}
        return found


@dataclass(frozen=True, eq=False)
class Findings:
    """What recordings say about a simulation.

    Attributes:
        verdict: in one word.
        effects: that may be missing, with their probabilities, the likeliest first.
        added: names of what `named` has beyond `refitted`, sorted.
        data_sheet: shifts of the free data-sheet parameters, the largest first.
        data_sheet_class: groups that are off; empty unless the verdict is `data_sheet`.
        rivals: all sets that were fitted, the best first.
        autocorrelation: of the residuals, per channel.
        is_autocorrelated: whether what is left has more memory than noise has, beyond the limit of an objection.
        noise: standard deviations of the sensors, by channel, as fitted.
        advice: plain sentences: what the data do not carry, what to do next.
        nominal: the simulation as it is.
        nominal_errors: per recording (T + 1, 4): measured less what the simulation as it is predicts from the state of
            `named` at the instant before, in the order of `MEASURED`; 0 at the first instants.
        refitted: with its data sheet refitted within the tolerances.
        refitted_data_sheet: shifts of the data-sheet parameters of `refitted`, the largest first.
        comparison: the likeliest sets with their fits; None where no sets were weighed, as of wheels in the air.
        without: `named` without one of its effects and fitted again, by the effect's name.
        named: with what is named too; of an `unknown`, with the likeliest effects where each is more likely missing
            than not and none has a parameter at a bound; else the same as `refitted`.
        power: of effects that the chosen set does not have: how likely they would have been found.
        null_score: of the best of these effects, and how often chance alone makes one score more; None where no sets
            were weighed.
        drawn: effects as of `named.effects` with values that the data leave possible, drawn by their standard errors.
    """

    verdict: Verdict
    effects: tuple[ProbableEffect, ...]
    added: tuple[str, ...]
    data_sheet: tuple[Shift, ...]
    data_sheet_class: tuple[str, ...]
    rivals: tuple[Rival, ...]
    autocorrelation: tuple[ResidualAutocorrelation, ...]
    is_autocorrelated: bool
    noise: Mapping[str, float]
    advice: tuple[str, ...]
    nominal: FilterResult
    nominal_errors: tuple[Array, ...]
    refitted: FilterResult
    named: FilterResult
    without: Mapping[str, FilterResult]
    refitted_data_sheet: tuple[Shift, ...] = ()
    comparison: ModelComparison | None = None
    power: tuple[DetectionPower, ...] = ()
    null_score: NullScore | None = None
    drawn: tuple[Effects, ...] = ()

    @property
    def named_effects(self) -> tuple[ProbableEffect, ...]:
        """Effects that the verdict names; none unless it is `named`."""
        return tuple(effect for effect in self.effects if effect.is_named)
