"""What a run of Algorithm 1 achieved: `summary.json` as typed records."""

import math
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import NamedTuple

from twbal.core.errors import DataError
from twbal.core.evaluation import PlaceBy
from twbal.core.json_records import read_record
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
    ALONE = "no other left"
    """New, and no earlier policy was a candidate: each was driven twice."""
    KEPT = "kept"
    """An earlier policy, which ranks before all that the search found."""
    MODEL = "new model"
    """The policy before, which stays: only its prediction is new."""


class Diagnosis(StrEnum):
    """What became of a diagnosis of the real rollouts."""

    NOT_MADE = "not made"
    USED = "used"
    """What it found entered the simulation, and f was learned again."""
    NOT_USED = "not used"
    """It left the better part of the error."""


class Base(StrEnum):
    """What g was learned on top of."""

    GIVEN = "given"
    """The f of the simulation that the run began with, or of the one that a diagnosis corrected; or none."""
    IDENTIFIED = "identified"
    """The f of the simulation with the parameters that the real rollouts tell."""


@dataclass(frozen=True)
class SimData:
    """What f was learned from.

    Attributes:
        episodes: rollouts in the simulator.
        samples: state transitions in them.
    """

    episodes: int
    samples: int


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
        upright, settled: trials that show this part of a success, see `Verdict`.
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
        base: which f the model has that g was learned on.
        evidence_gain: by how much likelier the real transitions are under that f than under the next best candidate
            (difference of log evidence) [nats]; None also where there was one candidate.
        predicted_by: what `predicted_cost` and the bands come from; None without a prediction.

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
    diagnosis: Diagnosis | None = None
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
    predicted_by: Predictor | None = None

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
        for name in ("coverage95", "judged_success", "success_probability"):
            share = getattr(self, name)
            if share is not None and not 0 <= share <= 1:
                raise DataError(f"{name} of iteration {self.index} must be a share between 0 and 1; found {share}.")
        for name in _AMOUNTS:
            amount = getattr(self, name)
            if amount is not None and not 0 <= amount < math.inf:
                raise DataError(f"{name} of iteration {self.index} must be a number from 0 up; found {amount}.")
        if self.log_density is not None and not math.isfinite(self.log_density):
            raise DataError(f"log_density of iteration {self.index} must be finite; found {self.log_density}.")
        if self.same_policy_as is not None and not 0 <= self.same_policy_as < self.index:
            raise DataError(
                f"same_policy_as of iteration {self.index} must be an earlier iteration; found {self.same_policy_as}."
            )

    @property
    def first_had(self) -> int:
        """The first iteration that had this policy: the number that the policy goes by."""
        return self.index if self.same_policy_as is None else self.same_policy_as

    @property
    def recalibrates(self) -> bool:
        """Whether the policy is an earlier one and only the model is new: nothing was searched."""
        return self.same_policy_as is not None and self.search is Search.NOT_MADE


class Count(NamedTuple):
    """Trials of one policy, over all iterations that had it."""

    successes: int
    trials: int


@dataclass(frozen=True)
class Summary:
    """What a run of Algorithm 1 achieved.

    Attributes:
        robot: name of the robot.
        seed: of the run.
        wall_s: time its stages took [s], each as long as the go that finished it.
        sim: what f was learned from.
        iterations: in order, index 0 first.
        best_iteration: the first iteration that had the policy to use.
        tilt_limit: beyond which the robot has fallen [rad]; None where an older `summary.json` does not note it.

    Raises:
        DataError: the indices are not 0, 1, 2, ..., or the best iteration is none of them.
    """

    robot: str
    seed: int
    wall_s: float
    sim: SimData
    iterations: tuple[Iteration, ...]
    best_iteration: int
    tilt_limit: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "iterations", tuple(self.iterations))
        found = [iteration.index for iteration in self.iterations]
        if not found or found != list(range(len(found))):
            raise DataError(f"A summary needs iterations 0, 1, 2, ... in order; found {found}.")
        if self.best_iteration not in found:
            raise DataError(f"The best iteration must be one of {found}; found {self.best_iteration}.")

    @property
    def best(self) -> Iteration:
        """The first iteration that had the policy to use."""
        return self.iterations[self.best_iteration]

    @property
    def updates(self) -> int:
        """How often a new policy was asked for after policy 0."""
        return sum(not iteration.recalibrates for iteration in self.iterations[1:])

    def parts(self, policy: int) -> dict[str, int]:
        """Trials of a policy that show each part of a success, by the part's name in words; of those that are asked.

        Args:
            policy: the first iteration that had it.
        """
        counted = {name: [getattr(i, part) for i in self.having(policy) if i.trials] for part, name in PARTS.items()}
        return {name: sum(counts) for name, counts in counted.items() if counts and None not in counts}

    @property
    def solved(self) -> bool:
        """Whether all trials of some iteration succeeded."""
        return any(i.trials and i.successes == i.trials for i in self.iterations)

    @property
    def trial_seconds(self) -> float | None:
        """How long the robot was driven in all trials [s]; None where that was not noted."""
        seconds = [i.trial_seconds for i in self.iterations]
        return None if None in seconds else sum(s for s in seconds if s is not None)

    def having(self, policy: int) -> tuple[Iteration, ...]:
        """All iterations with the policy that iteration `policy` had first."""
        return tuple(i for i in self.iterations if i.first_had == policy)

    def count(self, policy: int) -> Count:
        """The trials of the policy that iteration `policy` had first."""
        having = self.having(policy)
        return Count(sum(i.successes for i in having), sum(i.trials for i in having))


def read_summary(path: Path) -> Summary:
    """Read `summary.json`.

    Raises:
        DataError: it is missing, is not JSON, or has not the fields of a summary. Fields that an older twbal did not
            write may be missing.
    """
    try:
        return read_record(Summary, path)
    except FileNotFoundError as error:
        raise DataError(f"There is no summary at {path}. Has `twbal iterate` finished there?") from error
    except DataError as error:
        raise DataError(f"{path} is no summary of this version of `twbal iterate`: {error}") from error
