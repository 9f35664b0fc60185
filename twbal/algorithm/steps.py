"""The steps of Algorithm 1: what it asks to be done, whoever does it, and wherever the results lie."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar

from twbal.algorithm.iteration import PolicyFile
from twbal.algorithm.prediction import Prediction
from twbal.core.episode import Episode

R = TypeVar("R")
"""Rollouts: a folder of logs, or episodes."""
M = TypeVar("M")
"""A model of the dynamics, or its checkpoint."""
P = TypeVar("P")
"""A policy with what was predicted of it, or their checkpoints."""
S = TypeVar("S")
"""A simulation with what a diagnosis or an identification found, or its file."""
K = TypeVar("K")
"""What is known of the robot's parameters, or its file."""
T = TypeVar("T")


class Timed(NamedTuple, Generic[T]):
    """What a step made, and how long that took [s]."""

    value: T
    seconds: float


@dataclass(frozen=True)
class Conditions:
    """How rollouts are driven, as in `RolloutSettings`; None: as the settings say."""

    trials: int | None = None
    first_trial: int | None = None
    steps: int | None = None
    tilt_limit: float | None = None
    exploration: float | None = None

    @property
    def given(self) -> dict[str, Any]:
        """Those that are not left to the settings, by name."""
        return {name: value for name, value in asdict(self).items() if value is not None}


AS_CONFIGURED = Conditions()


@dataclass(frozen=True)
class SearchInputs(Generic[R, M, P, K]):
    """What a policy search is given.

    Attributes:
        models: that the policy is to serve.
        earlier: policies so far, oldest first.
        base: regulator that stays beneath the network that is searched; None searches the whole policy.
        recalibration: real rollouts of the one policy in `earlier`. Where there are some, nothing is searched: that
            policy is predicted, in bands as wide as these rollouts ask for.
        known: of the robot's parameters by its rollouts; None: by its sheet and the simulation.
        with_margin: whether the policy is to balance robots that change, too.
        set_aside: indices of policies in `earlier` that are not to be chosen again.
    """

    models: Sequence[M]
    earlier: Sequence[P]
    base: P | None = None
    recalibration: Sequence[R] = ()
    known: K | None = None
    with_margin: bool = False
    set_aside: Sequence[int] = ()


class CorrectedSimulation(NamedTuple, Generic[S]):
    """What came of a diagnosis.

    Attributes:
        simulation: with what was found.
        closed: share of the simulation error beyond the noise floor, on held-out data, that it closes.
    """

    simulation: S
    closed: float


class Identified(NamedTuple, Generic[K, S]):
    """What came of an identification.

    Attributes:
        known: of the robot's parameters.
        simulation: with the mean of these.
    """

    known: K
    simulation: S


class FittedDifference(NamedTuple, Generic[M]):
    """f + g, and what f was chosen by.

    Attributes:
        model: f + g.
        base: index of the base that it has.
        log_evidences: of the real transitions under each base [nats]; empty where there was one base only.
    """

    model: M
    base: int = 0
    log_evidences: tuple[float, ...] = ()


class Steps(ABC, Generic[R, M, P, S, K]):
    """Does what Algorithm 1 asks for: as stages with files, or in memory.

    Each step has a place, a relative path that no other step of the run has: a folder for its results, or just a name.

    Attributes:
        ensemble: names of further simulated robots that policy 0 must serve.
        identifies: whether searches ask what is known of the robot's parameters.
        known: of the robot's parameters before the run, by rollouts; None: there were none.
        robot_waits: whether the robot waits for its host, so that it does not matter what else is computed meanwhile.
    """

    ensemble: Sequence[str]
    identifies: bool
    known: K | None
    robot_waits: bool = False

    def begun_ahead(self, work: Callable[[], object], drives: bool = False) -> AbstractContextManager[None]:
        """Lets steps begin, as far as they can, while a body runs; they are asked for again after it.

        Args:
            work: asks for these steps.
            drives: whether they drive the robot.
        """
        return nullcontext()

    def say(self, line: str) -> None:
        """Tell the person something that no single step knows."""
        return None

    def was_driven(self, place: Path) -> bool:
        """Whether the robot was driven at a place already, in a run that goes on where it had ended."""
        return False

    @abstractmethod
    def simulate(
        self,
        place: Path,
        policy: P | None,
        conditions: Conditions = AS_CONFIGURED,
        simulation: S | None = None,
    ) -> R:
        """Drive the simulated robot by a policy (None: at random), in a corrected simulation where one is given."""

    @abstractmethod
    def simulate_variant(self, place: Path, name: str) -> R:
        """Drive a variant of the simulated robot at random."""

    @abstractmethod
    def drive(self, place: Path, policy: P | None, conditions: Conditions) -> R:
        """Drive the robot by a policy (None: at random)."""

    @abstractmethod
    def fit_simulation(self, place: Path, rollouts: Sequence[R]) -> Timed[M]:
        """Learn f from simulated rollouts."""

    @abstractmethod
    def fit_difference(
        self, place: Path, bases: Sequence[M | None], rollouts: Sequence[R]
    ) -> Timed[FittedDifference[M]]:
        """Learn g from real rollouts, on top of the base that they are likeliest under; None is no simulation."""

    @abstractmethod
    def identify(self, place: Path, rollouts: Sequence[R]) -> Timed[Identified[K, S]]:
        """Tell the robot's parameters by real rollouts."""

    @abstractmethod
    def search(self, place: Path, inputs: SearchInputs[R, M, P, K]) -> Timed[P]:
        """Search a policy, and predict what it does."""

    @abstractmethod
    def regulator(self, place: Path, rollouts: Sequence[R]) -> Timed[P]:
        """The linear-quadratic regulator of a linear model of real rollouts; of none: of the nominal parameters."""

    @abstractmethod
    def agent(self, place: Path, trained: str | None) -> Timed[P]:
        """A model-free agent: that of the folder `trained`, or one that is trained now."""

    @abstractmethod
    def diagnose(self, place: Path, rollouts: Sequence[R]) -> CorrectedSimulation[S]:
        """Look for what the simulation lacks to explain real rollouts."""

    @abstractmethod
    def episodes(self, rollouts: Sequence[R]) -> tuple[Episode, ...]:
        """What was recorded."""

    @abstractmethod
    def prediction(self, policy: P) -> Prediction:
        """What a model expects of a policy that was searched on it."""

    @abstractmethod
    def policy_file(self, policy: P) -> PolicyFile:
        """Which policy it is."""
