"""What speaks against the set of effects that a selection ended with: each reason a sentence, with its numbers."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from twbal.diagnosis.candidates import DATA_SHEET, WHEELS, Candidate
from twbal.diagnosis.settings import Settings
from twbal.diagnosis.steady import Unsteady
from twbal.diagnosis.verdict import shifts_of
from twbal.diagnosis.weigh import Weighed, at_bound

_WHERE = {"speed": "the wheels turn fast", "time": "time has gone by", "command": "the command is large"}
_INSTANTS = 2000  # for which the limit of the autocorrelation is set; that of coloured errors grows with their number


def objections(chosen: Weighed, unsteady: Sequence[Unsteady], settings: Settings) -> tuple[str, ...]:
    """Why a set of effects is no finding; nothing where nothing speaks against it.

    Args:
        chosen: the set; without effects, the data sheet refitted.
        unsteady: effects of the set that are not of one size.
        settings: of the diagnosis.
    """
    line = settings.lines.whiteness
    limit = 1.0 + (line - 1.0) * max(len(chosen.fit.white) / 4 / _INSTANTS, 1.0)
    found = []
    if chosen.colour > limit:
        found.append(
            f"The residuals stay autocorrelated: {chosen.colour:.3g}, where noise has 1; the limit is {limit:.3g}."
        )
    swallowing, bounded = _swallowing(chosen), _at_bound(chosen)
    for name in chosen.stuck:
        if name.partition(".")[0] not in {*swallowing, *bounded}:
            found.append(f"The best guess ran to a bound of its range ({name}), so it is none.")
    found += _to_sizes(chosen, settings)
    found += swallowing.values()
    found += _to_the_data_sheet(chosen, bounded, settings)
    for effect, axis, share, _ in unsteady:
        found.append(
            f"The best guess, {spaced(effect)}, would have to be {abs(share):.0%} "
            f"{'larger' if share > 0 else 'smaller'} where {_WHERE[axis]}: what moves the robot has another form."
        )
    return tuple(found)


def negligible(weighed: Weighed, settings: Settings) -> tuple[Candidate, ...]:
    """Effects of a set that are too small to be named, however sure the data are of them."""
    return tuple(candidate for candidate in weighed.effects if weighed.size_of(candidate) < settings.lines.least)


def with_values(weighed: Weighed, candidates: Iterable[Candidate]) -> str:
    """Effects with the values of their first parameters: `torque saturation of 0.0335 N·m`."""
    found = []
    for candidate in candidates:
        size = candidate.parameters[0]
        value = weighed.fit.model.value(f"{candidate.name}_{size.name}")
        found.append(f"{spaced(candidate.name)} of {value:.3g} {size.unit}".rstrip())
    return ", ".join(found)


def spaced(name: str) -> str:
    """A name as it stands in a sentence."""
    return name.replace("_", " ")


def _to_sizes(chosen: Weighed, settings: Settings) -> list[str]:
    """To a set that holds nothing but trifles."""
    trifles = negligible(chosen, settings)
    if not trifles or len(trifles) < len(chosen.effects):
        return []
    least = f"less than {settings.lines.least:.0%} of its usual size"
    return [f"All that the data ask for is {with_values(chosen, trifles)}: negligible, {least}."]


def _swallowing(chosen: Weighed) -> dict[str, str]:
    """Objections, by effect, to effects that let next to nothing of the commands' variation pass."""
    return {
        candidate.name: f"The best guess, {with_values(chosen, [candidate])}, lets next to nothing of the commands "
        "pass: it replaces them and explains nothing."
        for candidate in chosen.effects
        if candidate.name in chosen.overriding
    }


def _to_the_data_sheet(chosen: Weighed, bounded: Mapping[str, tuple[float, str]], settings: Settings) -> list[str]:
    """To values of the data sheet that nothing names: at a bound of their range (`_at_bound`), or far off."""
    found = [
        f"The best guess needs a {spaced(name)} of {factor:.2g} times the data sheet's, the {side} bound of its range: "
        "that is no finding."
        for name, (factor, side) in bounded.items()
    ]
    for shift in shifts_of(chosen, settings):
        if abs(shift.sigmas) > settings.lines.beyond and shift.name not in {*chosen.names, *bounded}:
            found.append(
                f"The best guess needs a {spaced(shift.name)} of {shift.factor:.2g} times the data sheet's, "
                f"{abs(shift.sigmas):.0f} tolerances off: that is no finding."
            )
    rough = settings.tolerances.rough
    if found and settings.tolerances.data_sheet < rough:
        found.append(f"If the data sheet may be as wrong as that (by {rough:.0%} or so), say diagnosis=rough.")
    return found


def _at_bound(weighed: Weighed) -> dict[str, tuple[float, str]]:
    """Factors of the data sheet's values that ran to a bound although a prior holds them, and which bound."""
    found = {}
    for free in weighed.fit.frees:
        if free.field in (*DATA_SHEET, *WHEELS) and np.isfinite(free.sd):
            value = weighed.fit.model.value(free.field)
            if at_bound(free, value):
                name = free.field if free.field in WHEELS else free.field.rpartition("_")[0]
                found[name] = (value / free.mean, "lower" if value < free.mean else "upper")
    return found
