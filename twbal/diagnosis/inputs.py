"""What a diagnosis is given."""

from collections.abc import Sequence
from dataclasses import dataclass

from twbal.core.episode import Episode
from twbal.core.robot_parameters import RobotParameters
from twbal.diagnosis.findings import Effects


@dataclass(frozen=True)
class DataSettings:
    """What is read of the episodes, and how the gap is measured; see conf/stage/diagnose.yaml.

    Attributes:
        horizons: of the rollouts in PyBullet by which the gap is measured [s].
        held_out: share of the data that nothing is fitted to.
        starts: rollouts, spread over the held-out data.
        bins: ranges of speed, command, tilt and time in the map of disagreement.
        min_length: see `Usability`.
        min_samples: see `Usability`.
        max_yaw_rate: see `Usability`.
        max_tilt: see `Usability`.
        next_experiment: whether an experiment is suggested where something stays open.
        free_form: whether a free function of one variable is drawn where something remains.
    """

    horizons: list[float]
    held_out: float
    starts: int
    bins: int
    min_length: int
    min_samples: int
    max_yaw_rate: float
    max_tilt: float
    next_experiment: bool
    free_form: bool


@dataclass(frozen=True)
class DiagnosedSimulation:
    """The simulation that is held against the data.

    Attributes:
        robot: nominal parameters.
        effects: that it has already, by name.
        physics_step: upper bound of that of its integrator [s].
    """

    robot: RobotParameters
    effects: Effects
    physics_step: float


@dataclass(frozen=True)
class NamedEpisodes:
    """Episodes with their names, for reports and errors."""

    episodes: Sequence[Episode]
    names: Sequence[str]
