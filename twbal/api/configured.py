"""How the functions of the library find their settings: those that the commands have, which conf/ defines."""

from collections.abc import Sequence

from twbal.algorithm.setup import Setup
from twbal.api.sheets import RobotLike, words_for
from twbal.cli.composed import composed, translating
from twbal.cli.diagnosis_config import composed_diagnosis
from twbal.cli.setup_config import setup_of
from twbal.core.threads import one_thread


@one_thread
def setup(robot: RobotLike = "paper", overrides: Sequence[str] = ()) -> Setup:
    """The set-up of `twbal iterate` with these words.

    Args:
        robot: name of a packaged robot, path of a sheet, or nominal parameters.
        overrides: such as `["updates=2", "method=pilco"]`; see docs/settings.md.

    Raises:
        ConfigError: there is no such robot or override, or a value cannot be right.
        CheckpointError: a policy of the settings cannot be read.

    >>> import twbal
    >>> setup = twbal.setup("regbot", ["sim=regbot", "updates=2"])
    >>> setup.algorithm.updates, setup.search.robot.torque_limit
    (2, 0.49)
    """
    words = words_for(robot, overrides)
    cfg, diagnose = composed("iterate", words), composed_diagnosis()
    with translating("iterate"):
        return setup_of(cfg, diagnose)
