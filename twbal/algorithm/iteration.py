"""One policy of a run of Algorithm 1: what it was learned from, what was predicted for it, and what it did."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from twbal.core.errors import DataError
from twbal.core.evaluation import PlaceBy
from twbal.search.predictor import Predictor

_AMOUNTS = (
    "real_episodes",
    "real_samples",
    "real_seconds",
    "predicted_cost",
    "real_cost",
    "drift_m",
    "fit_s",
    "search_s",
    "trial_seconds",
    "tilt_band_median",
    "tilt_band_widest",
    "farthest_median_m",
    "farthest_worst_m",
    "command_change",
    "oscillation",
    "oscillation_worst",
    "used_worst",
    "crps",
    "crps_of_trials",
    "crps_ratio",
    "evidence_gain",
)


PARTS = {"upright": "upright", "settled": "settled", "in_place": "in place", "quiet": "quiet"}
"""Parts of a success, by the field that counts them, in words."""


class Basis(StrEnum):
    """What a policy was made from, and its trials were predicted with."""

    SIMULATION = "f"
    CORRECTED = "f + g"
    ROBOT = "robot alone"
    """A model of the whole dynamics, without a simulation."""
    DATA_SHEET = "data sheet"
    """Its linear-quadratic regulator."""
    IDENTIFIED = "linear model"
    """The linear-quadratic regulator of a linear model of real rollouts."""
    AGENT = "agent"
    """A model-free agent, trained in simulation."""


class Search(StrEnum):
    """What the policy search of an iteration came to."""

    FOUND = "found"
    """A new policy."""
    KEPT = "kept"
    """Nothing better than an earlier policy."""
    NOT_MADE = "not made"
    """The policy is no result of a search, or that of the iteration before, for which only the model is new."""


class Reason(StrEnum):
    """Why the policy of an iteration is driven."""

    FIRST = "first"
    """There was none before."""
    BETTER = "expected better"
    """New, and more of the sampled robots succeed, in tenths, than under any earlier policy that was a candidate."""
    AS_LIKELY = "as likely"
    """New; as many succeed as under the best earlier one, and it ranks first by how they balance."""
    MARGIN = "more margin"
    """New; by the use of the limits it ranks first among robots as they are known and robots that changed."""
    ALONE = "no other left"
    """New, and no earlier policy was a candidate: each was driven twice."""
    KEPT = "kept"
    """An earlier policy, which ranks before all that the search found."""
    MODEL = "new model"
    """The policy before, which stays: only its prediction is new."""


class DiagnosisOutcome(StrEnum):
    """What became of a diagnosis of the real rollouts."""

    NOT_MADE = "not made"
    USED = "used"
    """f is of the simulation with what it found."""
    NOT_USED = "not used"
    """It left too much of the error, or the rollouts are likelier under another base of g."""


class Base(StrEnum):
    """What g was learned on top of."""

    GIVEN = "given"
    """The f of the simulation that the run began with; with `diagnose`, of the one that a diagnosis corrected."""
    IDENTIFIED = "identified"
    """The f of the simulation with the parameters that the real rollouts tell."""
    DIAGNOSED = "diagnosed"
    """The f of the simulation with what a diagnosis of the real rollouts found."""
    NONE = "none"
    """No simulation: g is the whole dynamics."""


@dataclass(frozen=True)
class PolicyFile:
    """Where a policy lies.

    Attributes:
        path: of its checkpoint, from the run folder; absolute where it lies elsewhere.
        sha256: of that file.
    """

    path: str
    sha256: str


@dataclass(frozen=True)
class Iteration:
    """One policy: what it was learned from, what was predicted for it and what it then did.

    Attributes:
        index: 0 is the policy before any update (from f alone), i the one of update i.
        real_episodes: rollouts on the robot that g was learned from; trials that evaluate are not among them.
        real_samples: state transitions in them.
        real_seconds: how long the robot was driven in them [s].
        predicted_cost: expected long-term cost (eq. 9); None where nothing was predicted.
        real_cost: mean long-term cost of the trials; None without trials.
        successes: trials in which the robot balanced.
        trials: trials driven with this policy.
        coverage95: share of real states inside the predicted 95 % band; None without trials or a prediction.
        fit_s: time to learn the model [s].
        search_s: time to search the policy [s].
        drift_m: median distance between start and end of a trial [m]; None without trials.
        judged_success: fraction of long model rollouts that stay up, by which the policy was judged before it went to
            the robot; None where it was not judged.
        policy: its checkpoint.
        note: what a reader should know of it, in sentences; may be empty.
        trial_seconds: how long the robot was driven in the trials of this iteration [s].
        same_policy_as: the first iteration that had this very policy; None where it is new.
        basis: what the policy was made from.
        search: what the policy search came to.
        diagnosis: what became of the diagnosis of the rollouts.
        tilt_band_median: half width of the predicted 95 % band of the tilt, median over the horizon [rad], at most π;
            None without a prediction.
        tilt_band_widest: the same where it is widest [rad].
        upright, settled: trials that show this part of a success, see `TrialVerdict`.
        in_place, quiet: the same; None also where the rule does not ask for it.
        place_by: what told where the robot was: `pose`, or `odometry` where that was all there was in some trial.
        farthest_median_m: median over the trials of the greatest distance from where the robot was put, once it had
            time to come back [m]; None where no trial lasted until then.
        farthest_worst_m: greatest of these distances [m].
        command_change: median over the trials of the root mean square of the command's change from step to step, as a
            share of the torque limit.
        oscillation: median over the trials of the late tilt, peak to peak [rad].
        oscillation_worst: greatest of these [rad].
        log_density: mean log predictive density of the real states, in units of the cost's widths (`Scores`).
        crps: mean CRPS of the predicted band, in the same units.
        crps_of_trials: CRPS of the trials' own spread: of each under the mean and sd of all others.
        crps_ratio: of the prediction's to that, at the same steps.
        success_probability: that a trial succeeds, as the search expected when it decided for this policy; None where
            nothing was sampled.
        reason: why the policy is driven; None where an update makes its policy without a choice.
        base: what g was learned on top of.
        evidence_gain: by how much likelier the real transitions are under that base than under the next best candidate
            (difference of log evidence) [nats]; None also where there was one candidate.
        log_evidences: of the real transitions under each candidate, by `Base` [nats]; None where there was one.
        predicted_by: what `predicted_cost` and the bands come from; None without a prediction.
        margin: share of sampled robots that changed under which it succeeds; None where that was not asked.
        tilt_unknown: share of the tilt's predicted variance that is due to what is not known of the robot, while the
            rest varies from rollout to rollout; None where that is not told.
        used_worst: greatest share of a limit of success (settled tilt, place, command) that a trial used; None where
            one ended early, or there is none.
        trials_of: the earlier iteration whose trials these are, as the policy was not driven in new ones; None where
            they are its own.

    The fields from `trial_seconds` on are None where an older `summary.json` does not note them.
    """

    index: int
    real_episodes: int
    real_samples: int
    real_seconds: float
    predicted_cost: float | None
    real_cost: float | None
    successes: int
    trials: int
    coverage95: float | None
    fit_s: float
    search_s: float
    drift_m: float | None
    judged_success: float | None
    policy: PolicyFile
    note: str
    trial_seconds: float | None = None
    same_policy_as: int | None = None
    basis: Basis | None = None
    search: Search | None = None
    diagnosis: DiagnosisOutcome | None = None
    tilt_band_median: float | None = None
    tilt_band_widest: float | None = None
    upright: int | None = None
    settled: int | None = None
    in_place: int | None = None
    quiet: int | None = None
    place_by: PlaceBy | None = None
    farthest_median_m: float | None = None
    farthest_worst_m: float | None = None
    command_change: float | None = None
    oscillation: float | None = None
    oscillation_worst: float | None = None
    log_density: float | None = None
    crps: float | None = None
    crps_of_trials: float | None = None
    crps_ratio: float | None = None
    success_probability: float | None = None
    reason: Reason | None = None
    base: Base | None = None
    evidence_gain: float | None = None
    log_evidences: Mapping[str, float] | None = None
    predicted_by: Predictor | None = None
    margin: float | None = None
    tilt_unknown: float | None = None
    used_worst: float | None = None
    trials_of: int | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.successes <= self.trials:
            raise DataError(f"Iteration {self.index} has {self.successes} successes in {self.trials} trials.")
        for part in PARTS:
            count = getattr(self, part)
            if count is not None and not self.successes <= count <= self.trials:
                raise DataError(
                    f"Iteration {self.index} is {PARTS[part]} in {count} of {self.trials} trials, and {self.successes} "
                    "succeeded."
                )
        for name in ("coverage95", "judged_success", "success_probability", "margin", "tilt_unknown"):
            share = getattr(self, name)
            if share is not None and not 0 <= share <= 1:
                raise DataError(f"{name} of iteration {self.index} must be a share between 0 and 1; found {share}.")
        for name in _AMOUNTS:
            amount = getattr(self, name)
            if amount is not None and not 0 <= amount < math.inf:
                raise DataError(f"{name} of iteration {self.index} must be a number from 0 up; found {amount}.")
        if self.log_density is not None and not math.isfinite(self.log_density):
            raise DataError(f"log_density of iteration {self.index} must be finite; found {self.log_density}.")
        for name in ("same_policy_as", "trials_of"):
            earlier = getattr(self, name)
            if earlier is not None and not 0 <= earlier < self.index:
                raise DataError(f"{name} of iteration {self.index} must be an earlier iteration; found {earlier}.")

    @property
    def first_had(self) -> int:
        """The first iteration that had this policy: the number that the policy goes by."""
        return self.index if self.same_policy_as is None else self.same_policy_as

    @property
    def own_trials(self) -> int:
        """How many trials were driven in this iteration."""
        return self.trials if self.trials_of is None else 0

    @property
    def recalibrates(self) -> bool:
        """Whether the policy is an earlier one and only the model is new: nothing was searched."""
        return self.same_policy_as is not None and self.search is Search.NOT_MADE
