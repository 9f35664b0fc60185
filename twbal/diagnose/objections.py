"""What speaks against the set of effects that a selection ended with: each reason a sentence, with its numbers."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from twbal.diagnose.candidates import DATA_SHEET, WHEELS, Candidate
from twbal.diagnose.recording import Recording
from twbal.diagnose.settings import Settings
from twbal.diagnose.steady import Unsteady
from twbal.diagnose.verdict import shifts_of
from twbal.diagnose.weigh import Weighed

_WHERE = {"speed": "the wheels turn fast", "time": "time has gone by", "command": "the command is large"}
_INSTANTS = 2000  # for which the limit of the autocorrelation is set; that of coloured errors grows with their number
_ROUGH = 0.15  # tolerance of a data sheet by diagnosis=rough
_AT_BOUND = 0.01  # share of its range from a bound at which a value of the data sheet has run to it
_CLIPPED = 0.5  # share of the commands that a limit on the torque may cut off: beyond that it replaces them


def objections(
    chosen: Weighed, unsteady: Sequence[Unsteady], recordings: Sequence[Recording], settings: Settings
) -> tuple[str, ...]:
    """Why a set of effects is no finding; nothing where nothing speaks against it.

    Args:
        chosen: the set; without effects, the data sheet refitted.
        unsteady: effects of the set that are not of one size.
        recordings: that it was fitted to.
        settings: of the diagnosis.
    """
    line = settings.lines.whiteness
    limit = 1.0 + (line - 1.0) * max(len(chosen.fit.white) / 4 / _INSTANTS, 1.0)
    found = []
    if chosen.colour > limit:
        found.append(
            f"The residuals stay autocorrelated: {chosen.colour:.3g}, where noise has 1; the limit is {limit:.3g}."
        )
    clipping, bounded = _clipping(chosen, recordings), _at_bound(chosen)
    for name in chosen.stuck:
        if name.partition(".")[0] not in {*clipping, *bounded}:
            found.append(f"The best guess ran to a bound of its range ({name}), so it is none.")
    found += _to_sizes(chosen, settings)
    found += clipping.values()
    found += _to_the_data_sheet(chosen, bounded, settings)
    for effect, axis, share, _ in unsteady:
        found.append(
            f"The best guess, {spaced(effect)}, would have to be {abs(share):.0%} "
            f"{'larger' if share > 0 else 'smaller'} where {_WHERE[axis]}: what moves the robot has another form."
        )
    return tuple(found)


def negligible(weighed: Weighed, settings: Settings) -> tuple[Candidate, ...]:
    """Effects of a set that are too small to be named, however sure the data are of them."""
    sizes = [(candidate, weighed._replace(candidates=(candidate,)).size) for candidate in weighed.effects]
    return tuple(candidate for candidate, size in sizes if size < settings.lines.least)


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


def _clipping(chosen: Weighed, recordings: Sequence[Recording]) -> dict[str, str]:
    """Objections, by effect, to limits on the torque that most commands exceed: nothing would be left to command."""
    found = {}
    commands = np.abs(np.concatenate([recording.commands for recording in recordings]))
    for candidate in chosen.effects:
        limit = candidate.parameters[0]
        if limit.unit == "N·m" and limit.none == limit.high:
            share = float(np.mean(commands > chosen.fit.model.value(f"{candidate.name}_{limit.name}")))
            if share > _CLIPPED:
                found[candidate.name] = (
                    f"The best guess, {with_values(chosen, [candidate])}, would cut off {share:.0%} of the commands: "
                    "that replaces them and explains nothing."
                )
    return found


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
    if found and settings.tolerances.data_sheet < _ROUGH:
        found.append(f"If the data sheet may be as wrong as that (by {_ROUGH:.0%} or so), say diagnosis=rough.")
    return found


def _at_bound(weighed: Weighed) -> dict[str, tuple[float, str]]:
    """Factors of the data sheet's values that ran to a bound although a prior holds them, and which bound."""
    found = {}
    for free in weighed.fit.frees:
        if free.field in (*DATA_SHEET, *WHEELS) and np.isfinite(free.sd):
            value, margin = weighed.fit.model.value(free.field), _AT_BOUND * (free.high - free.low)
            name = free.field if free.field in WHEELS else free.field.rpartition("_")[0]
            if value - free.low < margin:
                found[name] = (value / free.mean, "lower")
            elif free.high - value < margin:
                found[name] = (value / free.mean, "upper")
    return found
