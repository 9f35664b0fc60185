"""The verdict: of a selection, and after rollouts on held-out data; and the probability of each set."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from twbal.diagnosis.data_sheet import DATA_SHEET
from twbal.diagnosis.hypothesis import FittedHypothesis
from twbal.diagnosis.objections import Objection, shifts_of
from twbal.diagnosis.power import unseen
from twbal.diagnosis.power_record import DetectionPower
from twbal.diagnosis.problem import Problem, Selection
from twbal.diagnosis.record import Gap, Shift, Verdict
from twbal.diagnosis.settings import Settings
from twbal.planar.robot_distribution import TILT_FILTER
from twbal.sysid.model import Field

_BLIND = 0.5  # share of the candidates that poor data could not have shown, from which on nothing is decided
_A_WORD = 1.0  # tolerances by which a value of a data sheet beyond its tolerances must be off to be listed


def conclude(
    selection: Selection,
    objected: Sequence[Objection],
    statistic: float,
    power: Sequence[DetectionPower],
    settings: Settings,
) -> Verdict:
    """The verdict of a selection.

    Args:
        selection: how it went.
        objected: what speaks against it (`objections`).
        statistic: how badly the data want the data sheet beyond its tolerances (`tolerance_statistic`).
        power: what the data would have shown of effects that it does not have.
        settings: of the diagnosis.
    """
    chosen = selection.chosen
    unsure = {name for objection in objected if objection.is_of_own for name in objection.effects}
    if any(not objection.is_of_own for objection in objected) or (unsure and unsure.issuperset(chosen.names)):
        return Verdict.UNKNOWN
    if chosen.effects:
        return Verdict.NAMED
    if chosen.candidates or exceeds_tolerances(chosen, statistic, settings):
        return Verdict.DATA_SHEET
    if len(unseen(power)) > _BLIND * len(power):
        return Verdict.UNDECIDED
    return Verdict.NONE


def review(verdict: Verdict, added: Sequence[str], gap: Gap | None) -> tuple[Verdict, str]:
    """The verdict after rollouts on held-out data, and a sentence where they contradict the fit ("" where not).

    Args:
        verdict: of the fit.
        added: names of what the fit adds to the data sheet refitted.
        gap: error of the rollouts; None where none could be made.
    """
    if gap is None:
        return verdict, ""
    error = f"{gap.channel.replace('_', ' ')} after {gap.horizon:g} s is off by {gap.after:.3g} rad"
    if gap.is_worse and (added or verdict is Verdict.DATA_SHEET):
        best = ", ".join(added).replace("_", " ") or "the data sheet refitted"
        return Verdict.UNKNOWN, (
            f"WARNING: what fits best ({best}) makes rollouts on held-out data worse: with it the {error}, with the "
            f"data sheet refitted alone by {gap.refitted:.3g}, as the data sheet says by {gap.before:.3g}. "
            "So it is no finding."
        )
    if verdict is Verdict.NONE and not gap.is_near_floor(gap.after):
        return Verdict.UNKNOWN, (
            f"No effect is worth naming, but rollouts on held-out data stay wrong: {error}, "
            f"{gap.after / gap.expected:.2g} times what {gap.expected_by} would make it."
        )
    return verdict, ""


def allowed_differences(problem: Problem, chosen: FittedHypothesis) -> Mapping[Field, float]:
    """Standard deviations by which each value may differ between recordings of one robot, by field.

    Of what is fitted, as the robot's form of an effect is not ours; of effects that the set does not have, the least
    size that is worth naming.
    """
    model, thresholds = chosen.fit.model, problem.settings.thresholds
    found: dict[Field, float] = {field: thresholds.form_error * abs(model.value(field)) for field in DATA_SHEET}
    for candidate in problem.candidates:
        for p in candidate.parameters:
            if candidate.name in chosen.names:
                found[candidate.field(p)] = thresholds.form_error * abs(p.size(model.value(candidate.field(p))))
            elif not candidate.in_data_sheet:
                found[candidate.field(p)] = thresholds.min_effect_size * abs(p.start - p.none)
    return found


def data_sheet_classes(hypothesis: FittedHypothesis, statistic: float, settings: Settings) -> tuple[str, ...]:
    """Classes of data-sheet values that are off, the worst first."""
    shifts = beyond_tolerance(hypothesis, statistic, settings)
    worst = shifts if _far(hypothesis, settings) else shifts[:1]
    return tuple(dict.fromkeys(shift.group for shift in worst))


def beyond_tolerance(hypothesis: FittedHypothesis, statistic: float, settings: Settings) -> tuple[Shift, ...]:
    """Values of the data sheet that are off: those named, or far off, or that share what the data sheet is off by."""
    far = _far(hypothesis, settings)
    if far or not exceeds_tolerances(hypothesis, statistic, settings):
        return far
    shifts = shifts_of(hypothesis, settings)
    return tuple(shift for shift in shifts if abs(shift.sigmas) > _A_WORD) or shifts[:1]


def _far(hypothesis: FittedHypothesis, settings: Settings) -> tuple[Shift, ...]:
    """Values of the data sheet that are named, or else those that are far off."""
    shifts = shifts_of(hypothesis, settings)
    named = tuple(shift for shift in shifts if shift.name in hypothesis.names)
    return named or tuple(shift for shift in shifts if abs(shift.sigmas) > settings.thresholds.min_reported_shift)


def exceeds_tolerances(hypothesis: FittedHypothesis, statistic: float, settings: Settings) -> bool:
    """Whether no values of the data sheet within their tolerances explain the data, for this autocorrelation."""
    return statistic / hypothesis.autocorrelation > settings.thresholds.max_tolerance_statistic


def probabilities(selection: Selection, settings: Settings) -> Mapping[tuple[str, ...], float]:
    """Of each set that was fitted, by its names.

    The prior odds of its effects, each of which is missing with the same probability, times the likelihood ratio by the
    Bayesian information criterion. That is tempered by the autocorrelation that the best set leaves, as autocorrelated
    errors gain by chance, and by a factor for all else that a robot's form differs in. Long data are sure of that
    difference, too; so the factor is no less than a share of what the best set gains beyond a filter of the tilt. A set
    that swallows the commands explains anything; it has no probability beside a chosen one that does not.
    """
    sets = selection.sets
    temperature = temperature_of(selection, settings)
    odds = log_prior_odds(settings) * np.array([len(w.candidates) for w in sets])
    scores = odds - np.array([w.bic for w in sets]) / (2.0 * temperature)
    scores[[not _is_weighed(w, selection.chosen) for w in sets]] = -np.inf
    weights = np.exp(scores - scores.max())
    weights /= weights.sum()
    return {w.names: p for w, p in zip(sets, weights.tolist(), strict=True)}


def log_prior_odds(settings: Settings) -> float:
    """That one more effect is missing, before anything was recorded."""
    return float(np.log(settings.prior / (1.0 - settings.prior)))


class Tempering(NamedTuple):
    """What the temperature of the probabilities of sets comes from; see `probabilities`.

    Attributes:
        least: temperature by the autocorrelation that the best set leaves.
        misfit_share: share of the gain that is due to all else that a robot's form differs in.
        gain: of the best set, in -2 log likelihood.
    """

    least: float
    misfit_share: float
    gain: float

    @property
    def temperature(self) -> float:
        """By which log likelihood ratios of sets are divided."""
        return max(self.least, self.misfit_share * self.gain)

    def after(self, gain: float) -> float:
        """The temperature once further data have brought the best set a further gain."""
        return max(self.least, self.misfit_share * (self.gain + gain))


def temperature_of(selection: Selection, settings: Settings) -> float:
    """By which log likelihood ratios of sets are divided; see `probabilities`."""
    return tempering_of(selection, settings).temperature


def tempering_of(selection: Selection, settings: Settings) -> Tempering:
    """What the temperature of a selection comes from.

    The gain of a tilt filter alone does not count: it is larger than that of most effects, and on other robots it held
    small effects back that were there.
    """
    weighed = [w for w in selection.sets if _is_weighed(w, selection.chosen)]
    begin = min([selection.base.bic, *(w.bic for w in weighed if w.names == (TILT_FILTER,))])
    gain = begin - min(w.bic for w in weighed)
    return Tempering(settings.least_temperature * selection.chosen.autocorrelation, settings.misfit_share, gain)


def _is_weighed(hypothesis: FittedHypothesis, chosen: FittedHypothesis) -> bool:
    return not hypothesis.overriding or bool(chosen.overriding)
