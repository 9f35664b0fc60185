"""How likely each effect is missing: graded answers of a selection, whatever its verdict.

The probability of an effect is the weight of all sets that hold it, or an effect that no data tell from it. These data
may not tell it from other effects either, in their place beside the rest of the best set; sets with one of those count
where they hold the rest of the best set, too. (A dead zone may do as well as a delay beside a friction. Without the
friction, it may do the friction's work, and then tells nothing of a delay.)
The weights compare sets with each other; they do not know whether the library holds what moves the robot. What knows
more of that are the objections to the best set. So a probability is corrected by how often such probabilities proved
right on data with a known truth, with and without such objections (`calibration`).

Long data are sure of the smallest deviations, which stand for some trifle of the robot's form. So a probability is that
of an effect that is larger than a trifle.
"""

from collections.abc import Mapping, Sequence
from statistics import NormalDist

import numpy as np

from twbal.diagnosis.calibration import Objected, calibration
from twbal.diagnosis.candidates import Candidate
from twbal.diagnosis.hypothesis import FittedHypothesis
from twbal.diagnosis.objections import BOUNDLESS, Extent, Objection, negligible, spaced, to_bounds, to_slow_waves
from twbal.diagnosis.problem import Selection
from twbal.diagnosis.record import LIKELY, LISTED, Estimate, ProbableEffect, Verdict
from twbal.diagnosis.removal import substitutes
from twbal.diagnosis.settings import Settings
from twbal.sysid.intervals import NORMAL95, interval, standard_errors
from twbal.sysid.model import Data
from twbal.sysid.prediction_error_fit import slopes_of

_TRIFLE = 0.5
"""Share of `thresholds.min_effect_size`. Smaller effects are seldom true on other robots."""
_SURELY = 0.05  # probability that an effect is larger than a trifle, below which it is surely none
_LEAST = 0.005  # probability of a set, below which it is not asked

Weights = Mapping[tuple[str, ...], float]
"""Probability of each set of effects that was fitted, by its names, as sets compare with each other."""


def probable_effects(
    data: Data,
    selection: Selection,
    objected: Sequence[Objection],
    verdict: Verdict,
    weights: Weights,
    settings: Settings,
    extent: Extent = BOUNDLESS,
) -> tuple[ProbableEffect, ...]:
    """All effects that are missing with a probability of at least `LISTED`, the likeliest first.

    Each has its size in the best set that holds it. An equivalent of an effect that is listed is not listed
    itself, unless it is mostly held by sets in which it does something else.

    Args:
        data: recordings.
        selection: how it went.
        objected: what speaks against the set that was chosen.
        verdict: that it came to.
        weights: of the sets (`verdict.probabilities`).
        settings: of the diagnosis.
        extent: how far the recordings go; what is too slow a wave for them is so in sets that were not chosen, too.
    """
    chosen, margin = selection.chosen, settings.thresholds.equivalence_margin
    trifles = {candidate.name for candidate in negligible(chosen, settings)}
    found = list[ProbableEffect]()
    known = set[str]()
    others = (w for w in selection.sets if w.names != chosen.names)
    for holder in (chosen, *sorted(others, key=lambda w: -weights[w.names])):
        new = [candidate for candidate in holder.effects if candidate.name not in known]
        if not new:
            continue
        sizes = estimates(data, holder, new, settings)
        own = objected if holder is chosen else [*to_slow_waves(holder, extent), *_to_own_bounds(holder)]
        for candidate in new:
            what = objected_to(candidate.name, [*objected, *own])
            near = substitutes(candidate, chosen, selection.rounds, margin) if holder is chosen else []
            alike = tuple(dict.fromkeys([*candidate.same_as, *near]))
            known |= {candidate.name, *(name for name in alike if not _is_of_its_own(name, candidate, chosen, weights))}
            against = tuple(o.text for o in own if o.concerns(candidate.name))
            weight = probability_of(candidate, weights, near, chosen.names)
            weight *= chance_of_size(candidate, sizes[candidate.name], _TRIFLE * settings.thresholds.min_effect_size)
            found.append(
                ProbableEffect(
                    name=candidate.name,
                    probability=calibration().corrected(weight, what),
                    is_named=verdict is Verdict.NAMED
                    and holder is chosen
                    and candidate.name not in trifles
                    and what is not Objected.EFFECT,
                    parameters=sizes[candidate.name],
                    equivalents=alike,
                    separate_by=candidate.separate_by,
                    objections=against,
                    uncalibrated=weight,
                    objected=what,
                )
            )
    listed = [effect for effect in found if effect.is_named or effect.probability >= LISTED]
    return tuple(sorted(listed, key=lambda effect: -effect.probability))


def outweighed(selection: Selection, weights: Weights, settings: Settings) -> list[Objection]:
    """To effects of the chosen set that are less likely missing than not, as other sets do without them.

    Not to those that are too small to be named.
    """
    chosen, margin, found = selection.chosen, settings.thresholds.equivalence_margin, []
    for candidate in chosen.effects:
        near = substitutes(candidate, chosen, selection.rounds, margin)
        without = {n: w for n, w in weights.items() if not counts_for(candidate, n, near, chosen.names)}
        total = sum(without.values())
        if total > 1.0 - LIKELY and chosen.size_of(candidate) >= settings.thresholds.min_effect_size:
            best = max(without, key=lambda names: without[names])
            what = ", ".join(map(spaced, best)) or "the data sheet refitted"
            text = f"Sets of effects without the {spaced(candidate.name)} are together likelier ({total:.0%}); the "
            text += f"likeliest of them is {what} ({without[best]:.0%})."
            found.append(Objection(text, (candidate.name,), is_of_weights=True))
    return found


