"""What an evaluation of simulations says: the record that reports draw and that `evaluation.json` keeps."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from twbal.diagnosis.record import HEADLINE

ALL_LOGS = "all logs"
"""Name of the pool of all logs."""
CHANNEL_UNITS = {"tilt": "rad", "tilt_rate": "rad/s", "wheel_angle": "rad", "wheel_rate": "rad/s"}


class Interval(NamedTuple):
    """A 95 % interval of block bootstrap."""

    low95: float
    high95: float


class PredictionScore(NamedTuple):
    """How well one simulation predicts one channel of one log over one horizon.

    Attributes:
        simulation: its name.
        log: its name, or `ALL_LOGS`.
        channel: measured channel.
        horizon: from the start of a prediction [s].
        starts: predictions.
        error: root mean square error [unit of the channel]; None where a prediction is no finite number.
        error95: its interval; None where the log is too short for one.
        ratio: over the error of the reference; None where one of the two is.
        ratio95: its interval, of the same blocks for both.
        noise_floor: error that the sensors' noise alone would make, were the simulation right.
        closed: share of the gap between reference and noise floor that the simulation closes, unclipped: negative where
            it predicts worse than the reference; None where the reference has hardly a gap.
        closed95: its interval, the noise floor being what it is.
        fell: share of the predictions in which the body comes to the tilt limit, where it stays.
        diverged: predictions that are no finite number.
        is_own_data: whether the simulation was found on this log.
    """

    simulation: str
    log: str
    channel: str
    horizon: float
    starts: int
    error: float | None
    error95: Interval | None
    ratio: float | None
    ratio95: Interval | None
    noise_floor: float | None
    closed: float | None
    closed95: Interval | None
    fell: float
    diverged: int
    is_own_data: bool

    @property
    def is_worse(self) -> bool:
        """Whether it predicts worse than the reference, beyond chance; a prediction that diverges does."""
        return self.diverged > 0 or (self.ratio95 is not None and self.ratio95.low95 > 1.0)

    @property
    def is_better(self) -> bool:
        """Whether it predicts better than the reference, beyond chance."""
        return self.ratio95 is not None and self.ratio95.high95 < 1.0


@dataclass(frozen=True)
class EvaluatedSimulation:
    """A simulation that was held against logs.

    Attributes:
        name: in tables.
        source: its file, or its choice of the group `sim`.
        effects: that it has, with their values.
        found_on: logs that it was found on, by name; none where nothing tells.
        note: what its effects have that its source has not, and what predictions do without; "" where that is nothing.
    """

    name: str
    source: str
    effects: Mapping[str, Mapping[str, float]]
    found_on: tuple[str, ...]
    note: str = ""


class EvaluatedLog(NamedTuple):
    """A log that simulations were held against.

    Attributes:
        name: in tables.
        source: its file.
        seconds: that were used [s].
        starts: of predictions.
        noise: standard deviations of the sensors, by channel, as the log alone tells them.
        process_noise: standard deviation of the two torques by which the filter of every simulation distrusts it [N·m].
    """

    name: str
    source: str
    seconds: float
    starts: int
    noise: Mapping[str, float]
    process_noise: float


@dataclass(frozen=True)
class SimulationEvaluation:
    """How well simulations predict logs, nothing refitted.

    Attributes:
        robot: its name.
        reference: name of the simulation that the others are compared with.
        simulations: the reference first.
        logs: in order.
        scores: of each simulation, log, channel and horizon; of several logs together under `ALL_LOGS`.
    """

    robot: str
    reference: str
    simulations: tuple[EvaluatedSimulation, ...]
    logs: tuple[EvaluatedLog, ...]
    scores: tuple[PredictionScore, ...]

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the logs, and of their pool where there are several."""
        names = tuple(log.name for log in self.logs)
        return (*names, ALL_LOGS) if len(names) > 1 else names

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels that all logs have."""
        return tuple(dict.fromkeys(score.channel for score in self.scores if score.log == self.columns[-1]))

    @property
    def headline_horizon(self) -> float:
        """The horizon that stands for all [s]."""
        return min((score.horizon for score in self.scores), key=lambda horizon: abs(horizon - HEADLINE[1]))

    def score(self, simulation: str, log: str, channel: str, horizon: float) -> PredictionScore | None:
        """One of the scores; None where the log does not have the channel."""
        wanted = (simulation, log, channel, horizon)
        return next((s for s in self.scores if (s.simulation, s.log, s.channel, s.horizon) == wanted), None)
