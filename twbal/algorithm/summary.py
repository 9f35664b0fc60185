"""What a run of Algorithm 1 achieved: `summary.json` as typed records."""

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from twbal.algorithm.iteration import PARTS, Iteration
from twbal.core.errors import DataError
from twbal.core.json_records import read_record


@dataclass(frozen=True)
class SimData:
    """What f was learned from.

    Attributes:
        episodes: rollouts in the simulator.
        samples: state transitions in them.
    """

    episodes: int
    samples: int


class Count(NamedTuple):
    """Trials of one policy, over all iterations that drove it in some."""

    successes: int
    trials: int


@dataclass(frozen=True)
class Summary:
    """What a run of Algorithm 1 achieved.

    Attributes:
        robot: name of the robot.
        seed: of the run.
        wall_s: how long it took [s]; of stages that were there when it went on, how long they had taken.
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
        counted = {name: [getattr(i, part) for i in self.tried(policy) if i.trials] for part, name in PARTS.items()}
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

    def tried(self, policy: int) -> tuple[Iteration, ...]:
        """Those of them that have trials of their own, or none at all."""
        return tuple(i for i in self.having(policy) if i.trials_of is None)

    def count(self, policy: int) -> Count:
        """The trials of the policy that iteration `policy` had first."""
        tried = self.tried(policy)
        return Count(sum(i.successes for i in tried), sum(i.trials for i in tried))


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
