"""Plain sentences with a verdict: what the data do not carry, and what to do next."""

from collections.abc import Sequence

from twbal.core.episode import Episode, Outcome
from twbal.diagnosis.data_sheet import DATA_SHEET
from twbal.diagnosis.follow_up import Disagreement, NextExperiment
from twbal.diagnosis.hypothesis import FittedHypothesis
from twbal.diagnosis.model_comparison import ModelComparison
from twbal.diagnosis.null_record import NullScore
from twbal.diagnosis.objections import Objection, negligible, spaced, with_values
from twbal.diagnosis.power import unseen
from twbal.diagnosis.power_record import DetectionPower
from twbal.diagnosis.problem import Selection, passes
from twbal.diagnosis.record import LIKELY, ProbableEffect, Verdict
from twbal.diagnosis.settings import Settings
from twbal.diagnosis.verdict import beyond_tolerance

UNEXPLAINED = (
    "Something moves this robot that no effect of the library explains; the map of the disagreement says where."
)

UNCONFIRMED = (
    "WARNING: no rollout could be made on held-out data, so nothing confirms what the fit says. Record longer, or give "
    "other recordings as test_episodes=..."
)

OUTWEIGHED = "The set of effects that was found is less likely than others are together, so it is not named."


def advise(
    selection: Selection,
    objected: Sequence[Objection],
    statistic: float,
    power: Sequence[DetectionPower],
    chance: NullScore | None,
    verdict: Verdict,
    settings: Settings,
) -> tuple[str, ...]:
    """What to make of a selection.

    Args:
        selection: how it went.
        objected: what speaks against its finding.
        statistic: of its data sheet.
        power: what the data would have shown of effects that it does not have.
        chance: what the best of these effects scores, and what chance makes of it; None of none.
        verdict: that it came to.
        settings: of the diagnosis.
    """
    found, chosen = [], selection.chosen
    hidden = unseen(power)
    if verdict is Verdict.UNDECIDED:
        found.append("The recordings are too poor to decide. Record some that tell effects apart, by the next command.")
    if verdict in (Verdict.UNDECIDED, Verdict.NONE):
        found += [chance.text] if chance else []
    if verdict in (Verdict.UNDECIDED, Verdict.NONE) and hidden:
        listed = ", ".join(f"{spaced(each.name)} ({each.at_usual:.0%})" for each in hidden)
        found.append(
            "These effects could be there without these recordings showing it. In parentheses stands the probability "
            f"with which one of its usual size would have been found: {listed}."
        )
    if verdict is Verdict.UNKNOWN:
        others = [objection for objection in objected if not objection.is_of_length]
        if others:
            found.append(OUTWEIGHED if all(objection.is_of_weights for objection in others) else UNEXPLAINED)
        found += [objection.text for objection in objected]
        if settings.exclude:
            listed = ", ".join(sorted(name.replace("_", " ") for name in settings.exclude))
            found.append(f"Not weighed, as the settings leave them out (diagnosis.exclude): {listed}.")
    if verdict is Verdict.NAMED:
        trifles = negligible(chosen, settings)
        if trifles:
            found.append(f"Too small to be named: {with_values(chosen, trifles)}.")
        shifts = beyond_tolerance(chosen, statistic, settings)
        if shifts:
            limits = sorted(shift.tolerance for shift in shifts)
            limit = " to ".join(dict.fromkeys(f"{end:.0%}" for end in (limits[0], limits[-1])))
            listed = ", ".join(shift.text for shift in shifts)
            found.append(f"Nominal values are off as well, beyond their tolerances of {limit}: {listed}.")
        if _one_more(selection, settings):
            found.append("The data ask for one more effect than is named; diagnose again with augmented.yaml as sim=.")
    return tuple(found)


