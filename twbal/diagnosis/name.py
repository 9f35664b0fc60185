"""From recordings to the effects that a simulation lacks."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from math import isfinite

import numpy as np

from twbal.core.errors import ConfigError
from twbal.core.gaussian import Array, Mask
from twbal.core.mobility import falling_time
from twbal.core.robot_parameters import RobotParameters
from twbal.diagnosis.advice import advise
from twbal.diagnosis.candidates import Candidate, always_free, log_offsets
from twbal.diagnosis.constancy import inconstant_effects
from twbal.diagnosis.data_sheet import DATA_SHEET, WHEELS
from twbal.diagnosis.drawn_effects import drawn_effects
from twbal.diagnosis.exchange import exchanged
from twbal.diagnosis.filter_result import filter_result_of, one_step_errors, with_offsets
from twbal.diagnosis.findings import Effects, FilterResult, Findings
from twbal.diagnosis.graded import widened_by
from twbal.diagnosis.grown import grown
from twbal.diagnosis.hypothesis import FittedHypothesis
from twbal.diagnosis.likeliest import unobjected, with_likeliest, without_untenable
from twbal.diagnosis.model_comparison import compare_models
from twbal.diagnosis.nearest_rivals import with_nearest_rivals
from twbal.diagnosis.null_distribution import null_distribution, null_score
from twbal.diagnosis.null_record import NullScore
from twbal.diagnosis.objections import (
    Extent,
    Objection,
    autocorrelation_limit,
    is_doubtful,
    may_be_a_finding,
    negligible,
    objections,
    pulls_the_data_sheet,
    shifts_of,
    to_short_recordings,
)
from twbal.diagnosis.power import detection_power
from twbal.diagnosis.power_record import DetectionPower
from twbal.diagnosis.probable import Weights, outweighed, probable_effects, surely_negligible
from twbal.diagnosis.problem import Problem, Selection
from twbal.diagnosis.record import (
    LIKELY,
    ProbableEffect,
    ResidualAutocorrelation,
    Rival,
    Verdict,
)
from twbal.diagnosis.removal import without
from twbal.diagnosis.score_test import score_candidates
from twbal.diagnosis.select import refitted, select
from twbal.diagnosis.settings import Settings
from twbal.diagnosis.tempered import search_again, settled
from twbal.diagnosis.tolerance_test import tolerance_statistic
from twbal.diagnosis.usual_effects import search_from_usual
from twbal.diagnosis.verdict import (
    allowed_differences,
    conclude,
    data_sheet_classes,
    log_prior_odds,
    probabilities,
    temperature_of,
    tempering_of,
)
from twbal.effects.library import library
from twbal.planar.parameters import PlanarParameters, planar_parameters
from twbal.sysid.model import Data, FreeParameter, Model, Offsets
from twbal.sysid.noise import LASTING, UNSENSED, NoiseModel
from twbal.sysid.prediction_error_fit import descend
from twbal.sysid.recording import MEASURED, Recording, are_of_several_runs

_NOISE_ITERATIONS = 30
_LARGEST_TORQUE = 0.003  # of a model discrepancy, over the torque limit
QUIETEST = (1e-3, 0.0, 0.0, 0.0)
"""Least noise of tilt, tilt rate, wheel angle and wheel rate [rad, rad/s].

