"""`twbal virtual-robot`: a robot with hidden faults behind a port."""

from hydra.utils import instantiate
from omegaconf import DictConfig

from twbal.errors import ConfigError
from twbal.link.protocol import Clock
from twbal.sim.plant import SimPlant
from twbal.virtual_robot.firmware import Identity
from twbal.virtual_robot.hidden import draw_hidden
from twbal.virtual_robot.server import serve


def main(cfg: DictConfig) -> None:
    """Serve one virtual robot until nobody needs it any more."""
    robot = instantiate(cfg.robot)
    plant = SimPlant(
        robot=robot,
        effects=draw_hidden(instantiate(cfg.hidden), robot, cfg.seed),
        start=instantiate(cfg.start),
        physics_step=cfg.physics_step,
        seed=cfg.seed,
    )
    identity = Identity(
        name=robot.name,
        torque_limit=robot.torque_limit,
        tilt_limit=cfg.tilt_limit,
        watchdog=cfg.watchdog,
        clock=_clock(cfg.clock),
    )
    serve(plant, identity, cfg.idle_timeout)


def _clock(name: str) -> Clock:
    try:
        return Clock[name.upper()]
    except KeyError:
        raise ConfigError(
            f"Unknown clock {name!r}; the clocks are: {', '.join(c.name.lower() for c in Clock)}."
        ) from None
