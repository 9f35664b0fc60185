"""What Algorithm 1 has learned, step by step."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Generic, NamedTuple

from twbal.algorithm.iteration import Base, Basis, DiagnosisOutcome
from twbal.algorithm.steps import M, P, R


@dataclass(frozen=True)
class LearnedPolicy(Generic[R, M, P]):
    """One policy and how it came about.

    Attributes:
        index: 0 is the policy before any update.
        policy: with what was predicted of it.
        basis: what it was made from.
        model: that it was searched on and predicted with; None where there is none.
        f: from simulation, of which that model has another one, or none, where `base` says so; None: there is none.
        base: what g of that model was learned on top of.
        log_evidences: of the real transitions under each candidate for it [nats]; empty where there was no choice.
        fit_s: time of the model fits that it took [s].
        search_s: time of the policy searches that it took [s].
        searches: how often it was searched until it balanced in simulation.
        rollouts: real ones that it was learned from.
        trials: of it; None where none were driven.
        trials_of: the earlier policy, the same as this, that was driven in them; None where this one was.
        diagnosis: what became of a diagnosis of the rollouts.
        recalibrates: the policy is that of the iteration before, and only the model is new.
    """

    index: int
    policy: P
    basis: Basis
    model: M | None = None
    f: M | None = None
    fit_s: float = 0.0
    search_s: float = 0.0
    searches: int = 1
    rollouts: tuple[R, ...] = ()
    trials: R | None = None
    trials_of: int | None = None
    diagnosis: DiagnosisOutcome = DiagnosisOutcome.NOT_MADE
    recalibrates: bool = False
    base: Base = Base.GIVEN
    log_evidences: Mapping[Base, float] = field(default_factory=dict)

    @property
    def evidence_gain(self) -> float | None:
        """How much likelier the real transitions are under it than under the next best base [nats]; None: no choice."""
        others = [value for base, value in self.log_evidences.items() if base is not self.base]
        return self.log_evidences[self.base] - max(others) if others else None

    @property
    def predicted(self) -> bool:
        """Whether a model has said what to expect of the policy."""
        return self.basis in (Basis.SIMULATION, Basis.CORRECTED, Basis.ROBOT)


@dataclass(frozen=True)
class UpdateInputs(Generic[R, M, P]):
    """What an update learns from.

    Attributes:
        index: of the policy that comes of it.
        place: for its results.
        rollouts: all real ones.
        earlier: policies so far, oldest first.
        f: of the newest policy; None where there is none.
        recalibration: rollouts of the newest policy, which stays; empty where a new one is searched.
        drivers: policies that drove the robot in `rollouts`, if not those in `earlier`.
        with_margin: whether the policy is to balance robots that change, too.
        set_aside: indices of policies in `earlier` that are not to be chosen again.
        has_failed: whether the newest policy is that of an update and failed: a diagnosis is worth its time then.
    """

    index: int
    place: Path
    rollouts: tuple[R, ...]
    earlier: tuple[P, ...]
    f: M | None
    recalibration: tuple[R, ...] = ()
    drivers: tuple[P, ...] | None = None
    with_margin: bool = False
    set_aside: tuple[int, ...] = ()
    has_failed: bool = False


class RunResult(NamedTuple, Generic[R, M, P]):
    """All that was learned.

    Attributes:
        simulated: rollouts that the first f was learned from.
        policies: policy 0 and one for each update.
    """

    simulated: tuple[R, ...]
    policies: tuple[LearnedPolicy[R, M, P], ...]
