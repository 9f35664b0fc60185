"""Settings of a run of Algorithm 1."""

from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import accumulate


class InitialPolicy(StrEnum):
    """Where policy 0 comes from."""

    SIMULATION = "simulation"
    """A search on f."""
    RANDOM = "random"
    """A search on a model of the whole dynamics, from random rollouts of the robot."""
    LQR = "lqr"
    """The linear-quadratic regulator of the nominal parameters."""
    AGENT = "agent"
    """A model-free agent, trained in simulation."""


class ModelUpdate(StrEnum):
    """What is learned from the robot's rollouts."""

    RESIDUAL = "residual"
    """g, on top of f."""
    FULL = "full"
    """The whole dynamics, without f."""
    LINEAR = "linear"
    """A linear model, whose regulator is the policy."""


@dataclass(frozen=True)
class AlgorithmSettings:
    """How often and how much; see conf/iterate.yaml.

    Attributes:
        seed: of the run.
        updates: of model and policy, each by real rollouts.
        trials: of each policy, as long as the success rule says; nothing is learned from them.
        stop_when_solved: no more updates once all trials of a policy succeed.
        improve: whether the first policy that solved it is followed by one more update, whose policy is to balance
            robots that change, too, and by a second one where the tilt oscillates under the best of them; only where
            robots of the parameter distribution judge.
        oscillation_limit: of the tilt, peak to peak [rad]; of policies that succeed as often, one that stays below it
            in every trial is the best, and one that does not is no candidate of these updates; None: none.
        min_update_time: that the rollouts of an update last together; where one falls at once, further ones follow [s].
        max_update_rollouts: calls of the robot for an update, at most.
        calibration_rollouts: of the policy that solved it, from which the model is recalibrated; 0: none.
        calibration_steps: control periods of each of them.
        sim_rounds: how often f is learned once more from rollouts of its own policy.
        sim_round_rollouts: in each of these rounds.
        sim_round_exploration: standard deviation of the noise on their command, as a share of the torque limit.
        base_by_evidence: whether the simulation with the parameters that real rollouts tell, after an update that
            failed the one with what a diagnosis finds, and none are further bases of g; where searches ask for these
            parameters.
        diagnose: whether what the real rollouts show to be missing enters the given simulation in each update.
        search_retries: validation rounds in the corrected simulation, at most, after each of which a policy that fails
            there is searched anew.
        initial_policy: where policy 0 comes from.
        random_rollouts: of the robot, where it is driven at random first.
        model_update: what is learned from the robot's rollouts.
        on_lqr: whether a network on top of the regulator of the nominal parameters is searched.
        trained_agent: run folder of an agent that was trained before, or its policy.pt; None trains one.
    """

    seed: int
    updates: int
    trials: int
    stop_when_solved: bool
    improve: bool
    oscillation_limit: float | None
    min_update_time: float
    max_update_rollouts: int
    calibration_rollouts: int
    calibration_steps: int
    sim_rounds: int
    sim_round_rollouts: int
    sim_round_exploration: float
    base_by_evidence: bool
    diagnose: bool
    search_retries: int
    initial_policy: InitialPolicy
    random_rollouts: int
    model_update: ModelUpdate
    on_lqr: bool
    trained_agent: str | None


@dataclass(frozen=True)
class RolloutSettings:
    """Which rollouts are driven, and for how long.

    Attributes:
        seed: of the policy's randomness; of a simulated robot also of its starts and its noise.
        trials: how many.
        first_trial: number of the first; a simulated robot draws start and noise from it.
        steps: control periods of each, at most.
        tilt_limit: at which one ends [rad].
        exploration: standard deviation of the noise on the command, as a share of the torque limit.
        exploration_steps: control periods at the beginning that have it; None: all.
        yield_to_pushes: whether a robot that is pushed rolls on and brakes gently; None: as its sheet says.
    """

    seed: int
    trials: int
    first_trial: int
    steps: int
    tilt_limit: float
    exploration: float
    exploration_steps: int | None = None
    yield_to_pushes: bool | None = None

    @property
    def numbers(self) -> range:
        """Of the rollouts."""
        return range(self.first_trial, self.first_trial + self.trials)

    def parts(self, count: int) -> list["RolloutSettings"]:
        """The same rollouts in so many parts of consecutive numbers, at most one longer than another."""
        each, more = divmod(self.trials, count)
        sizes = [each + (part < more) for part in range(count)]
        begins = accumulate(sizes, initial=self.first_trial)
        return [replace(self, first_trial=begin, trials=size) for begin, size in zip(begins, sizes, strict=False)]
