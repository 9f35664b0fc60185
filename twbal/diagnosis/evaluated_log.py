"""A log as an evaluation of simulations reads it: its noise, and the instants at which predictions start."""

from typing import NamedTuple

import numpy as np

from twbal.core.errors import DataError
from twbal.core.robot_parameters import RobotParameters
from twbal.diagnosis.evaluation_inputs import EvaluationSettings, GivenLog
from twbal.diagnosis.prediction_errors import Indices, PredictionWindows
from twbal.io.recorded_sheet import is_of_sheet, robot_in_words
from twbal.sysid.model import Data
from twbal.sysid.noise import NoiseModel
from twbal.sysid.open_loop import EARLIEST
from twbal.sysid.recording import Recording, Usability, read_recordings
from twbal.sysid.sensor_noise import sensor_noise


class ReadLog(NamedTuple):
    """A log, ready for predictions.

    Attributes:
        data: the one recording.
        noise: by which the filters of all simulations weigh its measurements.
        plan: where predictions start, and how far they go.
        blocks: (H,) lengths of the blocks of the bootstrap [starts].
    """

    data: Data
    noise: NoiseModel
    plan: PredictionWindows
    blocks: Indices

    @property
    def recording(self) -> Recording:
        """What is predicted."""
        return self.data.recordings[0]


def read_log(log: GivenLog, robot: RobotParameters, settings: EvaluationSettings) -> ReadLog:
    """Read a log.

    Raises:
        DataError: it is of another robot, of another control period or too short.
    """
    if not is_of_sheet(log.episode.provenance, robot.name):
        raise DataError(
            f"Log {log.name} ({log.source}) is of the robot {robot_in_words(log.episode.provenance)}; expected is "
            f"{robot.name!r}. Choose the sheet of the logs by robot=..., with the --config-dir=... in which it lies, "
            "and evaluate each robot by itself."
        )
    (recording,) = read_recordings(
        [log.episode], [log.name], robot, Usability(0, 0, settings.max_yaw_rate, settings.max_tilt)
    )
    horizons = np.array(sorted({max(1, round(horizon / recording.period)) for horizon in settings.horizons}))
    starts = _starts(recording, int(horizons.max()), settings)
    if not len(starts):
        raise DataError(
            f"Log {log.name} is upright for {len(recording) * recording.period:.3g} s; expected are "
            f"{settings.settling:.3g} s for the filter and then {horizons.max() * recording.period:.3g} s for a "
            f"prediction, without turning faster than {settings.max_yaw_rate:.3g} rad/s. Leave the log out, or choose "
            "shorter horizons=[...] or settling=..."
        )
    commands = float(np.sqrt(np.mean(recording.commands**2)))
    noise = NoiseModel(sensor_noise(recording), np.full(2, settings.model_error * commands))
    return ReadLog(
        Data([recording], settings.substeps),
        noise,
        PredictionWindows(starts, horizons, settings.max_tilt),
        _blocks(starts, horizons, recording.period, settings),
    )


def _starts(recording: Recording, ahead: int, settings: EvaluationSettings) -> Indices:
    """Instants at which predictions start, (n,): all the way to their ends the data count."""
    first = max(round(settings.settling / recording.period), EARLIEST)
    last = len(recording) - ahead
    every = max(round(settings.spacing / recording.period), 1, -(-(last - first + 1) // settings.starts))
    found = [t for t in range(first, last + 1, every) if recording.usable[t : t + ahead + 1].all()]
    return np.array(found, dtype=int)


def _blocks(starts: Indices, horizons: Indices, period: float, settings: EvaluationSettings) -> Indices:
    """Lengths of blocks [starts], which are long against how long errors remember: for each horizon (H,)."""
    apart = float(np.median(np.diff(starts))) * period if len(starts) > 1 else settings.spacing
    share = len(starts) * apart / settings.blocks
    seconds = np.maximum(2.0 * horizons * period, max(settings.min_block, share))
    return np.asarray(np.clip(np.round(seconds / apart), 1, len(starts)), dtype=int)
