"""The sets of the benchmark: what is hidden in each, and on what the robot drives."""

from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from benchmarks.hidden_effects.faults import ALIKE, FOREIGN, KNOWN_SINCE, SHEET, STRUCTURAL
from benchmarks.hidden_effects.truth import Surface

SERIAL = "serial"
"""Sets that the virtual robot behind its port makes, and not the hidden robot of this benchmark."""
STRATA = (
    "severity 1",
    "severity 1/4",
    "severity 1/8",
    "clean",
    "uneven",
    "data sheet",
    "pairs",
    "left out",
    "foreign",
    "still",
    SERIAL,
)
_SEVERITIES = {"severity 1": 1.0, "severity 1/4": 0.25, "severity 1/8": 0.125}
_CLEAN, _UNEVEN, _PAIRS, _LEFT_OUT, _SERIAL = 20, 10, 5, 5, 5  # sets for each seed


class Set(NamedTuple):
    """One data set.

    Attributes:
        name: of its folder; says nothing of what is hidden.
        stratum: of the benchmark.
        effects: what is hidden, at which severity; the virtual robot hides what it draws itself.
        surface: that the robot drives on.
        left_out: effects that the diagnosis must do without.
        still: nothing is excited: the robot stands and balances.
        seed: of all that is drawn.
    """

    name: str
    stratum: str
    effects: dict[str, float]
    surface: Surface
    left_out: tuple[str, ...]
    still: bool
    seed: int


def sets(seeds: Sequence[int], strata: Sequence[str]) -> list[Set]:
    """All sets of some strata for some seeds."""
    found = [each for stratum in strata for seed in seeds for each in _stratum(stratum, seed)]
    order = np.random.default_rng(0).permutation(len(found))
    return [found[k]._replace(name=f"set_{seeds[0]}_{i:04d}") for i, k in enumerate(order)]


def _stratum(stratum: str, seed: int) -> Iterator[Set]:
    level, rng = Surface(), np.random.default_rng([seed, STRATA.index(stratum)])

    def one(
        effects: dict[str, float], surface: Surface = level, left_out: tuple[str, ...] = (), still: bool = False
    ) -> Set:
        return Set("", stratum, effects, surface, left_out, still, int(rng.integers(2**31)))

    if stratum in _SEVERITIES:
        for name in STRUCTURAL:
            yield one({name: _SEVERITIES[stratum]})
    elif stratum == "clean":
        for _ in range(_CLEAN):
            yield one({})
    elif stratum == "uneven":
        for i in range(_UNEVEN):
            bumps, turn = (rng.uniform(0.001, 0.01), 0.0) if i % 2 else (0.0, rng.uniform(0.5, 1.5))
            yield one({}, Surface(bumps, 0.7, turn))
    elif stratum == "data sheet":
        for name in SHEET:
            yield one({name: 1.0})
    elif stratum == "pairs":
        pairs = list(combinations(STRUCTURAL, 2))
        for k in rng.choice(len(pairs), _PAIRS, replace=False):
            yield one(dict.fromkeys(pairs[k], 1.0))
    elif stratum == "left out":
        for i in range(_LEFT_OUT):  # each in turn, over five seeds
            name = list(STRUCTURAL)[(_LEFT_OUT * seed + i) % len(STRUCTURAL)]
            alike = next((group for group in ALIKE if name in group), {name})
            yield one({name: 1.0}, left_out=tuple(sorted(alike)))
    elif stratum == "foreign":
        for name in FOREIGN:
            yield one({name: 1.0}, left_out=(name,) if name in KNOWN_SINCE else ())
    elif stratum == SERIAL:
        for _ in range(_SERIAL):
            yield one({})
    else:
        for name in ("coulomb_friction", "torque_gain", "viscous_friction"):
            yield one({name: 1.0}, still=True)
