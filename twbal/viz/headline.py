"""What a diagnosis comes to, in a few sentences."""

from collections.abc import Iterable, Sequence

from twbal.diagnosis.record import CLOSED, GIVEN_EFFECTS, Diagnosis, Gap, ProbableEffect, Verdict

_HIGH = 0.9  # probability of a named effect from which on it goes without saying


def headline_text(diagnosis: Diagnosis) -> str:
    """What the diagnosis comes to, in a few sentences."""
    text, loss = _verdict(diagnosis), diagnosis.lost_commands
    if loss is None:
        return text
    lost = f"The robot did not get {100 * loss.share:.2g} % of its commands in time."
    return f"{lost} With those that acted: {text[0].lower()}{text[1:]}"


def _verdict(diagnosis: Diagnosis) -> str:
    head = diagnosis.headline
    if diagnosis.verdict is Verdict.NAMED:
        text = f"The simulation lacks {_listed(map(_with_doubt, diagnosis.named_effects))}."
        if head is not None:
            text = f"{text} {_what_closes(head, diagnosis.named_effects)} {_errors(head, 'what was named')}"
        if diagnosis.remaining.is_beyond_noise:
            text = f"{text} That does not explain all."
        return text
    if diagnosis.verdict is Verdict.UNKNOWN and diagnosis.likely_effects:
        likely = _listed(f"{_described(effect)} ({effect.probability:.0%})" for effect in diagnosis.likely_effects)
        text = f"There is a gap between simulation and measurement. Likely missing: {likely}. That is not sure enough"
        text = f"{text} to be named, or does not explain all."
        return text if head is None else f"{text} {_errors(head, 'the best guess' if diagnosis.added else '')}"
    if diagnosis.verdict is Verdict.UNKNOWN and diagnosis.effects:
        return "There is a gap between simulation and measurement, and no effect is more likely than not to explain it."
    if diagnosis.verdict is Verdict.DATA_SHEET:
        are_given = GIVEN_EFFECTS in diagnosis.data_sheet_class
        found = "what the simulation has is off: " if are_given else "the data sheet is off: "
        found += "; ".join(_class(name, diagnosis) for name in diagnosis.data_sheet_class)
        if head is None or head.is_near_floor(head.after):
            return f"No effect is missing, but {found}."
        return f"{found[0].upper()}{found[1:]}. That does not explain all. {_errors(head, '')}"
    if diagnosis.verdict is Verdict.NONE and head is not None and not head.is_near_floor(head.before):
        text = "With its nominal parameters refitted within their tolerances, the simulation explains these data"
        return f"{text}: nothing is missing that they could show. {_errors(head, '')}"
    return {
        Verdict.NONE: "The simulation explains these data: nothing is missing that they could show.",
        Verdict.UNKNOWN: "There is a gap between simulation and measurement, and nothing in the library explains it.",
        Verdict.UNDECIDED: "These data are too poor to tell what the simulation lacks.",
    }[diagnosis.verdict]


def effect_lines(diagnosis: Diagnosis) -> list[str]:
    """Size, interval and probability of each effect that is named or likely, a line each; how wide intervals are."""
    lines = [_sized(effect) for effect in (*diagnosis.named_effects, *diagnosis.likely_effects)]
    head = diagnosis.headline
    if not lines or head is None or not head.widens_intervals:
        return lines
    why = f"held-out rollouts are so many times as far off as {head.expected_by} would make them"
    return [*lines, f"(Intervals are {head.interval_scale:.2g} times as wide as the fit alone makes them: {why}.)"]


def _sized(effect: ProbableEffect) -> str:
    sizes = [
        f"{name} {of.value:.3g}{' ' * bool(of.unit)}{of.unit} ({of.low95:.3g} to {of.high95:.3g})"
        for name, of in effect.parameters.items()
    ]
    return f"{effect.name.replace('_', ' ')}: {', '.join(sizes)} (95 %), probability {effect.probability:.2f}"


def _class(name: str, diagnosis: Diagnosis) -> str:
    """A class of the data sheet that is off, with its values."""
    inside = [shift.text for shift in diagnosis.data_sheet if shift.group == name]
    return f"{name} ({', '.join(inside)})" if inside else name


def _what_closes(head: Gap, effects: Sequence[ProbableEffect]) -> str:
    """Which share of the gap refitting closes, and which the effects."""
    refit, more = head.closed_by_refit, head.closed_by_effects
    if refit is None or more is None:
        return "The gap on held-out data is too near to the sensors' noise to tell what closes it."
    alone = len(effects) == 1
    names, close = (effects[0].name.replace("_", " "), "closes") if alone else ("the effects", "close")
    if head.after <= head.noise_floor:
        rest = f"{names} {close} the rest, down to the sensors' noise."
    elif more <= 0.0:
        rest = f"{names} {close} no more of it."
    elif refit > 0.0:
        rest = f"{names} {close} another {100 * more:.0f} %."
    else:
        rest = f"with {names} added, {100 * (refit + more):.0f} % of it is closed."
    share = f"closes {100 * refit:.0f} %" if refit > 0.0 else "alone closes nothing"
    label = "" if refit + more > CLOSED else "Named, not closed. "
    return f"{label}Refitting the nominal parameters {share} of the gap; {rest}"


def _errors(head: Gap, added: str) -> str:
    """The errors of the rollouts from which shares of the gap are made; `added`: what else they had, if anything."""
    with_it = f", {head.after:.3g} rad with {added}" if added else ""
    return (
        f"Held-out rollouts are off by {head.before:.3g} rad of {head.channel.replace('_', ' ')} after "
        f"{head.horizon:g} s as the data sheet says, {head.refitted:.3g} rad refitted{with_it}; {head.expected_by} "
        f"would make that {head.expected:.3g} rad."
    )


def _listed(parts: Iterable[str]) -> str:
    """One, two and three."""
    *most, last = parts
    return f"{', '.join(most)}{' and ' if most else ''}{last}"


def _with_doubt(effect: ProbableEffect) -> str:
    """A named effect, with its probability where that is not high."""
    doubt = "" if effect.probability >= _HIGH else f" ({effect.probability:.0%})"
    return f"{_described(effect)}{doubt}"


def _described(effect: ProbableEffect) -> str:
    name = effect.name.replace("_", " ")
    if effect.equivalents:
        name += f" (or {', '.join(other.replace('_', ' ') for other in effect.equivalents)})"
    return name
