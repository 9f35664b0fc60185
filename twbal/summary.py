"""What a run of Algorithm 1 achieved: `summary.json` as typed records, and as a table to print."""

import json
import math
import sys
import types
from dataclasses import asdict, dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

from twbal.errors import DataError
from twbal.files import read_json, write_atomically

_AMOUNTS = (
    "real_episodes",
    "real_samples",
    "real_seconds",
    "predicted_cost",
    "real_cost",
    "drift_m",
    "fit_s",
    "search_s",
)


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
        path: of its checkpoint.
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
        predicted_cost: expected long-term cost by the model (eq. 9); None where no model was asked.
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
        note: what a reader should know of it, in a sentence; may be empty.
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

    def __post_init__(self) -> None:
        if not 0 <= self.successes <= self.trials:
            raise DataError(f"Iteration {self.index} has {self.successes} successes in {self.trials} trials.")
        for name in ("coverage95", "judged_success"):
            share = getattr(self, name)
            if share is not None and not 0 <= share <= 1:
                raise DataError(f"{name} of iteration {self.index} must be a share between 0 and 1; found {share}.")
        for name in _AMOUNTS:
            amount = getattr(self, name)
            if amount is not None and not 0 <= amount < math.inf:
                raise DataError(f"{name} of iteration {self.index} must be a number from 0 up; found {amount}.")


@dataclass(frozen=True)
class Summary:
    """What a run of Algorithm 1 achieved.

    Attributes:
        robot: name of the robot.
        seed: of the run.
        wall_s: time the run took [s].
        sim: what f was learned from.
        iterations: in order, index 0 first.
        best_iteration: index of the policy to use.

    Raises:
        DataError: the indices are not 0, 1, 2, ..., or the best iteration is none of them.
    """

    robot: str
    seed: int
    wall_s: float
    sim: SimData
    iterations: tuple[Iteration, ...]
    best_iteration: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "iterations", tuple(self.iterations))
        found = [iteration.index for iteration in self.iterations]
        if not found or found != list(range(len(found))):
            raise DataError(f"A summary needs iterations 0, 1, 2, ... in order; found {found}.")
        if self.best_iteration not in found:
            raise DataError(f"The best iteration must be one of {found}; found {self.best_iteration}.")

    @property
    def best(self) -> Iteration:
        """The iteration whose policy is the one to use."""
        return self.iterations[self.best_iteration]


def write_summary(path: Path, summary: Summary) -> None:
    """Write `summary.json`."""
    text = json.dumps(asdict(summary), indent=2, ensure_ascii=False, allow_nan=False)
    write_atomically(path, text + "\n")


def read_summary(path: Path) -> Summary:
    """Read `summary.json`.

    Raises:
        DataError: it is missing, is not JSON, or has not the fields of a summary.
    """
    try:
        record = read_json(path)
    except FileNotFoundError as error:
        raise DataError(f"There is no summary at {path}. Has `twbal iterate` finished there?") from error
    except DataError as error:
        raise DataError(f"{error} Was it written by `twbal iterate`?") from error
    try:
        summary = _decode(Summary, record, "summary")
    except DataError as error:
        raise DataError(f"{path} is no summary of this version: {error}") from error
    assert isinstance(summary, Summary)
    return summary


def _decode(kind: Any, value: Any, where: str) -> object:
    """Turn plain JSON `value` into the annotated type `kind`; `where` names it in errors."""
    if get_origin(kind) is types.UnionType:
        return None if value is None else _decode(get_args(kind)[0], value, where)
    if get_origin(kind) is tuple:
        if not isinstance(value, list):
            raise DataError(f"{where} must be a list; found {repr(value)[:80]}.")
        return tuple(_decode(get_args(kind)[0], item, f"{where}[{i}]") for i, item in enumerate(value))
    if is_dataclass(kind):
        return _decode_record(kind, value, where)
    accepted = (int, float) if kind is float else (kind,)
    if isinstance(value, bool) or not isinstance(value, accepted) or _is_beyond_floats(value):
        raise DataError(f"{where} must be a value of type {kind.__name__}; found {repr(value)[:80]}.")
    return kind(value)


def _is_beyond_floats(value: object) -> bool:
    return isinstance(value, int) and abs(value) > sys.float_info.max


def _decode_record(kind: Any, value: Any, where: str) -> object:
    if not isinstance(value, dict):
        raise DataError(f"{where} must be a record; found {repr(value)[:80]}.")
    names = [field.name for field in fields(kind)]
    hints = get_type_hints(kind)
    for problem, odd in (("lacks", set(names) - set(value)), ("has the unknown field", set(value) - set(names))):
        if odd:
            raise DataError(f"{where} {problem} {sorted(odd)[0]!r}; its fields are: {', '.join(names)}.")
    return kind(**{name: _decode(hints[name], value[name], f"{where}.{name}") for name in names})


_COLUMNS = ("iteration", "real data", "cost predicted", "real", "balances", "in 95 % band", "drift", "fit", "search")


def summary_table(summary: Summary) -> str:
    """The iterations as lines of plain text, the best one marked, and what to make of them."""
    rows = [_COLUMNS, *(_cells(iteration, summary.best_iteration) for iteration in summary.iterations)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(_COLUMNS))]
    lines = ["  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    best = summary.best
    lines += [
        "",
        f"Best: iteration {best.index}, {best.successes} of {best.trials} trials, from {best.real_seconds:.1f} s of "
        f"driving the robot ({summary.wall_s:.0f} s in all).",
        f"Its policy: {best.policy.path} (sha256 {best.policy.sha256[:12]})",
    ]
    return "\n".join(lines)


def _cells(iteration: Iteration, best: int) -> tuple[str, ...]:
    return (
        f"{'*' if iteration.index == best else ' '} {iteration.index}",
        f"{iteration.real_samples} samples, {iteration.real_seconds:.1f} s",
        _number(iteration.predicted_cost, ".1f"),
        _number(iteration.real_cost, ".1f"),
        f"{iteration.successes} of {iteration.trials}" if iteration.trials else "-",
        _number(iteration.coverage95, ".2f"),
        _number(iteration.drift_m, ".2f", " m"),
        f"{iteration.fit_s:.1f} s",
        f"{iteration.search_s:.1f} s",
    )


def _number(value: float | None, form: str, unit: str = "") -> str:
    return "-" if value is None else f"{value:{form}}{unit}"
