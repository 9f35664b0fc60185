"""What an evaluation of simulations is given."""

from collections.abc import Mapping
from dataclasses import dataclass

from twbal.core.episode import Episode


@dataclass(frozen=True)
class EvaluationSettings:
    """How predictions are made and compared; see conf/evaluate_sim.yaml.

    Attributes:
        horizons: of the predictions [s].
        spacing: from one start to the next, at least [s].
        starts: of a log, at most.
        settling: time that the filter has before the first start [s].
        model_error: standard deviation of the torques that a filter reckons with beside the simulation's, as a share of
            the commands' root mean square.
        tilt_offset: standard deviation of a constant by which the tilt of each log is off, which is estimated for each
            simulation alike [rad]; 0: none.
        substeps: physics steps of a control period.
        blocks: of a log, in the bootstrap, at most.
        min_block: length of a block, at least [s]; twice the horizon where that is more.
        max_yaw_rate: see `Usability`.
        max_tilt: at which a log is cut off, and a simulated body lies [rad].
        seed: of the bootstrap, and of what the noise floor draws.
    """

    horizons: list[float]
    spacing: float
    starts: int
    settling: float
    model_error: float
    tilt_offset: float
    substeps: int
    blocks: int
    min_block: float
    max_yaw_rate: float
    max_tilt: float
    seed: int


@dataclass(frozen=True)
class GivenSimulation:
    """A simulation to evaluate.

    Attributes:
        name: in tables.
        source: its file, or its choice of the group `sim`.
        effects: that it has, by name.
        found_on: path by the sha256 of each log that it was found on.
        note: what the effects have that the source has not, in a sentence; "" where that is nothing.
    """

    name: str
    source: str
    effects: Mapping[str, Mapping[str, float]]
    found_on: Mapping[str, str]
    note: str = ""


@dataclass(frozen=True)
class GivenLog:
    """A log to predict.

    Attributes:
        name: in tables and errors.
        source: its file.
        sha256: of the file; "" where there is none.
        episode: what is in it.
    """

    name: str
    source: str
    sha256: str
    episode: Episode
