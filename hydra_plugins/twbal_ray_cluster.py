"""The launcher `hydra/launcher=ray_cluster`, where Hydra looks for plug-ins: in this namespace package."""

from dataclasses import dataclass

from hydra.core.config_store import ConfigStore

from twbal.cli import ray_launcher


class RayClusterLauncher(ray_launcher.RayJobs):
    """See there."""


@dataclass
class RayClusterConfig:
    """Settings of the launcher, as its arguments."""

    _target_: str = f"{__name__}.{RayClusterLauncher.__name__}"
    address: str = "auto"
    num_cpus: float = 1.0
    max_retries: int = 10


ConfigStore.instance().store(group="hydra/launcher", name="ray_cluster", node=RayClusterConfig, provider="twbal")
