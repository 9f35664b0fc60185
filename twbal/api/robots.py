"""Robots by name or by their sheets: their nominal parameters, and the way to one that can be driven."""

from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path

from twbal.algorithm.collection import end_if_read_again
from twbal.api.real_robots import heed_last_check
from twbal.api.sheets import RobotLike, check_overrides, is_packaged, sheet_of, words_for, words_of_sheet
from twbal.cli.composed import built, composed
from twbal.cli.robot_link import with_own_sheet
from twbal.core.errors import ConfigError
from twbal.core.robot_parameters import RobotParameters
from twbal.link.serial_plant import SerialPlant


def robot(name: str | Path = "paper") -> RobotParameters:
    """The nominal parameters of a robot, in SI units.

    Args:
        name: of a packaged robot (conf/robot/), or the path of a sheet, such as `twbal new-robot` writes.

    Raises:
        ConfigError: there is no such robot, and the message has the names; or the sheet cannot be used.

    >>> import twbal
    >>> twbal.robot("regbot").wheel_radius  # m
    0.03
    >>> twbal.robot("data/ev3/robot/ev3.yaml").wheel_radius
    0.028
    >>> from dataclasses import replace
    >>> heavier = replace(twbal.robot(), body_mass=12.0)  # kg
    """
    return sheet_of(name)


def connect(
    port: str | Path | None = None,
    robot: RobotLike = "paper",
    overrides: Sequence[str] = (),
    *,
    heed_check: bool = True,
) -> AbstractContextManager[SerialPlant]:
    """A robot to drive, for the length of a `with` block; its motors stop on every way out.

    A robot on a port is refused where `twbal real-rollout` refuses it: its last `twbal check-link` found something
    wrong, or the robot or its sheet has changed since then.

    Args:
        port: such as `/dev/ttyUSB0`, `socket://host:port` or `rfc2217://host:port`; None starts a virtual robot, which
            has effects that its nominal parameters leave out.
        robot: name of a packaged robot, path of a sheet, or nominal parameters.
        overrides: of the settings of the link, such as `["link.seed=3"]`: which virtual robot.
        heed_check: False drives a robot on a port whatever its last check says.

    Raises:
        ConfigError: there is no such robot or setting.
        LinkError: the robot cannot be reached.
        CheckError: the last check of its link speaks against arming it.

    Warns:
        UserWarning: a robot on a port was never checked, or its signs were not tried by hand.

    >>> import twbal
    >>> with twbal.connect() as plant:
    ...     plant.control_period  # s
    0.02
    """
    end_if_read_again()
    arguments = {"robot": "robot", "heed_check": "heed_check"}
    check_overrides(overrides, arguments if port is None else {**arguments, "link": "port", "link.port": "port"})
    link = ["link=virtual"] if port is None else ["link=serial", f"link.port={str(port)!r}"]
    cfg = composed("real-rollout", ["policy=random", *words_for(robot, link), *overrides])
    if not is_packaged(robot):
        cfg = with_own_sheet(cfg, words_of_sheet(sheet_of(robot)))
    if cfg.link.get("on_board"):
        raise ConfigError(
            "link.on_board=true drives by whatever policy the board holds, and here nothing compares that with yours: "
            "use the command `twbal real-rollout` with it."
        )
    plant = built(cfg, "link")
    assert isinstance(plant, AbstractContextManager)
    if port is not None and heed_check:
        sheet = built(cfg, "robot")
        assert isinstance(plant, SerialPlant) and isinstance(sheet, RobotParameters)
        heed_last_check(plant, sheet, robot)
    return plant
