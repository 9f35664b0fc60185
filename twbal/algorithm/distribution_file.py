"""`robot_distribution.pt`: what is known of the parameters of a robot, as numbers that load without running code."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from twbal.core.errors import CheckpointError, ConfigError
from twbal.core.gaussian import Array
from twbal.core.payload import Payload
from twbal.core.robot_parameters import RobotParameters, parameter_hash
from twbal.io.checkpoint import load_checkpoint, save_checkpoint
from twbal.planar.parameters import parameters_class
from twbal.planar.robot_distribution import RobotDistribution

KIND = "robot distribution"
_SENSORS, _TORQUES = 4, 2
_LARGEST = 1e6  # of any number of a robot, in SI units


def save_distribution(path: Path, known: RobotDistribution) -> str:
    """Write a `robot_distribution.pt`; returns its sha256."""
    return save_checkpoint(path, KIND, to_payload(known))


def load_distribution(path: Path, robot: RobotParameters) -> RobotDistribution:
    """Read a `robot_distribution.pt`.

    Args:
        path: of the file, or of the run folder that has it.
        robot: whose parameters it must be about.

    Raises:
        CheckpointError: it cannot be read, or holds no distribution.
        ConfigError: it is about another robot.
    """
    try:
        return from_payload(load_checkpoint(path, KIND), robot)
    except CheckpointError as error:
        raise CheckpointError(f"The distribution in {path} cannot be used. {error}") from error
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from error


def to_payload(known: RobotDistribution) -> dict[str, Any]:
    """Plain values and arrays from which `from_payload` makes the same distribution."""
    return {
        "robot": known.robot.name,
        "nominal": parameter_hash(known.robot),
        "fields": list(known.fields),
        "mean": known.mean,
        "covariance": known.covariance,
        "low": known.low,
        "high": known.high,
        "sensor_sd": known.sensor_sd,
        "torque_sd": known.torque_sd,
        "filter_rate": np.array(known.filter_rate),
    }


def from_payload(payload: Mapping[str, Any], robot: RobotParameters) -> RobotDistribution:
    """The distribution that `to_payload` described, of a robot with these nominal parameters.

    Raises:
        CheckpointError: an entry is missing, or cannot be one of a distribution.
        ConfigError: it is about another robot.
    """
    found = Payload(KIND, payload)
    if found.text("nominal") != parameter_hash(robot):
        raise ConfigError(
            f"The distribution is one of robot {found.text('robot')[:40]!r} with other nominal parameters than those "
            f"of robot {robot.name!r} here. Run `twbal identify` with this robot=..."
        )
    fields = found.texts("fields")
    unknown = [field for field in fields if field not in parameters_class()._field_defaults]
    if unknown or len(set(fields)) < len(fields):
        raise CheckpointError(
            f"The {KIND} must be of different parameters of the planar model; found {', '.join(fields)[:200]}."
        )
    P = len(fields)
    rate, rate_sd = found.numbers("filter_rate", (2,), 0.0, _LARGEST).tolist()
    known = RobotDistribution(
        robot,
        fields,
        mean=found.numbers("mean", (P,), -_LARGEST, _LARGEST),
        covariance=found.numbers("covariance", (P, P)),
        low=found.numbers("low", (P,), -_LARGEST, _LARGEST),
        high=found.numbers("high", (P,), -_LARGEST, _LARGEST),
        sensor_sd=found.numbers("sensor_sd", (_SENSORS,), 0.0, _LARGEST),
        torque_sd=found.numbers("torque_sd", (_TORQUES,), 0.0, _LARGEST),
        filter_rate=(rate, rate_sd),
    )
    _check(known)
    return known


def _check(known: RobotDistribution) -> None:
    """Raise CheckpointError where the numbers are none of a distribution."""
    if not ((known.low <= known.mean) & (known.mean <= known.high)).all():
        raise CheckpointError(f"The {KIND}'s mean must lie within its bounds. Was the file changed? Make it again.")
    variances = known.covariance.diagonal()
    if not (variances > 0.0).all() or not _is_correlation(known.covariance / np.sqrt(np.outer(variances, variances))):
        raise CheckpointError(
            f"The {KIND}'s covariance must be symmetric and positive definite. Was the file changed? Make it again."
        )


def _is_correlation(found: Array) -> bool:
    symmetric = bool(np.allclose(found, found.T, rtol=0.0, atol=1e-9))
    return symmetric and bool(np.linalg.eigvalsh(found).min() > 0.0)
