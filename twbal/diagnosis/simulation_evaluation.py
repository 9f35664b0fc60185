"""How well given simulations predict logs of a robot, nothing refitted."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from twbal.core.errors import ConfigError
from twbal.core.robot_model import UNBOUNDED
from twbal.core.robot_parameters import RobotParameters
from twbal.core.streams import Stream, generator
from twbal.diagnosis.error_comparison import compare
from twbal.diagnosis.evaluated_log import ReadLog, read_log
from twbal.diagnosis.evaluation_inputs import EvaluationSettings, GivenLog, GivenSimulation
from twbal.diagnosis.evaluation_record import (
    ALL_LOGS,
    EvaluatedLog,
    EvaluatedSimulation,
    PredictionScore,
    SimulationEvaluation,
)
from twbal.diagnosis.filter_result import with_offsets
from twbal.diagnosis.log_names import distinct_names
from twbal.diagnosis.prediction_errors import PredictionErrors, prediction_errors
from twbal.planar.constants import Constants, constants
from twbal.planar.parameters import PlanarParameters, planar_parameters
from twbal.sysid.model import FreeParameter, LogOffset, Model
from twbal.sysid.recording import MEASURED

Progress = Callable[[str], None]
"""Is told what is being done, a line at a time."""


def evaluate_simulations(
    simulations: Sequence[GivenSimulation],
    logs: Sequence[GivenLog],
    robot: RobotParameters,
    settings: EvaluationSettings,
    progress: Progress = lambda line: None,
) -> SimulationEvaluation:
    """Predict logs by simulations from many instants on, and compare them with the first of the simulations.

    Args:
        simulations: at least one, the first is the reference.
        logs: at least one, all of one robot.
        robot: its nominal parameters.
        settings: how predictions are made and compared.
        progress: is told what is being done.

    Raises:
        DataError: a log is of another robot, of another control period or too short; the message says which.
        ConfigError: the planar model cannot be such a simulation.
    """
    planar_models = [_planar_model(simulation, robot, settings.substeps) for simulation in simulations]
    read = [read_log(log, robot, settings) for log in logs]
    found: list[list[PredictionErrors]] = []  # by simulation, by log
    for simulation, planar in zip(simulations, planar_models, strict=True):
        progress(f"{simulation.name}: predictions of {len(logs)} log{'s' if len(logs) > 1 else ''}")
        found.append([_errors(planar, each, settings, k) for k, each in enumerate(read)])
    pools = [(log.name, [k]) for k, log in enumerate(logs)]
    if len(logs) > 1:
        pools.append((ALL_LOGS, list(range(len(logs)))))
    scores: list[PredictionScore] = []
    for name, chosen in pools:
        is_own = [any(logs[k].sha256 in simulation.found_on for k in chosen) for simulation in simulations]
        of_pool = [[errors[k] for k in chosen] for errors in found]
        names = [simulation.name for simulation in simulations]
        scores += _scores(name, names, is_own, of_pool, [read[k] for k in chosen], settings.seed)
    return SimulationEvaluation(
        robot.name,
        simulations[0].name,
        tuple(_evaluated(simulation, logs) for simulation in simulations),
        tuple(_log(log, each) for log, each in zip(logs, read, strict=True)),
        tuple(scores),
    )


def _planar_model(simulation: GivenSimulation, robot: RobotParameters, substeps: int) -> PlanarParameters:
    """The planar model of a simulation."""
    where = f"Simulation {simulation.name} ({simulation.source})"
    try:
        planar = planar_parameters(robot, simulation.effects)
    except ConfigError as error:
        raise ConfigError(f"{where}: {error}") from error
    k: Constants = constants(planar, robot.control_period / substeps)
    if k.play.gap > 0.0 and k.grip < UNBOUNDED:
        raise ConfigError(
            f"{where} has backlash, and wheels that slip; the planar model takes one of the two at most. Leave one of "
            "the effects out, or the simulation."
        )
    return planar


def _errors(planar: PlanarParameters, read: ReadLog, settings: EvaluationSettings, log: int) -> PredictionErrors:
    """The errors on a log, of whose noise floor the draws are the same for all simulations."""
    model = Model(planar, 0.0, read.noise)
    sd = settings.tilt_offset
    if sd > 0.0:
        tilt = FreeParameter(LogOffset(0, "tilt"), -10 * sd, 10 * sd, 0.0, sd, 1e-5 * sd)
        model = with_offsets(read.data, model, [tilt])
    return prediction_errors(read.data, model, read.plan, generator(Stream.SENSOR_NOISE, settings.seed, log))


def _scores(
    pool: str,
    names: Sequence[str],
    is_own: Sequence[bool],
    found: Sequence[Sequence[PredictionErrors]],
    read: Sequence[ReadLog],
    seed: int,
) -> Iterator[PredictionScore]:
    """Scores on some logs together.

    Args:
        pool: name of these logs.
        names: of the simulations.
        is_own: whether each was found on one of the logs.
        found: errors, by simulation and log.
        read: the logs.
        seed: of the bootstrap.
    """
    sensed = np.all([each.data.sensed for each in read], axis=0)
    for i in np.flatnonzero(sensed):
        for h, steps in enumerate(read[0].plan.horizons):
            errors = [np.column_stack([of[k].errors[:, h, i] for of in found]) for k in range(len(read))]  # (n, S)
            floors = [[float(part.noise_floor[h, i]) for part in of] for of in found]
            beside = compare([e**2 for e in errors], floors, [int(each.blocks[h]) for each in read], seed)
            for s, (name, own) in enumerate(zip(names, is_own, strict=True)):
                fell = np.concatenate([part.fell[:, h] for part in found[s]])
                diverged = int(sum(np.sum(~np.isfinite(e[:, s])) for e in errors))
                horizon = round(float(steps) * read[0].data.period, 9)
                yield PredictionScore(
                    name, pool, MEASURED[i], horizon, len(fell), *beside[s], float(np.mean(fell)), diverged, own
                )


def _evaluated(simulation: GivenSimulation, logs: Sequence[GivenLog]) -> EvaluatedSimulation:
    here = {log.sha256: log.name for log in logs if log.sha256}
    elsewhere = {sha256: Path(path) for sha256, path in simulation.found_on.items() if sha256 not in here}
    names = here | dict(zip(elsewhere, distinct_names(list(elsewhere.values()), here.values()), strict=True))
    found_on = tuple(names[sha256] for sha256 in simulation.found_on)
    return EvaluatedSimulation(simulation.name, simulation.source, simulation.effects, found_on, simulation.note)


def _log(log: GivenLog, read: ReadLog) -> EvaluatedLog:
    recording = read.recording
    noise = {name: float(read.noise.sensors[i]) for i, name in enumerate(MEASURED) if recording.sensed[i]}
    seconds = len(recording) * recording.period
    return EvaluatedLog(log.name, log.source, seconds, len(read.plan.starts), noise, float(read.noise.torques[0]))
