"""How the functions of the library find their settings: those that the commands have, which conf/ defines."""

from collections.abc import Sequence

from twbal.algorithm.setup import Setup
from twbal.cli.commands import text
from twbal.cli.composed import composed
from twbal.cli.diagnosis_config import composed_diagnosis
from twbal.cli.setup_config import setup_of
from twbal.core.robot_parameters import RobotParameters
from twbal.core.robot_sheet import VALUES, provenance_by_factor


def setup(robot: str | RobotParameters = "paper", overrides: Sequence[str] = ()) -> Setup:
    """The set-up of `twbal iterate` with these words.

    Args:
        robot: name of a packaged robot, or parameters.
        overrides: such as `["updates=2", "method=pilco"]`; see docs/settings.md.

    Raises:
        ConfigError: an override that there is not, or a value that cannot be right.

    >>> import twbal
    >>> setup = twbal.setup("regbot", ["sim=regbot", "updates=2"])
    >>> setup.algorithm.updates, setup.search.robot.torque_limit
    (2, 0.49)
    """
    words = words_for(robot, overrides)
    return setup_of(composed("iterate", words), composed_diagnosis())


def words_for(robot: str | RobotParameters, overrides: Sequence[str]) -> list[str]:
    """Overrides that choose a robot, before others."""
    if isinstance(robot, str):
        return [f"robot={robot}", *overrides]
    values = [f"robot.{value}={text(getattr(robot, value))}" for value in ("name", *VALUES)]
    provenance = {str(kind): names for kind, names in provenance_by_factor(robot.tolerance_factors).items()}
    return [*values, "~robot.provenance", f"+robot.provenance={text(provenance)}", *overrides]
