"""Robot sheets: the values of a robot, and for each of them where it comes from."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from enum import StrEnum
from math import hypot

from twbal.core.errors import ConfigError
from twbal.core.robot_parameters import RobotParameters, check_inertias


class ValueProvenance(StrEnum):
    """Where a value comes from."""

    MEASURED = "measured"
    DATA_SHEET = "data_sheet"
    CAD = "cad"
    COMPUTED = "computed"
    GUESS = "guess"


VALUES = tuple(field.name for field in fields(RobotParameters) if field.name not in ("name", "tolerance_factors"))
"""Names of a sheet's values."""

_SIZE = ("body_mass", "com_height", "wheel_radius", "track")
_INERTIAS = ("body_inertia_roll", "body_inertia_pitch", "body_inertia_yaw")

MEANING = {
    ValueProvenance.MEASURED: "weighed, timed or otherwise measured on such a robot",
    ValueProvenance.DATA_SHEET: "published by its maker, or set in its firmware",
    ValueProvenance.CAD: "taken from drawings and masses of its parts",
    ValueProvenance.COMPUTED: "computed from other values and a stated approximation, such as a box",
    ValueProvenance.GUESS: "chosen, as nothing is published",
}
"""What each provenance means."""

TOLERANCE_FACTORS = {
    ValueProvenance.MEASURED: 0.5,
    ValueProvenance.DATA_SHEET: 1.0,
    ValueProvenance.CAD: 1.0,
    ValueProvenance.COMPUTED: 2.0,
    ValueProvenance.GUESS: 5.0,
}
"""Tolerance of a value in that of a published one, which is a setting of a diagnosis."""


def robot_sheet(
    *, name: str = "", provenance: Mapping[str, Sequence[str]] | None = None, **values: float
) -> RobotParameters:
    """A robot from its sheet.

    Args:
        name: of the robot; needed.
        provenance: names of values by where they come from (`ValueProvenance`); each value once.
        values: those of `RobotParameters`, in SI units.

    Raises:
        ConfigError: an entry that is missing or that no sheet has, a value that no robot can have, or one of no or of
            two provenances.
    """
    if not name:
        raise ConfigError("A robot sheet has no name. Add `name: <name of its file>`.")
    absent, odd = [value for value in VALUES if value not in values], sorted(set(values) - set(VALUES))
    if absent or odd:
        wrong = [f"lacks {', '.join(absent)}"] * bool(absent) + [f"has {', '.join(odd)}, unknown here"] * bool(odd)
        raise ConfigError(
            f"The sheet of robot {name!r} {' and '.join(wrong)}. A sheet has name, provenance, {', '.join(VALUES)}."
        )
    provenance = provenance or {}
    factors = {value: TOLERANCE_FACTORS[kind] for value, kind in provenance_of(name, provenance).items()}
    robot = RobotParameters(name=name, **values, tolerance_factors=factors)
    check_body(name, values)
    return robot


def provenance_of(name: str, provenance: Mapping[str, Sequence[str]]) -> dict[str, ValueProvenance]:
    """Provenance by value.

    Args:
        name: of the robot.
        provenance: names of values by where they come from.

    Raises:
        ConfigError: a provenance or a value that there is not, or a value of no or of two provenances.
    """
    found: dict[str, ValueProvenance] = {}
    for kind, names in provenance.items():
        if kind not in list(ValueProvenance):
            raise ConfigError(
                f"Robot {name!r} has values of provenance {kind!r}; expected one of: {', '.join(ValueProvenance)}."
            )
        for value in names:
            if value not in VALUES or value in found:
                also = f"{found[value]} too" if value in found else "no value of a robot"
                raise ConfigError(f"Robot {name!r} lists {value!r} under provenance {kind}, and it is {also}.")
            found[value] = ValueProvenance(kind)
    missing = [value for value in VALUES if value not in found]
    if missing:
        raise ConfigError(
            f"Robot {name!r} does not say where these values come from: {', '.join(missing)}. List each under one of "
            f"provenance.{{{', '.join(ValueProvenance)}}}."
        )
    return found


def provenance_by_factor(factors: Mapping[str, float]) -> dict[ValueProvenance, list[str]]:
    """Names of values by a provenance that gives their tolerance factors; values without one are published.

    Raises:
        ConfigError: no provenance gives such a factor.
    """
    kinds = {factor: kind for kind, factor in reversed(TOLERANCE_FACTORS.items())}
    for value, factor in factors.items():
        if factor not in kinds:
            known = ", ".join(f"{kind:g}" for kind in sorted(kinds))
            raise ConfigError(f"The tolerance factor of {value} must be one of {known}; found {factor!r:.80}.")
    found: dict[ValueProvenance, list[str]] = {}
    for value in VALUES:
        found.setdefault(kinds[factors.get(value, TOLERANCE_FACTORS[ValueProvenance.DATA_SHEET])], []).append(value)
    return found


def check_body(name: str, values: Mapping[str, float]) -> None:
    """Hold the inertias among some values of a sheet against each other and against the body's size.

    A body reaches down to the ground at most, h + r under its centre of mass. With masses at a above it and at b below
    its squared radius of gyration is a b; up to a = 4 b is allowed, so 2 (h + r) for pitch. Across, one track is.

    Args:
        name: of the robot.
        values: of the sheet; what is not among them is not looked at.

    Raises:
        ConfigError: a body of this height and width cannot have these inertias, or no body can.
    """
    if all(value in values for value in _SIZE):
        for axis in ("pitch", "roll", "yaw"):
            _check_size(name, axis, values)
    if all(value in values for value in _INERTIAS):
        check_inertias(name, *(values[value] for value in _INERTIAS))


def _check_size(name: str, axis: str, values: Mapping[str, float]) -> None:
    mass, com_height, radius, track = (values[value] for value in _SIZE)
    height = 2.0 * (com_height + radius)
    limit = height if axis == "pitch" else hypot(height, track)
    inertia = values.get(f"body_inertia_{axis}", 0.0)
    if inertia > mass * limit**2:
        raise ConfigError(
            f"body_inertia_{axis} of robot {name!r} is {inertia:.6g} kg·m²; expected at most {mass * limit**2:.3g} "
            f"kg·m², as a body of {mass:g} kg has whose com_height is {com_height:g} m, on wheels of {radius:g} m with "
            f"a track of {track:g} m. Was it given in other units?"
        )
