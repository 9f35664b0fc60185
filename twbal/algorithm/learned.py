"""What Algorithm 1 has learned, step by step."""

from dataclasses import dataclass
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
        f: from simulation, of which that model has another one where `base` says so; None where there is none.
        base: which f that model has.
        evidence_gain: by how much likelier the real transitions are under that f than under the next best [nats]; None
            where there was no choice.
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
    evidence_gain: float | None = None

    @property
    def predicted(self) -> bool:
        """Whether a model has said what to expect of the policy."""
        return self.basis in (Basis.SIMULATION, Basis.CORRECTED, Basis.ROBOT)


class RunResult(NamedTuple, Generic[R, M, P]):
    """All that was learned.

    Attributes:
        simulated: rollouts that the first f was learned from.
        policies: policy 0 and one for each update.
    """

    simulated: tuple[R, ...]
    policies: tuple[LearnedPolicy[R, M, P], ...]
