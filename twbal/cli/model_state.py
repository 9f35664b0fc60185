"""Whether models fit the settings: their state and robot, and the kernel that they are to have."""

from pathlib import Path

from hydra.utils import instantiate
from omegaconf import DictConfig

from twbal.core.channels import Channels
from twbal.core.errors import ConfigError
from twbal.models.dynamics import DynamicsModel
from twbal.models.gp import SQUARED_EXPONENTIAL
from twbal.search.transition import check_kernel


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


def check_kernel_of(cfg: DictConfig) -> None:
    """Raise ConfigError where there is no such kernel, or no search on models with it, before any work is done.

    Args:
        cfg: of `iterate`.
    """
    kernel = str(cfg.model.kernel)
    if kernel == SQUARED_EXPONENTIAL:
        return
    from twbal.models.kernels.expression import build  # here, as GPyTorch takes a while to import

    channels = instantiate(cfg.state)
    build(kernel, len(channels.inputs), len(channels.measured))
    if not cfg.search.particles:
        check_kernel(kernel)


def _in_words(channels: Channels) -> str:
    return (
        f"{', '.join(channels.names)} of a robot with a wheel radius of {channels.wheel_radius:g} m and a control "
        f"period of {channels.control_period:g} s"
    )
