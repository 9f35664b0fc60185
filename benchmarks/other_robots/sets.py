"""The sets: what is asked of each, by its stratum and seed alone.

A stratum's factors (excitation, rate, sheet, tolerance, sensors, effect) run through all their levels in blocks of
drawn order, each on its own, so that the first sets of a stratum are balanced whatever their number.
"""

import hashlib
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from benchmarks.other_robots.kinds import ALIKE, FOREIGN, KNOWN_AS, KNOWN_SINCE, LATER, SHEET, STRUCTURAL, alike
from benchmarks.other_robots.robots import ITEMS, is_real

SINGLE = {"single 1": 1.0, "single 1/4": 0.25, "single 1/8": 0.125}
ADDED = {"added 1": 1.0, "added 1/4": 0.25, "added 1/8": 0.125}
MANY = {"pairs": 2, "triples": 3, "five": 5, "eight": 8}
FRAMES = {"frame 1": 1.0, "frame 1/4": 0.25, "frame 1/8": 0.125}
SHAFTS = {"shaft 1": 1.0, "shaft 1/4": 0.25, "shaft 1/8": 0.125}
ONE_SENSOR = {"sensors clean": 0.0, "sensors 1": 1.0, "sensors 1/4": 0.25}
STRATA = (
    "clean",
    *SINGLE,
    *MANY,
    "sheet",
    "foreign",
    "left out",
    "calibration",
    *ADDED,
    "lost",
    *ONE_SENSOR,
    *FRAMES,
    *SHAFTS,
)
EXCITATIONS, RATES, TOLERANCES, SENSORS = ("E", "N"), (50, 100, 200), (0.03, 0.15), ("ideal", "real")
SHEETS = ("paper", "regbot", "esp32", "balboa")
_GEARED = ("regbot", "balboa")  # sheets on which rotors are more than a hundredth of what turns
_FACTORS = ("excitation", "rate", "sheet", "tolerance", "sensors", "effect")


class Set(NamedTuple):
    """One set of recordings.

    Attributes:
        stratum, seed: name it, and determine all of it.
        excitation: "E", a balancing robot is shaken, or "N", it follows steps of the speed.
        rate: of its control [Hz]; an odd one is 70 Hz, or a period of 30 ms on `paper` robots.
        sheet: name of its data sheet.
        tolerance: by which its numbers may be off those of the sheet.
        sensors: "ideal", "real", or the one item of ITEMS that is real.
        effects: what is hidden, with its severity.
        left_out: effects that the diagnosis must do without.
        is_bare: whether it is recorded without its effects, to ask beforehand what its recordings could show.
    """

    stratum: str
    seed: int
    excitation: str
    rate: float
    sheet: str
    tolerance: float
    sensors: str
    effects: dict[str, float]
    left_out: tuple[str, ...]
    is_bare: bool = False

    @property
    def name(self) -> str:
        """Of its folder; says nothing of what is hidden."""
        words = f"{self.stratum} {self.seed}{' bare' if self.is_bare else ''}"
        return "set_" + hashlib.sha256(words.encode()).hexdigest()[:10]

    def bare(self) -> "Set":
        """The same robot, loop and noise without the effects."""
        return self._replace(effects={}, is_bare=True)

    def has(self, item: str) -> bool:
        """Whether an item of its sensors or its loop is real."""
        return is_real(item, self.sensors)

    def generator(self, purpose: int) -> np.random.Generator:
        """Of random numbers for one purpose."""
        return np.random.default_rng([self.seed, STRATA.index(self.stratum), purpose])


def sets(strata: Sequence[str], seeds: Sequence[int]) -> list[Set]:
    """One set of each stratum for each seed."""
    return [designed(stratum, seed) for seed in seeds for stratum in strata]


def designed(stratum: str, seed: int) -> Set:
    """The set of a stratum and a seed."""
    rng = np.random.default_rng([seed, STRATA.index(stratum), 0])
    rate, excitation = _level(stratum, seed, "rate", RATES), _level(stratum, seed, "excitation", EXCITATIONS)
    tolerance, sheet = _level(stratum, seed, "tolerance", TOLERANCES), _level(stratum, seed, "sheet", SHEETS)
    left_out: tuple[str, ...] = ()
    if stratum in SINGLE:
        effects = {_level(stratum, seed, "effect", tuple(STRUCTURAL)): SINGLE[stratum]}
    elif stratum in ADDED:
        effects = {_level(stratum, seed, "effect", KNOWN_SINCE): ADDED[stratum]}
    elif stratum in FRAMES:
        effects = {"flexible_frame": FRAMES[stratum]}
    elif stratum in SHAFTS:
        effects = {"backlash_behind_encoder": SHAFTS[stratum]}
    elif stratum in MANY:
        effects = _several(MANY[stratum], 0.25, tolerance, rng)
    elif stratum == "sheet":
        effects, tolerance = {_level(stratum, seed, "effect", tuple(SHEET)): 1.0}, min(TOLERANCES)
    elif stratum == "foreign":
        name = _level(stratum, seed, "effect", tuple(FOREIGN))
        known = KNOWN_AS.get(name, name)
        effects, left_out = {name: 1.0}, (known,) if known in (*KNOWN_SINCE, *LATER) else ()
    elif stratum == "left out":
        name = _level(stratum, seed, "effect", tuple(STRUCTURAL))
        effects, left_out = {name: 1.0}, tuple(sorted(alike(name)))
    elif stratum in ONE_SENSOR:
        severity = ONE_SENSOR[stratum]
        effects = {_level(stratum, seed, "effect", tuple(STRUCTURAL)): severity} if severity else {}
    elif stratum == "lost":
        effects = {"command_loss": float(np.exp(rng.uniform(np.log(1.0 / 32.0), 0.0)))}
    elif stratum == "calibration":
        effects = _several(int(rng.choice([0, 1, 1, 1, 2, 3])), 1.0 / 32.0, tolerance, rng)
    else:
        effects = {}
    if "rotor_inertia" in effects and sheet not in _GEARED:
        sheet = _GEARED[seed % 2]
    sensors = _level(stratum, seed, "sensors", ITEMS if stratum in ONE_SENSOR else SENSORS)
    if sensors == "odd rate":
        rate = 1.0 / 0.03 if sheet == "paper" else 70
    return Set(stratum, seed, excitation, rate, sheet, tolerance, sensors, effects, left_out)


def _several(count: int, least: float, tolerance: float, rng: np.random.Generator) -> dict[str, float]:
    """Distinct effects, of which none is a case of another, with severities from `least` to 1."""
    names = [*STRUCTURAL, *(["torque_gain"] if tolerance == min(TOLERANCES) else [])]
    chosen: list[str] = []
    while len(chosen) < count:
        name = names[rng.integers(len(names))]
        geared = {"backlash", "rotor_inertia"}  # both are about rotors
        if name not in chosen and not any({name, other} <= group for other in chosen for group in (*ALIKE, geared)):
            chosen.append(name)
    return {name: float(np.exp(rng.uniform(np.log(least), 0.0))) for name in chosen}


def _level(stratum: str, seed: int, factor: str, levels: tuple[Any, ...]) -> Any:
    block, place = divmod(seed, len(levels))
    key = [STRATA.index(stratum), _FACTORS.index(factor), block, 9]
    return levels[int(np.random.default_rng(key).permutation(len(levels))[place])]
