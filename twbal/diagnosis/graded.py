"""What rollouts on held-out data add to the graded answers: shares of the gap, and what remains."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from twbal.diagnosis.calibration import Objected, calibration
from twbal.diagnosis.findings import Findings
from twbal.diagnosis.free_form_record import FreeForm
from twbal.diagnosis.record import Diagnosis, Gap, ProbableEffect, Remaining, Verdict
from twbal.diagnosis.where import disagreement
from twbal.effects.library import library
from twbal.effects.parameter import parameters_of
from twbal.sysid.recording import Recording

_REGIONS = 5  # in which most remains
_ANY = -math.inf, math.inf


def with_shares(
    effects: Sequence[ProbableEffect], head: Gap | None, errors: Mapping[str, float]
) -> tuple[ProbableEffect, ...]:
    """Effects with their shares of the gap on held-out data.

    Args:
        effects: that may be missing.
        head: the gap that stands for all; None where none was measured.
        errors: of rollouts without one of the effects that `head.after` was measured with, by its name, in the channel
            and over the horizon of `head`; infinite where that model cannot follow the data at all.
    """
    if head is None or head.remaining is None:
        return tuple(effects)
    before, after = head.before - head.noise_floor, head.after
    known = {name: (error - after) / before for name, error in errors.items() if math.isfinite(error)}
    return tuple(replace(effect, share=known.get(effect.name)) for effect in effects)


def widened(effects: Sequence[ProbableEffect], head: Gap | None) -> tuple[ProbableEffect, ...]:
    """Effects with intervals as wide as rollouts on held-out data ask for, but within what a robot can have.

    Arguments as of `with_shares`.
    """
    return widened_by(effects, 1.0 if head is None else head.interval_scale)


def widened_by(effects: Sequence[ProbableEffect], scale: float) -> tuple[ProbableEffect, ...]:
    """Effects with intervals so many times as wide, but within what a robot can have."""
    found = list[ProbableEffect]()
    for effect in effects:
        known = parameters_of(library()[effect.name]) if effect.name in library() else {}
        ends = {name: (p.least, p.below) for name, p in known.items()}
        sizes = {name: of.widened(scale, *ends.get(name, _ANY)) for name, of in effect.parameters.items()}
        found.append(replace(effect, parameters=sizes))
    return tuple(found)


def remaining_of(found: Findings, recordings: Sequence[Recording], head: Gap | None, bins: int) -> Remaining:
    """What nothing explains: of the gap on held-out data, and of the residuals of the fit.

    Args:
        found: by the fit.
        recordings: that were fitted.
        head: the gap that stands for all; None where none was measured.
        bins: ranges of an axis, in the map of what remains.
    """
    is_far = head is not None and not head.is_near_floor(head.after)
    where = disagreement(found.named, recordings, bins)[:_REGIONS]
    return Remaining(head.remaining if head else None, is_far or found.is_autocorrelated, where)


def contradicted(effects: Sequence[ProbableEffect], contradiction: str) -> tuple[ProbableEffect, ...]:
    """Effects after rollouts on held-out data got worse with them: none is named, and none has a share.

    Args:
        effects: before.
        contradiction: what the rollouts say, as a sentence.
    """
    what = Objected.OTHERS
    return tuple(
        replace(
            effect,
            probability=calibration().corrected(effect.uncalibrated, what) if effect.is_named else effect.probability,
            objected=what if effect.is_named else effect.objected,
            is_named=False,
            objections=(*effect.objections, contradiction),
            share=None,
        )
        for effect in effects
    )


def beside_function(diagnosis: Diagnosis, function: FreeForm) -> Diagnosis:
    """A diagnosis after a function of one variable was found to explain more than its best set of effects.

    Then something remains, whatever the residuals say. Effects in whose place the function does as well are no longer
    named: of a drag that the library lacks, a part looks like a rolling friction.
    """
    added = f"{function.quantity[0].upper()}{function.quantity[1:]} as a function of the {function.variable}"
    text = f"{added} does as well in its place, and explains more."
    what = Objected.EFFECT
    effects = [
        effect
        if effect.name not in function.in_place_of
        else replace(
            effect,
            probability=min(calibration().corrected(effect.uncalibrated, what), effect.probability),
            objected=what,
            is_named=False,
            objections=(*effect.objections, text),
        )
        for effect in diagnosis.effects
    ]
    verdict = diagnosis.verdict
    if verdict is Verdict.NONE or (verdict is Verdict.NAMED and not any(effect.is_named for effect in effects)):
        verdict = Verdict.UNKNOWN
    remaining = diagnosis.remaining._replace(is_beyond_noise=True)
    by_probability = tuple(sorted(effects, key=lambda effect: -effect.probability))
    return replace(diagnosis, verdict=verdict, effects=by_probability, remaining=remaining)