def on_falls(episodes: Sequence[Episode], verdict: Verdict) -> tuple[str, ...]:
    """What to do where the robot fell while it was recorded, and that was not enough to name anything."""
    fell = sum(episode.outcome is Outcome.TILT_LIMIT for episode in episodes)
    if not fell or not verdict.is_open:
        return ()
    return (
        f"The robot fell in {fell} of {len(episodes)} episodes. One that stays up tells more: record it by a gentler "
        "regulator, with a smaller policy.command_width.",
    )


def on_next_experiment(
    found: NextExperiment | None, comparison: ModelComparison, effects: Sequence[ProbableEffect]
) -> tuple[str, ...]:
    """What the suggested experiment is expected to tell, and what to do by hand where that is little.

    Args:
        found: the experiment; None where none is safe.
        comparison: what it is to decide.
        effects: that may be missing.
    """
    sets = "; ".join(spaced(" + ".join(each.names)) or "the data sheet refitted" for each in comparison.rivals)
    by_hand = dict.fromkeys(
        effect.separate_by for effect in effects if effect.probability >= LIKELY and effect.separate_by
    )
    if found is None:
        said = f"No experiment is suggested: by simulation of one of the likeliest sets of effects ({sets}), the robot "
        return (f"{said}would come near falling, or often meet its torque limit, in each of them.", *by_hand)
    said = f"The likeliest sets of effects are: {sets}. "
    separation, repetition = found.in_nats
    expected = f"a log likelihood ratio of {separation} between the true one and another"
    before = f"{found.seconds:g} s like those before bring {repetition}"
    if found.repetition > found.separation:
        before += ", so record again as before: that is expected to tell more"
    if found.is_decisive:
        said += f"By simulation, {found.seconds:g} s of the suggested experiment bring {expected}; {before}."
        return (said,)
    said += f"No experiment that the robot can do by itself is expected to tell them apart: {found.seconds:g} s of the "
    which = "best one" if found.repetition > found.separation else "best one, which is suggested,"
    return (f"{said}{which} bring {expected}; {before}.", *by_hand)


def on_disagreements(found: Sequence[Disagreement]) -> tuple[str, ...]:
    """Which recordings disagree with the others, in what, and what to try."""
    said = []
    for each in found:
        like = f", or {', '.join(map(_of_effect, each.alike))}" if each.alike else ""
        unit = f" {each.unit}" if each.unit else ""
        where = f"Recording {each.recording} disagrees with {', '.join(each.others)}"
        said.append(
            f"{where}: in {_of_effect(each.parameter)}{like} "
            f"it differs by about {each.difference:+.2g} ± {1.96 * each.error:.2g}{unit}, to first order, where all "
            f"together have {each.fitted:.3g} (p = {each.p_value:.1g}).{_beyond(each)} Diagnose it alone, and the "
            "others without it."
        )
    return tuple(said)


def _beyond(found: Disagreement) -> str:
    """That the difference would lead to a value that cannot be, where it does."""
    is_factor = found.parameter in {f"{factor.effect}.{factor.parameter}" for factor in DATA_SHEET.values()}
    if not is_factor or found.fitted + found.difference > 0.0:
        return ""
    return " No robot has that value: it stands for something else that changed."


def _of_effect(parameter: str) -> str:
    """A parameter as it stands in a sentence: `coulomb friction (torque)`."""
    effect, name = parameter.split(".")
    return f"{spaced(effect)} ({name})"


def _one_more(selection: Selection, settings: Settings) -> list[FittedHypothesis]:
    """Sets with one effect more than the chosen one, for which the data ask."""
    chosen, found = selection.chosen, []
    for w in (w for step in selection.rounds for w in step.hypotheses):
        more = [candidate for candidate in w.candidates if candidate.name not in chosen.names]
        if len(more) == 1 and len(w.candidates) == len(chosen.candidates) + 1 and not w.at_bound:
            found.append(w._replace(candidates=(*chosen.candidates, *more)))
    return [w for w in found if passes(w, chosen, settings)]
