"""What a run of Algorithm 1 is told, what it asks, and what it has learned."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from twbal.algorithm.summary import Basis, Diagnosis
from twbal.cli.manifest import Manifest
from twbal.cli.stages.optimise_policy import POLICY, PREDICTION


@dataclass(frozen=True)
class Settings:
    """See conf/stage/iterate.yaml."""

    seed: int
    updates: int
    trials: int
    stop_when_solved: bool
    confirm_rollouts: int
    confirm_steps: int
    sim_rounds: int
    sim_round_rollouts: int
    sim_round_exploration: float
    diagnose: bool
    rehearsals: int
    first: str
    first_rollouts: int
    update: str
    on_regulator: bool
    trained: str | None


@dataclass(frozen=True)
class Learned:
    """One policy and how it came about; folders lie within the run folder.

    Attributes:
        index: 0 is the policy before any update.
        fits: manifests of the model fits that it took.
        searches: manifests of the policy searches that it took.
        rollouts: run folders of the real rollouts that g was learned from.
        policy: folder of the search's result.
        f: model of the simulation that it was learned from; the one from the simulation as it is, or as it was mended;
            None where there is none.
        trials: run folder of the trials; None where none were driven.
        basis: what the policy was made from.
        diagnosis: what became of a diagnosis of the rollouts.
        confirms: the policy is that of the iteration before, and only the model is new.
    """

    index: int
    fits: tuple[Manifest, ...]
    searches: tuple[Manifest, ...]
    rollouts: tuple[Path, ...]
    policy: Path
    f: Path | None
    basis: Basis
    trials: Path | None = None
    diagnosis: Diagnosis = Diagnosis.NOT_MADE
    confirms: bool = False

    @property
    def predicted(self) -> bool:
        """Whether a model has said what to expect of the policy."""
        return self.basis in (Basis.SIMULATION, Basis.CORRECTED, Basis.ROBOT)

    @property
    def policy_file(self) -> Path:
        """The policy's checkpoint."""
        return self.policy / POLICY

    @property
    def prediction_file(self) -> Path:
        """What the model expected of it."""
        return self.policy / PREDICTION


class Learning(NamedTuple):
    """All that was learned.

    Attributes:
        simulated: run folders of the simulated rollouts.
        policies: policy 0 and one for each update.
    """

    simulated: tuple[Path, ...]
    policies: tuple[Learned, ...]


class Lesson(NamedTuple):
    """What an update learns from.

    Attributes:
        number: index of the policy that comes of it.
        rollouts: run folders of all real rollouts.
        earlier: policies so far, oldest first.
        place: for its results.
        newest: what was learned last; None before the first policy.
        searching: what the search is told beside.
    """

    number: int
    rollouts: tuple[Path, ...]
    earlier: tuple[Path, ...]
    place: Path
    newest: Learned | None
    searching: dict[str, Any]


class Questions(NamedTuple):
    """What the algorithm asks about rollouts.

    Attributes:
        solved: whether all trials in a run folder, real or simulated, succeeded.
        diagnosable: whether the real rollouts in run folders are enough for a diagnosis.
        mended: whether the diagnosis in a run folder closes the better part of the gap.
    """

    solved: Callable[[Path], bool]
    diagnosable: Callable[[Sequence[Path]], bool]
    mended: Callable[[Path], bool]
