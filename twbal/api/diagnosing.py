"""The diagnosis as a function."""

from collections.abc import Callable, Sequence

from twbal.api.arguments import check_progress
from twbal.api.files import GivenEpisode, GivenEpisodes, episodes_in, warn_of_duplicates
from twbal.api.sheets import RobotLike, check_overrides, words_for
from twbal.cli.composed import translating
from twbal.cli.diagnosis_config import composed_diagnosis, diagnosis_of
from twbal.cli.signals import interruptible
from twbal.core.threads import one_thread
from twbal.diagnosis.inputs import NamedEpisodes
from twbal.diagnosis.pipeline import DiagnosisResult, diagnose_episodes


@interruptible()
@one_thread
def diagnose(
    episodes: GivenEpisodes,
    robot: RobotLike = "paper",
    overrides: Sequence[str] = (),
    *,
    test_episodes: GivenEpisodes = (),
    progress: Callable[[str], None] = lambda line: None,
) -> DiagnosisResult:
    """Name what the simulation of a robot lacks to explain measured episodes, with sizes and 95 % intervals.

    Args:
        episodes: measured, of one robot, or paths as `twbal.read_episodes` takes them; best of one that balances and is
            shaken (`experiment=excite`).
        robot: name of a packaged robot, path of a sheet, or nominal parameters.
        overrides: settings of `twbal diagnose`, as on its command line: `["diagnosis=real_logs", "sim=regbot"]`.
        test_episodes: that nothing is fitted to, and the gap is measured on; without, a share of `episodes`.
        progress: is told what is being done, a line at a time; `print` shows it.

    Raises:
        LogError: a log is not there, or cannot be read.
        DataError: the episodes cannot be used; the message says why and what to try.
        ConfigError: a setting cannot be right.

    Warns:
        UserWarning: two episodes are the same recording.

    On logged data of a simulated robot with dry friction in its joints:

    >>> import twbal
    >>> episodes = twbal.read_episodes("data/regression/excited")
    >>> result = twbal.diagnose(episodes, overrides=["starts=4"])
    >>> [effect.name for effect in result.diagnosis.named_effects]
    ['coulomb_friction']
    >>> result.diagnosis.effects[0].probability > 0.5
    True
    """
    check_progress(progress)
    check_overrides(overrides, {"episodes": "episodes", "test_episodes": "test_episodes"})
    measured, tests = episodes_in("episode", episodes), episodes_in("test episode", test_episodes)
    warn_of_duplicates([*measured, *tests])
    cfg = composed_diagnosis(words_for(robot, overrides))
    with translating("diagnose"):
        simulation, settings, data = diagnosis_of(cfg)
    return diagnose_episodes(_named(measured), _named(tests), simulation, settings, data, progress)


def _named(given: Sequence[GivenEpisode]) -> NamedEpisodes:
    return NamedEpisodes([each.episode for each in given], [each.name for each in given])
