"""Robots as the functions of the library take them: by name, by the path of a sheet, or as parameters."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from twbal.cli.commands import text
from twbal.cli.composed import built, composed, warn_of
from twbal.cli.robot_file import is_robot_file, robot_in
from twbal.core.errors import ConfigError
from twbal.core.robot_parameters import RobotParameters
from twbal.core.robot_sheet import VALUES, provenance_by_factor
from twbal.sheets.doubts import doubts

RobotLike = str | Path | RobotParameters
"""Name of a packaged robot, path of a yaml sheet, or nominal parameters."""

EXPECTED_ROBOT = (
    "the name of a packaged robot, such as 'paper', the path of a sheet, such as 'my_conf/robot/my_robot.yaml', or "
    "RobotParameters"
)
_POLICY_ENDING = ".pt"


def sheet_of(robot: RobotLike) -> RobotParameters:
    """The nominal parameters of a robot.

    Raises:
        ConfigError: there is no such robot, or its sheet cannot be used.
    """
    check_robot_like(robot)
    if isinstance(robot, RobotParameters):
        return robot
    if not is_packaged(robot):
        found = robot_in(Path(robot))
        warn_of(doubts(found))
        return found
    parameters = built(composed("lqr", [f"robot={robot}"]), "robot")
    assert isinstance(parameters, RobotParameters)
    return parameters


def words_for(robot: RobotLike, overrides: Sequence[str] = ()) -> list[str]:
    """Overrides that choose a robot, before others.

    Raises:
        ConfigError: it is no robot, or the others are no list of texts, or choose a robot, too.
    """
    check_robot_like(robot)
    check_overrides(overrides, {"robot": "robot"})
    if is_packaged(robot):
        return [f"robot={robot}", *overrides]
    return [*words_of_sheet(robot_in(Path(robot)) if isinstance(robot, str | Path) else robot), *overrides]


def is_packaged(robot: RobotLike) -> bool:
    """Whether a robot goes by the name of a packaged one."""
    return isinstance(robot, str) and not is_robot_file(robot)


def words_of_sheet(sheet: RobotParameters) -> list[str]:
    """Overrides that put the values of a sheet in the place of those of the robot that is chosen."""
    values = [f"robot.{value}={text(getattr(sheet, value))}" for value in ("name", *VALUES)]
    provenance = {str(kind): names for kind, names in provenance_by_factor(sheet.tolerance_factors).items()}
    return [*values, "~robot.provenance", f"+robot.provenance={text(provenance)}"]


def check_robot_like(robot: object) -> None:
    """Raise ConfigError where something is no robot."""
    if isinstance(robot, str | Path) and str(robot).endswith(_POLICY_ENDING):
        raise ConfigError(
            f"robot must be {EXPECTED_ROBOT}; found {str(robot)!r}, the file of a policy or a model. Are two "
            "arguments swapped?"
        )
    if not isinstance(robot, str | Path | RobotParameters):
        raise ConfigError(f"robot must be {EXPECTED_ROBOT}; found {robot!r:.80}.")


def check_overrides(overrides: object, arguments: Mapping[str, str]) -> None:
    """Raise ConfigError where something is no list of overrides, or an override says what an argument does.

    Args:
        overrides: that were given.
        arguments: names of the function's arguments, by the keys of settings that say the same.
    """
    if isinstance(overrides, str):
        raise ConfigError(f"overrides must be a list of texts; found the text {overrides!r}. Write [{overrides!r}].")
    if not isinstance(overrides, Sequence):
        raise ConfigError(f"overrides must be a list such as ['updates=2']; found {overrides!r:.80}.")
    for word in overrides:
        if not isinstance(word, str):
            raise ConfigError(f"overrides must be texts such as 'updates=2'; found {word!r:.80} among them.")
        argument = arguments.get(word.lstrip("+~").partition("=")[0])
        if argument is not None:
            raise ConfigError(
                f"overrides must be settings that the function has no argument for; found {word!r:.80}. Give "
                f"{argument}=... to the function in place of it."
            )
