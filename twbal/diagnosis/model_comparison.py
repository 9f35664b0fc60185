"""The models that a selection leaves as rivals: the likeliest sets of effects, with their fits."""

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from twbal.diagnosis.candidates import Candidate
from twbal.diagnosis.hypothesis import FittedHypothesis
from twbal.diagnosis.problem import Problem, Selection
from twbal.diagnosis.record import LISTED, ProbableEffect, Rival, Verdict
from twbal.diagnosis.verdict import Tempering
from twbal.effects.library import library
from twbal.sysid.model import Data, Field
from twbal.sysid.prediction_error_fit import Fit

MOST = 4
"""Rival models, at most."""

SURE = 0.8
"""Probability of the likeliest set of effects below which other data are worth recording."""


class RivalModel(NamedTuple):
    """A set of effects that the data leave possible, fitted; `Rival` is how a diagnosis records each set.

    Attributes:
        names: of its effects; () is the data sheet refitted.
        fit: to the data.
        probability: among the rivals.
    """

    names: tuple[str, ...]
    fit: Fit
    probability: float


class ModelComparison(NamedTuple):
    """What the data leave open: rival models, and how probable each is.

    Attributes:
        data: that all were fitted to.
        chosen: the set that the selection ended with.
        rivals: the likeliest sets, at most `MOST`, the likeliest first.
        candidates: effects that might be missing.
        tempering: of their probabilities.
        allowed: standard deviations by which values may differ between recordings of one robot, by field.
        base: the data sheet refitted.
    """

    data: Data
    chosen: FittedHypothesis
    rivals: tuple[RivalModel, ...]
    candidates: Sequence[Candidate]
    tempering: Tempering
    allowed: Mapping[Field, float]
    base: Fit

    @property
    def probabilities(self) -> list[float]:
        """Of each rival."""
        return [rival.probability for rival in self.rivals]


def compare_models(
    problem: Problem,
    selection: Selection,
    rivals: Sequence[Rival],
    tempering: Tempering,
    allowed: Mapping[Field, float],
) -> ModelComparison:
    """The likeliest sets of a selection: those that are listed, and two at least where so many were fitted.

    Of sets that no data tell apart, or that differ by negligible effects alone, the likeliest stands for all.
    """
    fitted, first = {w.names: w for w in selection.sets}, dict[tuple[str, ...], FittedHypothesis]()
    for rival in sorted(rivals, key=lambda rival: -rival.probability):
        first.setdefault(_told_apart(rival.essential), fitted[rival.names])
    together = _together(rivals)
    ordered = sorted(first, key=lambda names: -together[names])
    kept = [names for i, names in enumerate(ordered[:MOST]) if i < 2 or together[names] >= LISTED]
    total = sum(together[names] for names in kept)
    models = tuple(RivalModel(first[n].names, first[n].fit, together[n] / total) for n in kept)
    data, base = problem.data, selection.base.fit
    return ModelComparison(data, selection.chosen, models, problem.candidates, tempering, allowed, base)


def is_open(verdict: Verdict, effects: Sequence[ProbableEffect], rivals: Sequence[Rival]) -> bool:
    """Whether other data could tell more.

    Nothing was named; or no set of effects, with those that no data tell from it or that differ by negligible effects
    alone, is as likely as `SURE`; or something was named that other effects do as well, but not exactly the same to all
    that the robot measures.
    """
    known = library()
    unsure = max(_together(rivals).values(), default=1.0) < SURE
    return (
        verdict.is_open
        or unsure
        or any(set(effect.equivalents) - set(known[effect.name].same_as) for effect in effects if effect.is_named)
    )


def _told_apart(names: Iterable[str]) -> tuple[str, ...]:
    """A set of effects, with the first of those that do exactly the same in the place of each."""
    known = library()
    return tuple(sorted(min(name, *known[name].same_as) if known[name].same_as else name for name in names))


def _together(rivals: Iterable[Rival]) -> dict[tuple[str, ...], float]:
    """Probabilities of sets of effects, added up over those that no data tell apart and those that say the same."""
    found: dict[tuple[str, ...], float] = {}
    for rival in rivals:
        names = _told_apart(rival.essential)
        found[names] = found.get(names, 0.0) + rival.probability
    return found
