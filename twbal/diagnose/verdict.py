"""What to make of a selection: the verdict, its probability, and what to do next."""

from collections.abc import Mapping, Sequence

import numpy as np

from twbal.diagnose.candidates import DATA_SHEET
from twbal.diagnose.select import Selection, worth
from twbal.diagnose.settings import Settings
from twbal.diagnose.steady import Unsteady
from twbal.diagnose.weigh import Weighed
from twbal.diagnosis import Shift, Verdict

_WHERE = {"speed": "the wheels turn fast", "time": "time has gone by", "command": "the command is large"}
EXCITE = "twbal real-rollout experiment=excite link=serial link.port=..."
_ROUGH = 0.15  # tolerance of a data sheet by diagnosis=rough
_INSTANTS = 2000  # for which the line of whiteness is drawn; that of coloured errors grows with the length of the data
_BLIND = 0.5  # share of the candidates that poor data could not have shown, from which on nothing is decided


def conclude(selection: Selection, unsteady: Sequence[Unsteady], strain: float, settings: Settings) -> Verdict:
    """The verdict of a selection, of whose effects some may not be of one size, and whose data sheet is strained."""
    chosen, lines = selection.chosen, settings.lines
    instants = len(chosen.fit.white) / 4
    if chosen.colour > 1.0 + (lines.whiteness - 1.0) * max(instants / _INSTANTS, 1.0) or chosen.stuck or unsteady:
        return Verdict.UNKNOWN
    if _absurd(chosen, settings):
        return Verdict.UNKNOWN
    if chosen.effects:
        return Verdict.NAMED
    if chosen.candidates or strained(chosen, strain, settings):
        return Verdict.DATA_SHEET
    if len(blind(selection, settings)) > _BLIND * len(selection.rounds[0].screened):
        return Verdict.UNDECIDED
    return Verdict.NONE


def shifts_of(weighed: Weighed, settings: Settings) -> tuple[Shift, ...]:
    """How far the data pull the values of the data sheet, the largest first."""
    found, tolerance = [], settings.tolerances.data_sheet
    for free in weighed.fit.frees:
        if free.field in DATA_SHEET:
            factor = weighed.fit.model.value(free.field) / free.mean
            name = free.field.rpartition("_")[0]
            found.append(Shift(name, DATA_SHEET[free.field], factor, (factor - 1.0) / tolerance))
    return tuple(sorted(found, key=lambda shift: -abs(shift.sigmas)))


def data_sheet_classes(weighed: Weighed, strain: float, settings: Settings) -> tuple[str, ...]:
    """Classes of data-sheet values that are off, the worst first."""
    shifts = shifts_of(weighed, settings)
    chosen = [shift for shift in shifts if shift.name in weighed.names]
    far = [shift for shift in shifts if abs(shift.sigmas) > settings.lines.shift]
    worst = shifts[:1] * strained(weighed, strain, settings)
    return tuple(dict.fromkeys(shift.group for shift in chosen or far or worst))


def _absurd(weighed: Weighed, settings: Settings) -> list[Shift]:
    """Values of the data sheet that the fit has dragged far away without their being named."""
    shifts = shifts_of(weighed, settings)
    return [shift for shift in shifts if abs(shift.sigmas) > settings.lines.beyond and shift.name not in weighed.names]


def strained(weighed: Weighed, strain: float, settings: Settings) -> bool:
    """Whether no values of the data sheet within their tolerances explain the data; of coloured errors, less so."""
    return strain / weighed.colour > settings.lines.strain


def blind(selection: Selection, settings: Settings) -> list[str]:
    """Effects that could be there at their usual size without these data showing it."""
    return [s.candidate.name for s in selection.rounds[0].screened if s.seen < settings.lines.score]


def probabilities(selection: Selection, settings: Settings) -> Mapping[tuple[str, ...], float]:
    """Of each set that was weighed, by its names: a softmax of half the scores, cooled as calibration asks."""
    sets = selection.sets
    scores = -np.array([w.total for w in sets]) / (2.0 * settings.temperature * selection.chosen.colour)
    weights = np.exp(scores - scores.max())
    weights /= weights.sum()
    return {w.names: p for w, p in zip(sets, weights.tolist(), strict=True)}


def advise(
    selection: Selection, unsteady: Sequence[Unsteady], strain: float, verdict: Verdict, settings: Settings
) -> tuple[str, ...]:
    """Plain sentences: what the data do not carry, and what to do next."""
    found = []
    unseen = blind(selection, settings)
    if verdict is Verdict.UNDECIDED:
        found.append(f"The recordings are too poor to decide. Record some that tell effects apart: {EXCITE}")
    if verdict in (Verdict.UNDECIDED, Verdict.NONE) and unseen:
        found.append(f"These effects could be there without these recordings showing it: {', '.join(unseen)}.")
    if verdict is Verdict.UNKNOWN:
        found.append(
            "Something moves this robot that no effect of the library explains; the map of the disagreement says where."
        )
        for name in selection.chosen.stuck:
            found.append(f"The best guess ran to a bound of its range ({name}), so it is none.")
        for shift in _absurd(selection.chosen, settings):
            found.append(
                f"The best guess needs a {shift.name.replace('_', ' ')} of {shift.factor:.2g} times the data sheet's, "
                f"{abs(shift.sigmas):.0f} tolerances off: that is no finding."
            )
        if _absurd(selection.chosen, settings) and settings.tolerances.data_sheet < _ROUGH:
            found.append(f"If the data sheet may be as wrong as that (by {_ROUGH:.0%} or so), say diagnosis=rough.")
        for effect, axis, share, _ in unsteady:
            found.append(
                f"The best guess, {effect.replace('_', ' ')}, would have to be {abs(share):.0%} "
                f"{'larger' if share > 0 else 'smaller'} where {_WHERE[axis]}: what moves the robot has another form."
            )
    if verdict is Verdict.NAMED and data_sheet_classes(selection.chosen, strain, settings):
        found.append("Values of the data sheet are off as well, beyond their tolerances.")
    rest = [w for step in selection.rounds[-1:] for w in step.weighed if worth(w, selection.chosen, settings)]
    if rest and verdict is Verdict.NAMED:
        found.append("The data ask for one more effect than is named; diagnose again with augmented.yaml as sim=.")
    return tuple(found)
