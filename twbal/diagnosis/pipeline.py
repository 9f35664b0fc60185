"""A whole diagnosis: from measured episodes to a verdict, the gap on held-out data, and a corrected simulation."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from twbal.core.engine import dividing_step, substeps
from twbal.core.episode import Episode
from twbal.core.robot_parameters import RobotParameters
from twbal.diagnosis.advice import OUTWEIGHED, UNCONFIRMED, UNEXPLAINED, on_disagreements, on_falls, on_next_experiment
from twbal.diagnosis.candidates import always_free, log_offsets
from twbal.diagnosis.commands_that_acted import without_lost_commands
from twbal.diagnosis.disagreement import disagreements
from twbal.diagnosis.effect_candidates import candidates_for
from twbal.diagnosis.engine_rollouts import replayed
from twbal.diagnosis.filter_result import filter_recordings
from twbal.diagnosis.findings import FilterResult, Findings
from twbal.diagnosis.free_form import FreeFormInputs, free_forms
from twbal.diagnosis.free_form_record import on_free_forms
from twbal.diagnosis.gap import Models, measure_gaps, rollout_error
from twbal.diagnosis.graded import beside_function, contradicted, remaining_of, widened, with_shares
from twbal.diagnosis.gyro_walk import gyro_bias_walk
from twbal.diagnosis.inputs import DataSettings, DiagnosedSimulation, NamedEpisodes
from twbal.diagnosis.model_comparison import ModelComparison, is_open
from twbal.diagnosis.motor_difference import motor_difference
from twbal.diagnosis.name import name_effects
from twbal.diagnosis.next_experiment import next_experiment
from twbal.diagnosis.record import Diagnosis, Verdict, headline
from twbal.diagnosis.rollouts_from_recordings import RolloutStarts
from twbal.diagnosis.settings import Settings
from twbal.diagnosis.side_findings import UNEQUAL, effects_of
from twbal.diagnosis.verdict import review
from twbal.diagnosis.wheel_friction import identify_friction
from twbal.diagnosis.wheels_off_ground import ADVICE as IN_AIR
from twbal.diagnosis.wheels_off_ground import held, held_upright, wheels_in_air, without_rotors
from twbal.diagnosis.where import disagreement
from twbal.planar.joint_damping import joint_damping_rate
from twbal.planar.parameters import planar_parameters
from twbal.sysid.held_out import Split, held_out
from twbal.sysid.recording import (
    MEASURED,
    Recording,
    Usability,
    are_of_several_runs,
    check_signals,
    read_recordings,
    stuck_sensors,
    what_is_not_used,
)

Progress = Callable[[str], None]
"""Is told what is being done, a line at a time."""

_SETTLED = 2.0  # s; after which a filter knows the motion as well as it ever will
_SPACING = 5  # control periods from one rollout to the next, at least


class DiagnosisResult(NamedTuple):
    """What came of a diagnosis.

    Attributes:
        diagnosis: what is said of the simulation.
        findings: what it rests on.
        split: the data.
        simulation: with what was found.
    """

    diagnosis: Diagnosis
    findings: Findings
    split: Split
    simulation: DiagnosedSimulation


def diagnose_episodes(
    measured: NamedEpisodes,
    tests: NamedEpisodes,
    simulation: DiagnosedSimulation,
    settings: Settings,
    data: DataSettings,
    progress: Progress = lambda line: None,
) -> DiagnosisResult:
    """Name what a simulation lacks to explain measured episodes, and measure how far that closes the gap.

    Of a robot that lies with its wheels in the air, what holds its wheels back is named.

    Args:
        measured: of a robot.
        tests: that nothing is fitted to, and the gap is measured on; of none, a share of `measured`.
        simulation: that they are held against.
        settings: how effects are named.
        data: what is read of the episodes, and how the gap is measured.
        progress: is told what is being done.

    Raises:
        DataError: the episodes cannot be used; the message says which, why, and what to try.
        ConfigError: an effect that is to be left out is none.
    """
    damping = joint_damping_rate(planar_parameters(simulation.robot, simulation.effects))
    settings = settings.for_period(simulation.robot.control_period, damping)
    usability = Usability(data.min_length, data.min_samples, data.max_yaw_rate, data.max_tilt)
    robot, present = simulation.robot, simulation.effects
    in_air = wheels_in_air([*measured.episodes, *tests.episodes], data.max_tilt)
    simulated = DiagnosedSimulation(robot, present, dividing_step(robot.control_period, simulation.physics_step))
    if in_air:
        settings = replace(settings, tolerances=settings.tolerances.without_offsets())
        simulated = replace(simulated, robot=held(robot), effects=without_rotors(present))
        usability = replace(usability, min_samples=data.min_length, needs_tilt=False)
        measured, tests = _upright(measured), _upright(tests)
    split = _split(measured, tests, simulated.robot, usability, data.held_out)
    read = [recording.name for recording in (*split.fitted, *split.kept_back)]
    for said in what_is_not_used([*measured.episodes], [*measured.names], read, usability, simulated.robot):
        progress(said)
    progress(_how_many(split))
    name = identify_friction if in_air else name_effects

    def search(recordings: Sequence[Recording]) -> Findings:
        candidates = candidates_for(simulated.robot, settings.include)
        return name(recordings, simulated.robot, simulated.effects, candidates, settings, progress)

    found, split, loss = without_lost_commands(search(split.fitted), split, search, progress)
    progress("rollouts in PyBullet against held-out data")
    diagnosis, found = _reviewed(_diagnosis(found, split, simulated, settings, data), found)
    first = (IN_AIR,) if in_air else (*stuck_sensors(split.fitted), *on_falls(measured.episodes, diagnosis.verdict))
    diagnosis = replace(diagnosis, advice=(*first, *diagnosis.advice))
    if (comparison := found.comparison) is not None:
        for what, step in (
            ("comparing the recordings", partial(_with_disagreements, comparison, split)),
            (
                "looking for a function of one variable",
                partial(_with_free_forms, comparison, split, simulated, settings, data, progress),
            ),
            ("looking at the bias of the gyro", partial(_with_gyro_walk, comparison)),
            ("choosing the next experiment", partial(_with_next_experiment, comparison, robot, data, progress)),
        ):
            diagnosis = _with_step(what, step, diagnosis)
    corrected = replace(simulated, robot=robot, effects={**present, **found.named.effects})
    if loss is not None:
        diagnosis = replace(diagnosis, lost_commands=loss, advice=(*diagnosis.advice, loss.text))
    compared = partial(_with_motor_difference, found, [*measured.episodes, *tests.episodes], corrected, data)
    diagnosis = _with_step("comparing the motors", compared, diagnosis)
    effects = {**corrected.effects, **effects_of(loss, diagnosis.motor_difference)}
    corrected = replace(corrected, effects=effects)
    return DiagnosisResult(diagnosis, found, split, corrected)


def _with_step(what: str, step: Callable[[Diagnosis], Diagnosis], diagnosis: Diagnosis) -> Diagnosis:
    """What a further step adds; where its numbers fail, a sentence about it, as nothing found before depends on it."""
    try:
        return step(diagnosis)
    except (ArithmeticError, ValueError) as error:  # scipy tells of numbers that are not finite by a ValueError
        said = (
            f"WARNING: {what} ended with an error ({type(error).__name__}: {error}). It is left out; all else stands."
        )
        return replace(diagnosis, advice=(*diagnosis.advice, said))


def _with_disagreements(comparison: ModelComparison, split: Split, diagnosis: Diagnosis) -> Diagnosis:
    disagreeing = disagreements(comparison, () if split.are_ends else split.kept_back)
    return replace(diagnosis, disagreements=disagreeing, advice=(*diagnosis.advice, *on_disagreements(disagreeing)))


def _with_free_forms(
    comparison: ModelComparison,
    split: Split,
    simulation: DiagnosedSimulation,
    settings: Settings,
    data: DataSettings,
    progress: Progress,
    diagnosis: Diagnosis,
) -> Diagnosis:
    if not data.free_form:
        return diagnosis
    progress("looking for a function of one variable in what remains")
    formed = free_forms(free_form_inputs(comparison, split, simulation, settings))
    if formed:
        diagnosis = beside_function(diagnosis, formed[0])
    elif not diagnosis.has_remains:
        return diagnosis
    return replace(diagnosis, free_form=formed, advice=(*diagnosis.advice, on_free_forms(formed)))


def _with_next_experiment(
    comparison: ModelComparison, robot: RobotParameters, data: DataSettings, progress: Progress, diagnosis: Diagnosis
) -> Diagnosis:
    if not (data.next_experiment and _is_unsettled(comparison, diagnosis)):
        return diagnosis
    suggested = next_experiment(comparison, robot, progress)
    advice = (*diagnosis.advice, *on_next_experiment(suggested, comparison, diagnosis.effects))
    return replace(diagnosis, next_experiment=suggested, no_safe_experiment=suggested is None, advice=advice)


def _with_gyro_walk(comparison: ModelComparison, diagnosis: Diagnosis) -> Diagnosis:
    return replace(diagnosis, gyro_bias_walk=gyro_bias_walk(comparison.data, comparison.chosen))


def _with_motor_difference(
    found: Findings,
    episodes: Sequence[Episode],
    simulation: DiagnosedSimulation,
    data: DataSettings,
    diagnosis: Diagnosis,
) -> Diagnosis:
    """By how much one motor is the stronger one, unless nothing shows it, or the simulation knows already."""
    if found.comparison is None or UNEQUAL in simulation.effects:
        return diagnosis
    planar = found.comparison.chosen.fit.model.planar
    uneven = motor_difference(episodes, simulation.robot, planar, data.max_tilt)
    if uneven is None:
        return diagnosis
    return replace(diagnosis, motor_difference=uneven, advice=(*diagnosis.advice, uneven.text))


def free_form_inputs(
    comparison: ModelComparison, split: Split, simulation: DiagnosedSimulation, settings: Settings
) -> FreeFormInputs:
    """What a free form is looked for in: the likeliest set of effects, and the data that it was not fitted to."""
    tolerances = settings.tolerances.for_robot(simulation.robot)
    recordings: Sequence[Recording] = split.kept_back
    kept_back = replace(comparison.data, recordings=recordings)
    planar = planar_parameters(simulation.robot, simulation.effects)
    ends, several_runs = comparison.chosen.fit.model.apart.offsets, are_of_several_runs(comparison.data.recordings)
    return FreeFormInputs(
        comparison.data,
        comparison.chosen,
        always_free(tolerances, planar, len(comparison.data.recordings), several_runs),
        kept_back,
        ends if split.are_ends else log_offsets(tolerances, len(recordings), several_runs),
        float(np.hypot(settings.thresholds.form_error, tolerances.data_sheet)),
    )


def _is_unsettled(comparison: ModelComparison, diagnosis: Diagnosis) -> bool:
    """Whether other data could tell more, and there are sets of effects to tell apart."""
    return len(comparison.rivals) > 1 and is_open(diagnosis.verdict, diagnosis.effects, diagnosis.rivals)


def _upright(these: NamedEpisodes) -> NamedEpisodes:
    """Episodes of a robot that lies, as if it were held upright."""
    return replace(these, episodes=[held_upright(episode) for episode in these.episodes])


def _how_many(split: Split) -> str:
    """What is fitted and what is held out."""
    fitted, kept_back = len(split.fitted), len(split.kept_back)
    if split.are_ends:
        return f"{fitted} recording{'s' * (fitted > 1)}, whose last {'parts are' if fitted > 1 else 'part is'} held out"
    return f"{fitted} recording{'s' * (fitted > 1)} to fit, {kept_back} held out"


def _split(
    measured: NamedEpisodes, tests: NamedEpisodes, robot: RobotParameters, usability: Usability, share: float
) -> Split:
    """The data that models are fitted to, and those that they are not."""
    recordings = read_recordings(measured.episodes, measured.names, robot, usability)
    if not tests.episodes:
        return held_out(recordings, share)
    kept_back = read_recordings(
        tests.episodes, tests.names, robot, replace(usability, min_samples=usability.min_length)
    )
    sensed = np.all([recording.sensed for recording in (*recordings, *kept_back)], axis=0)
    fitted, tested = (tuple(replace(r, sensed=sensed) for r in these) for these in (recordings, kept_back))
    check_signals((*fitted, *tested), usability.needs_tilt)
    return Split(fitted, tested, tuple(recording.name for recording in kept_back), are_ends=False)


def _diagnosis(
    found: Findings, split: Split, simulation: DiagnosedSimulation, settings: Settings, data: DataSettings
) -> Diagnosis:
    """What was found, with the gap that it closes on held-out data."""
    nominal, refitted = (
        _seen_by(model, split, simulation.robot, settings) for model in (found.nominal, found.refitted)
    )
    named = refitted
    if found.named is not found.refitted:
        named = _seen_by(found.named, split, simulation.robot, settings)
    period = simulation.robot.control_period
    horizons = sorted({max(1, round(horizon / period)) for horizon in data.horizons})
    physics_steps = substeps(period, simulation.physics_step)
    stretches = RolloutStarts(round(_SETTLED / period), _SPACING, data.starts, horizons[-1], physics_steps)
    engine = partial(replayed, simulation)
    gaps = measure_gaps(
        Models(nominal, refitted, named, found.drawn),
        split.kept_back,
        engine,
        horizons,
        stretches,
        np.array([found.noise.get(name, 0.0) for name in MEASURED]),
        simulation.robot.wheel_radius,
    )
    head = headline(gaps)

    errors = {
        name: rollout_error(
            _seen_by(without, split, simulation.robot, settings), split.kept_back, engine, head, stretches
        )
        for name, without in found.without.items()
        if head is not None
    }
    return Diagnosis(
        verdict=found.verdict,
        effects=widened(with_shares(found.effects, head, errors), head),
        remaining=remaining_of(found, split.fitted, head, data.bins),
        added=found.added,
        data_sheet=found.data_sheet,
        data_sheet_class=found.data_sheet_class,
        rivals=found.rivals,
        where=disagreement(found.named, split.fitted, data.bins, found.nominal_errors),
        gap=gaps,
        held_out=split.names,
        autocorrelation=found.autocorrelation,
        noise=found.noise,
        advice=found.advice,
        power=found.power,
        null_score=found.null_score,
    )


def _reviewed(diagnosis: Diagnosis, found: Findings) -> tuple[Diagnosis, Findings]:
    """Where rollouts on held-out data contradict the fit, they have the last word on the verdict.

    What is named in the findings then falls back to the data sheet refitted.
    """
    head = diagnosis.headline
    if head is None and found.verdict in (Verdict.NAMED, Verdict.DATA_SHEET, Verdict.NONE):
        return replace(diagnosis, advice=(UNCONFIRMED, *diagnosis.advice)), found
    verdict, contradiction = review(found.verdict, found.added, head)
    if not contradiction:
        return diagnosis, found
    kept = diagnosis.advice if found.verdict in (Verdict.NONE, Verdict.UNKNOWN) else ()
    advice = tuple(dict.fromkeys((UNEXPLAINED, contradiction, *(said for said in kept if said != OUTWEIGHED))))
    effects = contradicted(diagnosis.effects, contradiction) if found.added else diagnosis.effects
    shifts = found.refitted_data_sheet
    diagnosis = replace(
        diagnosis, verdict=verdict, effects=effects, data_sheet=shifts, data_sheet_class=(), advice=advice
    )
    if found.added:
        left = head.left_by_refit if head else None
        diagnosis = replace(diagnosis, contradicted=True, remaining=diagnosis.remaining._replace(share=left))
    return diagnosis, replace(found, named=found.refitted, added=(), effects=effects, drawn=())


def _seen_by(filtered: FilterResult, split: Split, robot: RobotParameters, settings: Settings) -> FilterResult:
    """What a fitted model makes of what was kept back; other recordings have offsets of the tilt of their own."""
    recordings: Sequence[Recording] = split.kept_back
    free = log_offsets(settings.tolerances, len(recordings), several_runs=False)  # nothing else is fitted to them
    offsets = filtered.offsets if split.are_ends else free
    return filter_recordings(
        robot, filtered.effects, filtered.noise, filtered.angle_lead, recordings, settings.substeps, offsets
    )
