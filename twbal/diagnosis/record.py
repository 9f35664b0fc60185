"""What a diagnosis says: the record that reports draw and that `diagnosis.json` keeps."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple, Self

from twbal.diagnosis.calibration import Objected
from twbal.diagnosis.follow_up import Disagreement, NextExperiment
from twbal.diagnosis.free_form_record import FreeForm
from twbal.diagnosis.null_record import NullScore
from twbal.diagnosis.power_record import DetectionPower
from twbal.diagnosis.side_findings import BiasWalk, CommandLoss, MotorDifference

HEADLINE = (("tilt", "wheel_angle"), 0.15)
"""Channel (the first that was measured) and horizon [s] of the gap that stands for all: longer rollouts of this
unstable robot go wrong by any model, shorter ones show little but noise."""

CLOSED = 0.5
"""Share of the gap on held-out data above which it counts as closed: the better part of it."""

EXPLAINED = 2.0
"""Times the noise floor up to which the error of held-out rollouts counts as explained."""

CHANCE = 0.05
"""Share by which the error of held-out rollouts may be above that of another simulation, and be no worse."""

BEYOND_CHANCE = 2.0
"""Standard errors by which it must be above that: a perfect simulation is by so much in one of 44 cases."""

LISTED = 0.02
"""Probability from which on an effect is listed."""

LIKELY = 0.5
"""Probability from which on an effect is more likely missing than not."""


class Verdict(StrEnum):
    """What a diagnosis comes to."""

    NAMED = "named"
    """The data say which effects the simulation lacks."""
    NONE = "none"
    """The simulation explains the data; nothing is missing that they could show."""
    DATA_SHEET = "data_sheet"
    """No effect is missing, but parameters of the data sheet are off."""
    UNKNOWN = "unknown"
    """There is a gap, and nothing in the library explains it, or nothing surely enough."""
    UNDECIDED = "undecided"
    """The data are too poor to tell; another recording could."""

    @property
    def is_open(self) -> bool:
        """Whether nothing was found that could be acted on."""
        return self in (Verdict.UNKNOWN, Verdict.UNDECIDED)


class Estimate(NamedTuple):
    """A parameter with its 95 % interval, all in `unit`.

    Attributes:
        value: estimate.
        low95: lower end.
        high95: upper end.
        unit: "" for a plain number.
    """

    value: float
    low95: float
    high95: float
    unit: str

    def widened(self, scale: float, least: float, below: float) -> Self:
        """With an interval that is `scale` times as wide, as far as it is between `least` and `below`."""
        low, high = (self.value + scale * (end - self.value) for end in (self.low95, self.high95))
        return self._replace(low95=max(low, min(least, self.value)), high95=min(high, max(below, self.value)))


@dataclass(frozen=True)
class ProbableEffect:
    """An effect that the simulation may lack.

    Attributes:
        name: of the effect, as of `effects/`.
        probability: that it is missing, or one of its equivalents, corrected by how often such probabilities proved
            right (`calibration.Calibration`).
        is_named: whether the verdict names it: nothing speaks against it, and it is worth its penalty.
        parameters: by name, as the effect in the simulation takes them, in the best set that holds it.
        equivalents: effects that these data cannot tell from it.
        separate_by: the experiment that would tell them apart; "" where there are none.
        objections: what speaks against it, a sentence each.
        share: of the gap on held-out data, by which it grows where this effect is left out of the best guess and all
            else is fitted again; None where it is not in the best guess, or there is hardly a gap, or the model without
            it cannot follow the data. Shares need not add up to 1, as what is left can do a part of the work of what is
            left out.
        uncalibrated: the probability before its correction: the weight of all sets of effects that hold the effect or
            one of its equivalents (`probable.probability_of`), times the probability that it is not negligible.
        objected: what is objected to, by which the correction goes, too.
    """

    name: str
    probability: float
    is_named: bool
    parameters: Mapping[str, Estimate]
    equivalents: tuple[str, ...]
    separate_by: str
    objections: tuple[str, ...] = ()
    share: float | None = None
    uncalibrated: float = 0.0
    objected: Objected = Objected.NOTHING


class Rival(NamedTuple):
    """A candidate that was weighed.

    Attributes:
        names: effects it holds, sorted; () is the data sheet refitted.
        score: twice the log likelihood it gains over the data sheet alone, less its parameters' price [nats].
        probability: as sets compare with each other (`verdict.probabilities`).
        autocorrelation: of the residuals it leaves; 1 is that of white ones.
        negligible: those of its effects that are surely too small to matter.
    """

    names: tuple[str, ...]
    score: float
    probability: float
    autocorrelation: float
    negligible: tuple[str, ...] = ()

    @property
    def essential(self) -> tuple[str, ...]:
        """Its effects without those that are negligible."""
        return tuple(name for name in self.names if name not in self.negligible)


GIVEN_EFFECTS = "effects that the simulation has"
"""Group of their sizes, as of `Shift`."""


class Shift(NamedTuple):
    """How far the data pull a parameter of the data sheet, or the size of an effect that the simulation has already.

    Attributes:
        name: the parameter; of an effect, its name and the parameter's.
        group: class of parameters that such data hardly tell apart ("gain, mass and inertia", "height and radius"), or
            `GIVEN_EFFECTS`.
        factor: times the value that was given.
        sigmas: the shift in standard deviations of its tolerance.
    """

    name: str
    group: str
    factor: float
    sigmas: float

    @property
    def tolerance(self) -> float:
        """Share by which it may be off, of a value that is off."""
        return (self.factor - 1.0) / self.sigmas

    @property
    def whose(self) -> str:
        """Whose value it is times which, in a sentence."""
        return "the simulation's" if self.group == GIVEN_EFFECTS else "the data sheet's"

    @property
    def text(self) -> str:
        """As it stands in a sentence: `body mass x 1.12 (+4.0 tolerances)`."""
        return f"{self.name.replace('_', ' ')} x {self.factor:.3g} ({self.sigmas:+.1f} tolerances)"


class Region(NamedTuple):
    """Disagreement of a channel within a region of the data.

    Attributes:
        channel: measured channel ("tilt", "tilt_rate", "wheel_angle", "wheel_rate").
        axis: what the region is a range of: the axle's "speed" [m/s], "command" [N·m], "tilt" [rad], "direction", which
            is the sign of the wheels' rate relative to the body (-1 to 0 backwards, 0 to 1 forwards), or "time" since
            the episode began [s].
        low: lower end of the range [SI].
        high: upper end [SI].
        samples: in it.
        bias: mean error of the simulation over the noise that was fitted with the best guess; of one control period.
        rms: root mean square error over that noise: 1 where simulation and measurement agree.
    """

    channel: str
    axis: str
    low: float
    high: float
    samples: int
    bias: float
    rms: float


class Remaining(NamedTuple):
    """What of the gap on held-out data nothing explains.

    Attributes:
        share: (after - noise floor) / (before - noise floor), not clipped; None where there is hardly a gap.
        is_beyond_noise: whether rollouts, or the residuals of the fit, are worse than the sensors' noise makes them.
        where: regions in which the best guess is most wrong, the worst first; a value of 1 is noise.
    """

    share: float | None
    is_beyond_noise: bool
    where: tuple[Region, ...] = ()


_SAID_SCALE = 1.05
_FLAT = 0.1  # share of the noise floor by which a gap must exceed it for a share of the gap to mean anything


class Gap(NamedTuple):
    """Error of the simulation over one horizon on held-out episodes, rms of a channel [its unit].

    Attributes:
        channel: measured channel.
        horizon: of the rollouts [s].
        before: by the data sheet.
        refitted: by the data sheet refitted within its tolerances.
        after: with what was named, or is the likeliest (`Diagnosis.added`).
        floor: what sensor noise alone would leave, but `after` where that is less.
        closed: share of before - noise_floor that is closed, not clipped: more than 1 where `after` is below the noise
            floor. None where before is within 10 % of the noise floor.
        noise_floor: what sensor noise alone would leave if the simulation of `after` were right.
        excess: mean square of `after` less that of the better of `before` and `refitted`, in standard errors of the
            difference of rollouts from the same start.
        parameter_floor: what the standard errors of the fitted values alone would leave of `after`; 0 where that is
            near `noise_floor`, as it is not worked out then.
    """

    channel: str
    horizon: float
    before: float
    refitted: float
    after: float
    floor: float
    closed: float | None
    noise_floor: float
    excess: float
    parameter_floor: float = 0.0

    @property
    def expected(self) -> float:
        """Error by noise and by the standard errors of the fitted values, were the form of the simulation right."""
        return math.hypot(self.noise_floor, self.parameter_floor)

    @property
    def expected_by(self) -> str:
        """What makes the error that is expected, for reports."""
        more = " and what the recordings leave open of the fitted values" if self.parameter_floor else " alone"
        return f"the sensors' noise{more}"

    @property
    def closed_by_refit(self) -> float | None:
        """Share of before - noise_floor that refitting the data sheet closes; None where there is hardly a gap."""
        return self.share(self.before - self.refitted)

    @property
    def closed_by_effects(self) -> float | None:
        """Share of before - noise_floor that what was added to the refitted data sheet closes beyond it."""
        return self.share(self.refitted - self.after)

    @property
    def is_worse(self) -> bool:
        """Whether rollouts are worse than with the data sheet as it is, or refitted, by more than chance."""
        is_lost = self.closed is not None and self.closed < 0.0
        is_higher = self.after > (1.0 + CHANCE) * min(self.before, self.refitted)
        return (is_lost or is_higher) and self.excess > BEYOND_CHANCE

    @property
    def remaining(self) -> float | None:
        """Share of before - noise_floor that is left, not clipped; None where there is hardly a gap."""
        return self.share(self.after - self.noise_floor)

    @property
    def left_by_refit(self) -> float | None:
        """As `remaining`, of the refitted data sheet."""
        return self.share(self.refitted - self.noise_floor)

    @property
    def interval_scale(self) -> float:
        """By how much 95 % intervals are wider than standard errors make them: `after` over `expected`, at least 1.

        Where the simulation that has the effects is farther off than noise and standard errors would make it, something
        is wrong that they do not know of (Birge, Phys. Rev. 40, 1932; the scale factor of the Particle Data
        Group's Review of Particle Physics, introduction). Only the tilt is asked, as in `is_near_floor`.
        """
        is_known = self.channel == "tilt" and self.noise_floor > 0.0
        return max(1.0, self.after / self.expected) if is_known else 1.0

    @property
    def widens_intervals(self) -> bool:
        """Whether `interval_scale` is worth a sentence."""
        return self.interval_scale > _SAID_SCALE

    def is_near_floor(self, error: float) -> bool:
        """Whether an error is no more than `EXPLAINED` times what noise and the values' standard errors would leave.

        Only the tilt is asked: wheels in the air follow each command at once, and what logged commands are off by is
        not in the floor.
        """
        return self.channel != "tilt" or error <= EXPLAINED * self.expected

    def share(self, change: float) -> float | None:
        """A change over before - noise_floor; None where there is hardly a gap."""
        known = self.before > (1.0 + _FLAT) * self.noise_floor
        return change / (self.before - self.noise_floor) if known else None


class ResidualAutocorrelation(NamedTuple):
    """Residual autocorrelation of a channel's one-step residuals; 1 is what white residuals have.

    Attributes:
        channel: measured channel.
        before: by the data sheet.
        after: with what was named, or is the likeliest (`Diagnosis.added`).
    """

    channel: str
    before: float
    after: float


@dataclass(frozen=True)
class Diagnosis:
    """What the measured episodes say about a simulation.

    Attributes:
        verdict: in one word.
        effects: that may be missing, the likeliest first: all with a probability of at least `LISTED`.
        remaining: what nothing explains.
        added: effects, and values of the data sheet beyond their tolerances, with which "after" was measured, sorted;
            empty where that is the data sheet refitted.
        data_sheet: shifts of the free data-sheet parameters, the largest first.
        data_sheet_class: groups that are off; empty unless the verdict is `data_sheet`.
        rivals: all candidates weighed, the best first.
        where: regions of disagreement by the data sheet, the largest first.
        gap: per channel and horizon on held-out data.
        held_out: names of the episodes (or stretches of them) it was measured on.
        autocorrelation: of the residuals, per channel.
        noise: standard deviations of the sensors, by channel, as fitted.
        advice: plain sentences: what the data do not carry, what to do next.
        next_experiment: that is expected to tell most of what is left open; None where nothing is, or none is offered.
        no_safe_experiment: whether none is offered because the robot might fall in each of those weighed.
        disagreements: recordings that disagree with the others, the surest first.
        free_form: functions of one variable that explain a part of what remains; drawn, and not named.
        motor_difference: by how much one motor is stronger than the other; None where the yaw rate does not show it.
        lost_commands: how many commands did not reach the robot; None where the measurements show none.
        gyro_bias_walk: by how much the bias of the gyro walks; None without a gyro.
        contradicted: whether rollouts on held-out data speak against the fit, so that what was added is no finding.
        power: of effects that the best set does not have: how likely they would have been found, had they been there.
        null_score: of the best of these effects, and how often chance alone makes one score more; None where no sets
            were weighed.
    """

    verdict: Verdict
    effects: tuple[ProbableEffect, ...]
    remaining: Remaining
    added: tuple[str, ...]
    data_sheet: tuple[Shift, ...]
    data_sheet_class: tuple[str, ...]
    rivals: tuple[Rival, ...]
    where: tuple[Region, ...]
    gap: tuple[Gap, ...]
    held_out: tuple[str, ...]
    autocorrelation: tuple[ResidualAutocorrelation, ...]
    noise: Mapping[str, float]
    advice: tuple[str, ...]
    next_experiment: NextExperiment | None = None
    no_safe_experiment: bool = False
    disagreements: tuple[Disagreement, ...] = ()
    free_form: tuple[FreeForm, ...] = ()
    motor_difference: MotorDifference | None = None
    lost_commands: CommandLoss | None = None
    gyro_bias_walk: BiasWalk | None = None
    contradicted: bool = False
    power: tuple[DetectionPower, ...] = ()
    null_score: NullScore | None = None

    @property
    def named_effects(self) -> tuple[ProbableEffect, ...]:
        """Effects that the verdict names; none unless it is `named`."""
        return tuple(effect for effect in self.effects if effect.is_named)

    @property
    def likely_effects(self) -> tuple[ProbableEffect, ...]:
        """Effects that are more likely missing than not, and are not named."""
        return tuple(effect for effect in self.effects if effect.probability >= LIKELY and not effect.is_named)

    @property
    def has_remains(self) -> bool:
        """Whether something remains that nothing named explains."""
        return self.verdict is Verdict.UNKNOWN or self.remaining.is_beyond_noise

    @property
    def headline(self) -> Gap | None:
        """The gap that stands for all; None where none was measured."""
        return headline(self.gap)

    @property
    def after(self) -> str | None:
        """What "after" was measured with, for a legend; None where that is the data sheet refitted."""
        if not self.added:
            return None
        return "with the best guess" if self.verdict is Verdict.UNKNOWN else "with what was named"


def headline(gaps: Sequence[Gap]) -> Gap | None:
    """The gap that stands for all; None of none."""
    channels, horizon = HEADLINE
    known = [channel for channel in channels if any(gap.channel == channel for gap in gaps)]
    same = [gap for gap in gaps if gap.channel in known[:1]]
    return min(same, key=lambda gap: abs(gap.horizon - horizon)) if same else None
