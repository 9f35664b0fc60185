"""Looks settings up: which row of the table belongs to a key of a stage."""

from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any, NamedTuple

from twbal.cli.settings.diagnosis_settings import DIAGNOSIS
from twbal.cli.settings.import_settings import IMPORT
from twbal.cli.settings.kinds import Kind, Setting, holds_settings
from twbal.cli.settings.link_settings import FAULTS, LINK
from twbal.cli.settings.model_settings import MODEL
from twbal.cli.settings.nested_settings import ancestors, flattened
from twbal.cli.settings.perturbation_settings import PERTURBATION
from twbal.cli.settings.robot_settings import (
    CONTROL_PERIOD,
    COURSE,
    MASS,
    POLICY,
    ROBOT,
    SIMULATION,
    START,
    STATE,
    TORQUE_LIMIT,
    WHEEL_MASS,
)
from twbal.cli.settings.search_settings import AGENT, COST, PARAMETRISATION, ROBUST, RULE, SEARCH, VALIDATION
from twbal.cli.settings.stage_settings import SECTIONS, STAGES

GROUPS = {
    "Robot": ROBOT,
    "Start": START,
    "State": STATE,
    "Simulation": SIMULATION,
    "Policy that drives": POLICY,
    "Course": COURSE,
    "Model": MODEL,
    "Cost": COST,
    "Parametrisation of policies": PARAMETRISATION,
    "Search": SEARCH,
    "Robots of the parameter distribution": ROBUST,
    "Success": RULE,
    "Validation": VALIDATION,
    "Agent": AGENT,
    "Diagnosis": DIAGNOSIS,
    "Link": LINK,
    "Virtual robot": FAULTS,
    "Perturbations": PERTURBATION,
    "Import": IMPORT,
}
"""Settings that stages share, by what they are of."""

OURS = "twbal."  # begins the `_target_` of what the table knows
_OWN_OF_HYDRA = ("_target_", "_partial_", "_convert_", "_recursive_", "_args_")


class Leaf(NamedTuple):
    """A value of a configuration that has no values under it.

    Attributes:
        key: dotted.
        value: plain; an empty mapping too.
        is_foreign: it belongs to a class that is not of twbal, so the table does not know what it means.
    """

    key: str
    value: Any
    is_foreign: bool


class _Index(NamedTuple):
    """Rows, prepared for being looked up.

    Attributes:
        rows: by key.
        patterns: those with a free name in their keys.
        parts: keys that rows stand under.
        free_parts: those with a free name.
    """

    rows: dict[str, Setting]
    patterns: list[Setting]
    parts: set[str]
    free_parts: list[str]


@cache
def _index(rows: tuple[Setting, ...]) -> _Index:
    parts = {part for row in rows for part in ancestors(row.key)}
    patterns = [row for row in rows if "*" in row.key]
    return _Index({row.key: row for row in rows}, patterns, parts, [part for part in parts if "*" in part])


class Table:
    """The rows that a stage can have, for the robot at hand.

    Args:
        stage: its name on the command line.
        tree: its configuration, as plain values.
    """

    def __init__(self, stage: str, tree: Mapping[str, Any]) -> None:
        own, effects = _index(stage_settings(stage)), _index(tuple(_effect_rows(tree)))
        self._rows = {**own.rows, **effects.rows}
        self._parts = own.parts | effects.parts
        self._patterns, self._free_parts = own.patterns, own.free_parts

    def row(self, key: str) -> Setting | None:
        """The row of a dotted key; None where the table has none."""
        found = self._rows.get(key)
        return found or next((row for row in self._patterns if _matches(row.key, key)), None)

    def has_parts(self, key: str) -> bool:
        """Whether rows stand under a key."""
        return key in self._parts or any(_matches(part, key) for part in self._free_parts)

    def names_in(self, key: str) -> list[str]:
        """Names of what stands directly under a key."""
        depth = key.count(".") + 1
        rows = [*self._rows, *(row.key for row in self._patterns)]
        under = [row.split(".") for row in rows if row.count(".") >= depth and _matches(_first(row, depth), key)]
        return list(dict.fromkeys(names[depth] for names in under))

    def row_above(self, key: str) -> Setting | None:
        """The row of a single value, under which the key would lie."""
        rows = (self.row(part) for part in ancestors(key) if not self.has_parts(part))
        return next((row for row in rows if row is not None and not holds_settings(row.kind)), None)


@cache
def stage_settings(stage: str) -> tuple[Setting, ...]:
    """All rows that a stage can have, but for those of effects."""
    of_others = (
        row._replace(key=f"{name}.{row.key}", common=False) for name, other in SECTIONS.items() for row in STAGES[other]
    )
    return (*of_others, *(row for rows in GROUPS.values() for row in rows), *STAGES[stage])


def leaves(tree: Mapping[str, Any]) -> Iterator[Leaf]:
    """Every value of a configuration, but for what Hydra itself reads."""
    values = dict(flattened(tree))
    targets = ((key.removesuffix("_target_"), value) for key, value in values.items() if key.endswith("._target_"))
    foreign = tuple(place for place, target in targets if not is_known(str(target)))
    for key, value in values.items():
        if key.rpartition(".")[2] not in _OWN_OF_HYDRA:
            yield Leaf(key, value, key.startswith(foreign))


def effects_in(tree: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """The effects of a simulation and its ensemble, by their dotted keys."""
    places = {"sim.effects": _mapping(_mapping(tree.get("sim")).get("effects"))}
    places |= {f"ensemble.{name}": _mapping(effects) for name, effects in _mapping(tree.get("ensemble")).items()}
    for place, effects in places.items():
        yield from ((f"{place}.{name}", effect) for name, effect in effects.items() if isinstance(effect, Mapping))


def is_known(target: str) -> bool:
    """Whether the table knows what the class is that a `_target_` stands for: of twbal, or an effect of its library."""
    from twbal.effects.library import effect_of  # here, as effects need numpy, before which threads are set

    return target.startswith(OURS) or effect_of(target) is not None


def _effect_rows(tree: Mapping[str, Any]) -> Iterator[Setting]:
    """Rows of the effects that a configuration has."""
    from twbal.cli.settings.effect_settings import effect_settings
    from twbal.effects.library import all_effects, effect_of

    robot = _mapping(tree.get("robot"))
    limit = _number(robot.get("torque_limit"), TORQUE_LIMIT, 20.0)
    period = _number(robot.get("control_period"), CONTROL_PERIOD, 0.02)
    body, wheel = _number(robot.get("body_mass"), MASS, 10.0), _number(robot.get("wheel_mass"), WHEEL_MASS, 1.0)
    sizes = limit, period, body + 2.0 * wheel
    for key, effect in effects_in(tree):
        found = effect_of(str(effect.get("_target_", "")))
        if found is not None:
            yield from effect_settings(key, found, *sizes)
    known = all_effects()
    for name in _mapping(_mapping(tree.get("sim")).get("draws")):
        if name in known:
            yield from effect_settings(f"sim.draws.{name}", known[name], *sizes, drawn=True)


def _mapping(value: Any) -> Mapping[str, Any]:
    return value if isinstance(value, Mapping) else {}


def _number(value: Any, kind: Kind, otherwise: float) -> float:
    """`value`, or another where it cannot be right."""
    return float(value) if kind.takes(value) else otherwise


def _first(key: str, count: int) -> str:
    """The first names of a dotted key."""
    return ".".join(key.split(".")[:count])


def _matches(pattern: str, key: str) -> bool:
    wanted, names = pattern.split("."), key.split(".")
    return len(wanted) == len(names) and all(want in ("*", name) for want, name in zip(wanted, names, strict=True))
