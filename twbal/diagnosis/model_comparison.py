"""The models that a selection leaves as rivals: the likeliest sets of effects, with their fits."""

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from twbal.diagnosis.candidates import Candidate
from twbal.diagnosis.hypothesis import FittedHypothesis
from twbal.diagnosis.problem import Problem, Selection
from twbal.diagnosis.record import LISTED, ProbableEffect, Rival, Verdict
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
        temperature: of their probabilities, by which log likelihood ratios are divided.
        allowed: standard deviations by which values may differ between recordings of one robot, by field.
    """

    data: Data
    chosen: FittedHypothesis
    rivals: tuple[RivalModel, ...]
    candidates: Sequence[Candidate]
    temperature: float
    allowed: Mapping[Field, float]

    @property
    def probabilities(self) -> list[float]:
        """Of each rival."""
        return [rival.probability for rival in self.rivals]


def compare_models(
    problem: Problem,
    selection: Selection,
    weights: Mapping[tuple[str, ...], float],
    temperature: float,
    allowed: Mapping[Field, float],
) -> ModelComparison:
    """The likeliest sets of a selection: those that are listed, and two at least where so many were fitted.

    Of sets that no data tell apart, the likeliest stands for all.
    """
    first: dict[tuple[str, ...], FittedHypothesis] = {}
    for w in sorted(selection.sets, key=lambda w: -weights[w.names]):
        first.setdefault(_told_apart(w.names), w)
    together = _together((names, weights[names]) for names in weights)
    ordered = sorted(first, key=lambda names: -together[names])
    kept = [names for i, names in enumerate(ordered[:MOST]) if i < 2 or together[names] >= LISTED]
    total = sum(together[names] for names in kept)
    rivals = tuple(RivalModel(first[n].names, first[n].fit, together[n] / total) for n in kept)
    return ModelComparison(problem.data, selection.chosen, rivals, problem.candidates, temperature, allowed)


def is_open(verdict: Verdict, effects: Sequence[ProbableEffect], rivals: Sequence[Rival]) -> bool:
    """Whether other data could tell more.

    Nothing was named; or no set of effects, with those that no data tell from it, is as likely as `SURE`; or something
    was named that other effects do as well, but not exactly the same to all that the robot measures.
    """
    known = library()
    unsure = max(_together((rival.names, rival.probability) for rival in rivals).values(), default=1.0) < SURE
    return (
        verdict.is_open
        or unsure
        or any(set(effect.equivalents) - set(known[effect.name].same_as) for effect in effects if effect.is_named)
    )


def _told_apart(names: Iterable[str]) -> tuple[str, ...]:
    """A set of effects, with the first of those that do exactly the same in the place of each."""
    known = library()
    return tuple(sorted(min(name, *known[name].same_as) if known[name].same_as else name for name in names))


def _together(sets: Iterable[tuple[tuple[str, ...], float]]) -> dict[tuple[str, ...], float]:
    """Probabilities of sets of effects, added up over those that no data tell apart."""
    found: dict[tuple[str, ...], float] = {}
    for names, probability in sets:
        found[_told_apart(names)] = found.get(_told_apart(names), 0.0) + probability
    return found