def probability_of(candidate: Candidate, weights: Weights, near: Sequence[str] = (), best: Sequence[str] = ()) -> float:
    """Of an effect, or one that does exactly the same, or one that these data cannot tell from it.

    Args:
        candidate: the effect.
        weights: of the sets.
        near: effects that do as well in its place beside the rest of the best set.
        best: names of the best set.
    """
    return min(sum(weight for names, weight in weights.items() if counts_for(candidate, names, near, best)), 1.0)


def counts_for(candidate: Candidate, names: Sequence[str], near: Sequence[str] = (), best: Sequence[str] = ()) -> bool:
    """Whether a set of these names counts for the probability of an effect; arguments as of `probability_of`."""
    held, rest = set(names), set(best) - {candidate.name}
    return bool(held & {candidate.name, *candidate.same_as}) or (rest <= held and bool(held & set(near)))


def _to_own_bounds(holder: FittedHypothesis) -> list[Objection]:
    """To effects of a set whose own parameters ran to a bound."""
    return [objection for objection in to_bounds(holder) if objection.effects]


def _is_of_its_own(name: str, candidate: Candidate, chosen: FittedHypothesis, weights: Weights) -> bool:
    """Whether an equivalent of an effect is mostly held by sets in which it does not take that effect's place."""
    if name in candidate.same_as:
        return False
    rest = set(chosen.names) - {candidate.name}
    holding = {names: weight for names, weight in weights.items() if name in names}
    places = [weight for names, weight in holding.items() if rest <= set(names) and candidate.name not in names]
    return sum(holding.values()) > 2.0 * sum(places)


def chance_of_size(candidate: Candidate, found: Mapping[str, Estimate], least: float) -> float:
    """Probability that an effect is larger than a share of its usual size, by its estimate and 95 % interval.

    Args:
        candidate: the effect.
        found: its parameters.
        least: share of its start values, of those parameters that say how large it is (`Candidate.sizes`).
    """
    chances = []
    for p in candidate.sizes:
        size, limit = found[p.name].value - p.none, least * abs(p.start - p.none)
        error = 0.5 * (found[p.name].high95 - found[p.name].low95) / NORMAL95
        sizes = NormalDist(size, max(error, 1e-9 * abs(p.start - p.none)))
        chances.append(sizes.cdf(-limit) + 1.0 - sizes.cdf(limit))
    return max(chances)


def surely_negligible(
    data: Data, selection: Selection, weights: Weights, settings: Settings
) -> Mapping[tuple[str, ...], tuple[str, ...]]:
    """Names of the effects that are surely too small to matter, by the names of each set that has some.

    Of two sets, of which one holds an effect more, the larger one is never ruled out by data: its further effect
    becomes small, and the price of a parameter is all that speaks against it. So the question which of both is true
    stays open for ever, and means nothing once that effect is surely smaller than a trifle.

    Args:
        data: recordings that the sets were fitted to.
        selection: the sets.
        weights: probabilities of the sets; those of hardly any are not asked.
        settings: of the diagnosis.
    """
    least = _TRIFLE * settings.thresholds.min_effect_size
    found: dict[tuple[str, ...], tuple[str, ...]] = {}
    for w in selection.sets:
        if weights[w.names] < _LEAST or not w.effects:
            continue
        sizes = estimates(data, w, w.effects, settings)
        small = [c.name for c in w.effects if chance_of_size(c, sizes[c.name], least) < _SURELY]
        if small:
            found[w.names] = tuple(sorted(small))
    return found


def objected_to(effect: str, objected: Sequence[Objection]) -> Objected:
    """What is objected to, as far as an effect is concerned."""
    objected = [objection for objection in objected if not objection.is_of_weights]
    if any(effect in objection.effects for objection in objected):
        return Objected.EFFECT
    return Objected.NOTHING if all(objection.is_of_own for objection in objected) else Objected.OTHERS


def estimates(
    data: Data, hypothesis: FittedHypothesis, candidates: Sequence[Candidate], settings: Settings
) -> dict[str, dict[str, Estimate]]:
    """Parameters of effects of a fitted set with their 95 % intervals, by effect and parameter."""
    slopes = slopes_of(data, hypothesis.fit)
    errors = standard_errors(hypothesis.fit, slopes, settings.blocks, hypothesis.temperature, data.slope_excess)
    by_field = dict(zip([free.field for free in hypothesis.fit.free_parameters], errors.tolist(), strict=True))
    found: dict[str, dict[str, Estimate]] = {}
    for candidate in candidates:
        found[candidate.name] = {}
        for p in candidate.parameters:
            field = candidate.field(p)
            value = hypothesis.fit.model.value(field)
            is_sized = p in candidate.sizes or np.isfinite(p.sd)
            timing = settings.tolerances.imu_timing if p.unit == "s" else 0.0
            form = max(settings.thresholds.form_error, p.form) * (p.size(value) if is_sized else value)
            error = float(np.sqrt(by_field[field] ** 2 + form**2 + timing**2))
            found[candidate.name][p.name] = Estimate(value, *interval(value, error), p.unit)
    return found
