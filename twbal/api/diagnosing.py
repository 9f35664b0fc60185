"""The diagnosis as a function."""

from collections.abc import Callable, Sequence

from twbal.api.configured import words_for
from twbal.cli.diagnosis_config import composed_diagnosis, diagnosis_of
from twbal.core.episode import Episode
from twbal.core.robot_parameters import RobotParameters
from twbal.diagnosis.inputs import Named
from twbal.diagnosis.pipeline import DiagnosisResult, diagnose_episodes


def diagnose(
    episodes: Sequence[Episode],
    robot: str | RobotParameters = "paper",
    overrides: Sequence[str] = (),
    *,
    test_episodes: Sequence[Episode] = (),
    progress: Callable[[str], None] = lambda line: None,
) -> DiagnosisResult:
    """Name what the simulation of a robot lacks to explain measured episodes, with sizes and 95 % intervals.

    Args:
        episodes: measured, of one robot; best of one that balances and is shaken (`experiment=excite`).
        robot: name of a packaged robot, or its nominal parameters.
        overrides: settings of `twbal diagnose`, as on its command line: `["diagnosis=real_logs", "sim=regbot"]`.
        test_episodes: that nothing is fitted to, and the gap is measured on; without, a share of `episodes`.
        progress: is told what is being done, a line at a time; `print` shows it.

    Raises:
        DataError: the episodes cannot be used; the message says why and what to try.
        ConfigError: a setting cannot be right.

    On logged data of a simulated robot with dry friction in its joints:

    >>> import twbal
    >>> episodes = twbal.read_episodes("data/regression/excited")
    >>> result = twbal.diagnose(episodes, overrides=["starts=4"])
    >>> [effect.name for effect in result.diagnosis.named_effects]
    ['coulomb_friction']
    >>> result.diagnosis.effects[0].probability > 0.5
    True
    """
    simulation, settings, data = diagnosis_of(composed_diagnosis(words_for(robot, overrides)))
    measured, tests = (
        Named(episodes, _names("episode", episodes)),
        Named(test_episodes, _names("test episode", test_episodes)),
    )
    return diagnose_episodes(measured, tests, simulation, settings, data, progress)


def _names(what: str, episodes: Sequence[Episode]) -> list[str]:
    return [f"{what} {number}" for number in range(len(episodes))]
