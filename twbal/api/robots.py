"""Robots by name: their nominal parameters, and the way to one that can be driven."""

from collections.abc import Sequence
from contextlib import AbstractContextManager

from twbal.cli.composed import built, composed
from twbal.core.robot_parameters import RobotParameters
from twbal.link.serial_plant import SerialPlant


def robot(name: str = "paper") -> RobotParameters:
    """The nominal parameters of a packaged robot (conf/robot/), in SI units.

    Raises:
        ConfigError: there is no such robot; the message has the names.

    >>> import twbal
    >>> twbal.robot("regbot").wheel_radius  # m
    0.03
    >>> from dataclasses import replace
    >>> heavier = replace(twbal.robot(), body_mass=12.0)  # kg
    """
    parameters = built(composed("lqr", [f"robot={name}"]), "robot")
    assert isinstance(parameters, RobotParameters)
    return parameters


def connect(
    port: str | None = None, robot: str = "paper", overrides: Sequence[str] = ()
) -> AbstractContextManager[SerialPlant]:
    """A robot to drive, for the length of a `with` block; its motors stop on every way out.

    Args:
        port: such as `/dev/ttyUSB0`, `socket://host:port` or `rfc2217://host:port`; None starts a virtual robot, which
            has effects that its nominal parameters leave out.
        robot: name of the packaged robot.
        overrides: of the settings of the link, such as `["link.seed=3"]`: which virtual robot.

    Raises:
        LinkError: the robot cannot be reached.

    >>> import twbal
    >>> with twbal.connect() as plant:
    ...     plant.control_period  # s
    0.02
    """
    link = ["link=virtual"] if port is None else ["link=serial", f"link.port={port!r}"]
    plant = built(composed("real-rollout", ["policy=random", f"robot={robot}", *link, *overrides]), "link")
    assert isinstance(plant, AbstractContextManager)
    return plant