A tilt that adds up the gyro agrees with it to much less than this, but is no truer.
"""
_PARTIAL = 2.0  # times as wide are intervals where rollouts that widen them lack effects of the set they are of
_ITERATIONS = 50  # at most, of the fit that puts the wheels back to the data sheet


def name_effects(
    recordings: Sequence[Recording],
    robot: RobotParameters,
    effects: Effects,
    candidates: Sequence[Candidate],
    settings: Settings,
    progress: Callable[[str], None] = lambda line: None,
) -> Findings:
    """Name what the simulation of a robot lacks to explain recordings.

    Args:
        recordings: of the robot; long enough, and checked (`recording.read_recordings`).
        robot: data sheet.
        effects: that the simulation has already, without the sensors' noise.
        candidates: that may be missing (`effect_candidates.candidates_for`).
        settings: of the diagnosis.
        progress: is told what is being done, a line at a time.

    Raises:
        ConfigError: an effect that is to be left out is none.
    """
    settings = replace(settings, tolerances=settings.tolerances.for_robot(robot))
    planar = planar_parameters(robot, effects)
    data, start, always = _begun(recordings, robot, planar, _given(candidates, effects), settings)
    problem = Problem(data, with_fitted_noise(data, start), always, _missing(candidates, effects, settings), settings)
    problem, base, extent = _against_chance(problem, robot, progress)
    settings = problem.settings
    selection = _search(problem, base, extent, progress)
    weights = probabilities(selection, settings)
    against = partial(_objected, problem, weights=weights, extent=extent, largest=largest_noise(robot))
    selection = _with_unobjected(problem, selection, weights, against, progress)
    differences = allowed_differences(problem, selection.chosen)
    rivals = _rivals(data, selection, weights, settings)
    compared = compare_models(problem, selection, rivals, tempering_of(selection, settings), differences)
    power, chance = _further_effects(problem, selection, extent)
    selection = _with_settled_values(problem, selection, progress)
    problem = problem.tempered(selection.chosen.temperature)
    progress("checking whether what fits best is a finding")
    limits = settings.tolerances.limits(free.field for free in always if free.effect in effects)
    statistic = tolerance_statistic(data, selection.chosen.fit, limits)
    objected = against(selection)
    verdict = conclude(selection, objected, statistic, power, settings)
    effects_found = probable_effects(data, selection, objected, verdict, weights, settings, extent)
    named = selection.chosen if verdict in (Verdict.NAMED, Verdict.DATA_SHEET) else selection.base
    if verdict is Verdict.UNKNOWN:
        named, effects_found = _guessed(problem, selection, effects_found, objected)
    nominal = _nominal(data, start._replace(noise=selection.base.fit.model.noise), settings)
    fitted = _filter_result(data, selection.base, effects)
    last = fitted if named is selection.base else _filter_result(data, named, effects)
    return Findings(
        verdict=verdict,
        effects=effects_found,
        added=named.names,
        data_sheet=shifts_of(named, settings),
        data_sheet_class=data_sheet_classes(named, statistic, settings) if verdict is Verdict.DATA_SHEET else (),
        rivals=rivals,
        autocorrelation=autocorrelation_of(data, nominal, named.fit.model),
        is_autocorrelated=named.autocorrelation > autocorrelation_limit(data.count, settings),
        noise=sensed_values(data, named.fit.model.noise.sensors),
        advice=advise(selection, objected, statistic, power, chance, verdict, settings),
        nominal=filter_result_of(data, nominal, effects),
        nominal_errors=one_step_errors(data, nominal, named.fit.model),
        refitted=fitted,
        named=last,
        without=_without_each(problem, named, fitted, effects),
        refitted_data_sheet=shifts_of(selection.base, settings),
        comparison=compared,
        power=power,
        null_score=chance,
        drawn=drawn_effects(data, named, last.effects, settings.blocks),
    )


def _begun(
    recordings: Sequence[Recording],
    robot: RobotParameters,
    planar: PlanarParameters,
    given: Sequence[Candidate],
    settings: Settings,
) -> tuple[Data, Model, tuple[FreeParameter, ...]]:
    """The data, the simulation as it is, and what every model may change."""
    data = Data(recordings, settings.substeps, largest_noise(robot), QUIETEST)
    logs = len(recordings), are_of_several_runs(recordings)
    offsets = log_offsets(settings.tolerances, *logs)
    start = Model(planar, 0.0, first_noise(robot, data.sensed), (Offsets(),) * (logs[0] if offsets else 0))
    start = start._replace(balanced=logs[0] if logs[1] and offsets else 0)
    return data, start, always_free(settings.tolerances, planar, *logs, given)


def _nominal(data: Data, start: Model, settings: Settings) -> Model:
    """The simulation as it is, with offsets of the tilts and noise as fitted: what else is free is none of its own."""
    tilts = log_offsets(settings.tolerances, len(data.recordings), several_runs=False)
    return with_fitted_noise(data, with_offsets(data, start, tilts))


def _against_chance(
    problem: Problem, robot: RobotParameters, progress: Callable[[str], None]
) -> tuple[Problem, FittedHypothesis, Extent]:
    """The problem with least scores by what chance makes of one, the data sheet refitted, and how far the data go."""
    base, extent = refitted(problem, progress), extent_of(problem.data.recordings, robot)
    settings, left = problem.settings, problem.beside(base)
    null = null_distribution(problem.data, base, left, extent.along(), settings.temperature)
    return problem._replace(settings=settings.held_against(null.exceeded_with)), base, extent


def _objected(
    problem: Problem, selection: Selection, weights: Weights, extent: Extent, largest: NoiseModel
) -> tuple[Objection, ...]:
    """What speaks against the chosen set."""
    chosen, settings = selection.chosen, problem.settings
    inconstant = inconstant_effects(problem.data, chosen, settings.thresholds.max_size_difference)
    found = objections(chosen, largest, inconstant, settings, extent)
    return (*found, *outweighed(selection, weights, settings))


def _further_effects(
    problem: Problem, selection: Selection, extent: Extent
) -> tuple[tuple[DetectionPower, ...], NullScore | None]:
    """Of effects that the chosen set lacks: what would have shown of them, and what chance makes of the best."""
    chosen, data, left = selection.chosen, problem.data, problem.beside(selection.chosen)
    temperature = temperature_of(selection, problem.settings)
    beside = [step.scored for step in selection.rounds if step.base.names == chosen.names and step.scored]
    scored = beside[-1] if beside else score_candidates(data, chosen.fit, left)
    power = detection_power(scored, chosen, data, temperature, log_prior_odds(problem.settings))
    null = null_distribution(data, chosen, left, extent.along(), 1.0, chosen.autocorrelation)
    return power, null_score(data, null, scored, chosen)


def _search(problem: Problem, base: FittedHypothesis, extent: Extent, progress: Callable[[str], None]) -> Selection:
    """The set of effects that fits best, by the first search, and by two others as long as a doubt is left.

    A set with a parameter at a bound is no finding, so it does not take the place of one that may be.
    """
    selection, settings = exchanged(problem, select(problem, base, progress), progress), problem.settings
    for search in (search_again, search_from_usual) if settings.tempered_search else ():
        if not is_doubtful(selection.chosen, settings) and not to_short_recordings(selection.chosen, extent):
            break
        again = search(problem, selection, progress)
        if again.chosen is not selection.chosen:
            again = exchanged(problem, again, progress)
        is_kept = selection.chosen.candidates and may_be_a_finding(selection.chosen, settings)
        selection = selection._replace(rounds=again.rounds) if is_kept and again.chosen.at_bound else again
    larger = grown(problem, selection, progress)
    selection = larger if larger.chosen is selection.chosen else exchanged(problem, larger, progress)
    nearest = with_nearest_rivals(problem, selection, progress)
    if nearest.chosen is not selection.chosen:
        nearest = exchanged(problem, grown(problem, nearest, progress), progress)
    selection = nearest
    selection = with_likeliest(problem, selection, probabilities(selection, settings), progress).best_fitted
    return without_untenable(problem, selection, extent, partial(may_be_a_finding, settings=settings), progress)


def _with_unobjected(
    problem: Problem,
    selection: Selection,
    weights: Weights,
    against: Callable[[Selection], Sequence[Objection]],
    progress: Callable[[str], None],
) -> Selection:
    """The selection with a set that has nothing `against` it, if one is about as likely."""

    def is_objected(chosen: FittedHypothesis) -> bool:
        return bool(against(_with_settled_values(problem, selection._replace(chosen=chosen), progress)))

    return selection._replace(chosen=unobjected(selection, weights, is_objected))


def _with_settled_values(problem: Problem, selection: Selection, progress: Callable[[str], None]) -> Selection:
    """The selection, whose set has values by a tempered likelihood where it pulls the data sheet."""
    if not (selection.chosen.effects and pulls_the_data_sheet(selection.chosen, problem.settings)):
        return selection
    progress("fitting the values of what fits best again, by a tempered likelihood")
    return selection._replace(chosen=settled(problem, selection.chosen))


def extent_of(recordings: Sequence[Recording], robot: RobotParameters) -> Extent:
    """How far the recordings go."""
    tilt, wheel_angle = MEASURED.index("tilt"), MEASURED.index("wheel_angle")
    turned = [recording.measured[:, wheel_angle] for recording in recordings]
    rolled = [recording.measured[:, [tilt, wheel_angle]].sum(axis=1) for recording in recordings]
    seconds = max(len(recording) * recording.period for recording in recordings)
    return Extent(
        seconds,
        max(float(np.ptp(angle)) for angle in rolled) * robot.wheel_radius,
        max(float(np.ptp(angle)) for angle in turned) / (2.0 * np.pi),
        seconds / falling_time(robot),
    )


def _given(candidates: Sequence[Candidate], effects: Effects) -> list[Candidate]:
    """Those that the simulation has already and that are no values of the data sheet."""
    return [c for c in candidates if c.name in effects and not c.in_data_sheet]


def _missing(candidates: Sequence[Candidate], effects: Effects, settings: Settings) -> list[Candidate]:
    """Those that the simulation does not have and that are not left out; for errors see `name_effects`."""
    unknown = set(settings.exclude) - {*library(), *(candidate.name for candidate in candidates)}
    if unknown:
        known = ", ".join(candidate.name for candidate in candidates)
        raise ConfigError(f"There is no effect {min(unknown)!r} to leave out; the effects are: {known}.")
    taken = {*effects, *settings.exclude}
    left = [c for c in candidates if c.name not in taken and not set(effects).intersection(c.never_beside)]
    return [c._replace(acts_on=()) if set(effects).intersection(c.acts_on) else c for c in left]


def first_noise(robot: RobotParameters, sensed: Mask) -> NoiseModel:
    """Where the search for the noise begins."""
    sensors = np.where(sensed, [0.005, 0.03, 0.003, 0.1], UNSENSED)
    torques = np.full(2, 0.005 * robot.torque_limit)
    return NoiseModel(sensors, torques, largest_noise(robot).discrepancy / [6.0, 6.0, 6.0, 100.0, 50.0, 10.0])


def largest_noise(robot: RobotParameters) -> NoiseModel:
    """What it may come to: any noise, but no discrepancy that could take the place of the model.

    Where torques of 30 % of the limit were allowed, dry friction on the logs of a REGBOT was taken for one of them.
    """
    torque = _LARGEST_TORQUE * robot.torque_limit
    return NoiseModel(np.full(4, np.inf), np.full(2, np.inf), np.array([torque, torque, 0.006, 0.5, 0.1, 0.0045]))


def with_fitted_noise(data: Data, model: Model) -> Model:
    """The model with its noise fitted, first without a model discrepancy: of two local optima, the likelier one."""
    none = np.zeros(LASTING)
    white = data.with_noise(model._replace(noise=model.noise._replace(discrepancy=none)), _NOISE_ITERATIONS)
    begin = white._replace(noise=white.noise._replace(discrepancy=model.noise.discrepancy))
    return data.with_noise(begin, _NOISE_ITERATIONS, afresh=True)


def sensed_values(data: Data, values: Array) -> dict[str, float]:
    """Values of the channels that were measured, by name."""
    return {
        name: float(value) for name, value, is_sensed in zip(MEASURED, values, data.sensed, strict=True) if is_sensed
    }


def _filter_result(data: Data, hypothesis: FittedHypothesis, already: Effects) -> FilterResult:
    """What a fit makes of the recordings, in values that the simulation can take.

    It has no effect for the wheels' mass and inertia: these go back to the data sheet, and what else is free makes up.
    That is far to go along a narrow valley; a fit that ends half-way begins its rollouts at a wrong motion.
    """
    kept = [free for free in hypothesis.fit.free_parameters if free.field not in WHEELS]
    start = hypothesis.fit.model.put(
        {free.field: free.mean for free in hypothesis.fit.free_parameters if free.field in WHEELS}
    )
    model = descend(data, start, data.filter(start), kept, _ITERATIONS).model
    effects: dict[str, dict[str, float]] = {name: dict(values) for name, values in already.items()}
    simulated = {*effects, *hypothesis.names}
    for free in hypothesis.fit.free_parameters:
        if free.field in DATA_SHEET or free.effect in simulated:
            effects.setdefault(free.effect, {})[free.parameter] = model.value(free.field)
    return filter_result_of(data, model, effects)


def _without_each(
    problem: Problem, named: FittedHypothesis, fitted: FilterResult, already: Effects
) -> dict[str, FilterResult]:
    """What a set makes of the recordings without each of its effects, by the name of that effect."""
    if len(named.candidates) == 1:
        return {effect.name: fitted for effect in named.effects}
    return {
        effect.name: _filter_result(problem.data, without(problem, named, effect), already) for effect in named.effects
    }


def _guess(
    problem: Problem, chosen: FittedHypothesis, effects: Sequence[ProbableEffect], objected: Sequence[Objection]
) -> FittedHypothesis | None:
    """What is worth putting into a simulation although something speaks against the chosen set.

    All of it where nothing but short recordings does; else its effects that are more likely missing than not, and the
    negligible ones, fitted without the others. None where none is left, or where what is left diverges or has a
    parameter at a bound.
    """
    if objected and all(objection.is_of_length for objection in objected):
        return chosen
    trifles = negligible(chosen, problem.settings)
    likely = {effect.name for effect in effects if effect.probability >= LIKELY}
    if not any(each.name in likely and each not in trifles for each in chosen.effects):
        return None
    guess = chosen
    for candidate in chosen.effects:
        if candidate.name not in likely and candidate not in trifles:
            guess = without(problem, guess, candidate)
    return None if guess.at_bound or not isfinite(guess.bic) else guess


def _guessed(
    problem: Problem, selection: Selection, effects: tuple[ProbableEffect, ...], objected: Sequence[Objection]
) -> tuple[FittedHypothesis, tuple[ProbableEffect, ...]]:
    """What enters the simulation after `unknown`, and the effects, less sure where that is a part of the chosen set."""
    guess = _guess(problem, selection.chosen, effects, objected)
    is_partial = guess is not None and len(guess.candidates) < len(selection.chosen.candidates)
    return guess or selection.base, widened_by(effects, _PARTIAL) if is_partial else effects


def _rivals(data: Data, selection: Selection, weights: Weights, settings: Settings) -> tuple[Rival, ...]:
    """All sets that were fitted, the best first."""
    base, small = selection.base, surely_negligible(data, selection, weights, settings)
    found = [
        Rival(w.names, base.bic - w.bic, weights[w.names], w.autocorrelation, small.get(w.names, ()))
        for w in selection.sets
    ]
    return tuple(sorted(found, key=lambda rival: -rival.score))


def autocorrelation_of(data: Data, before: Model, after: Model) -> tuple[ResidualAutocorrelation, ...]:
    """Of the residuals, per channel, by the simulation as it is and with what was found."""
    found = []
    for model in (before, after):
        kalman = data.filter(model)
        found.append(sensed_values(data, data.autocorrelation(data.errors(model, kalman), kalman)))
    return tuple(ResidualAutocorrelation(name, found[0][name], found[1][name]) for name in found[0])
