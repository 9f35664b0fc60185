"""Whether a model was made with the state and the robot that a stage is configured with."""

from pathlib import Path

from twbal.core.channels import Channels
from twbal.core.errors import ConfigError
from twbal.models.dynamics import DynamicsModel


def check_state(model: DynamicsModel, channels: Channels, path: Path) -> None:
    """Raise ConfigError where a model has another state, or is of a robot with other wheels or another control period.

    Args:
        model: that was read.
        channels: the state that is configured.
        path: of the model's file.
    """
    if model.channels != channels:
        raise ConfigError(
            f"The model in {path} has the state {_in_words(model.channels)}; here it is {_in_words(channels)}. Choose "
            "the state and robot that it was made with by state=... and robot=..."
        )


def _in_words(channels: Channels) -> str:
    return (
        f"{', '.join(channels.names)} of a robot with a wheel radius of {channels.wheel_radius:g} m and a control "
        f"period of {channels.control_period:g} s"
    )
