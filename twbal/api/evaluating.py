"""The evaluation of simulations as a function."""

import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import count
from math import isclose

from twbal.api.arguments import check_progress
from twbal.api.files import GivenEpisodes, episodes_in, warn_of_duplicates
from twbal.api.sheets import RobotLike, check_overrides, words_for
from twbal.cli.commands import text
from twbal.cli.evaluation_config import composed_evaluation
from twbal.cli.signals import interruptible
from twbal.core.errors import ConfigError, DataError
from twbal.core.threads import one_thread
from twbal.diagnosis.evaluation_inputs import GivenLog, GivenSimulation
from twbal.diagnosis.evaluation_record import ALL_LOGS, CHANNEL_UNITS, PredictionScore, SimulationEvaluation
from twbal.diagnosis.simulation_evaluation import evaluate_simulations

_PLAIN = re.compile(r"[A-Za-z_][A-Za-z0-9_-]*")
_NO_NAMES = ("null", "true", "false", "nan", "inf")  # which an override takes for other values


class CheckedEvaluation(SimulationEvaluation):
    """An evaluation whose scores are asked for by names that a person writes."""

    def score(self, simulation: str, log: str, channel: str, horizon: float) -> PredictionScore | None:
        """One of the scores; None where the log does not have the channel.

        Args:
            simulation: name of one.
            log: name of one, or `all logs`: of a single log that is the log itself.
            channel: measured channel.
            horizon: one of those that predictions were scored at [s].

        Raises:
            ConfigError: there is no such simulation, log, channel or horizon.
        """
        horizons = list(dict.fromkeys(score.horizon for score in self.scores))
        of_log = self.columns[-1] if log == ALL_LOGS else log
        of_horizon = next((each for each in horizons if isclose(each, horizon, abs_tol=1e-9)), horizon)
        _check_known("simulation", simulation, [each.name for each in self.simulations])
        _check_known("log", of_log, self.columns)
        _check_known("channel", channel, list(CHANNEL_UNITS))
        _check_known("horizon", of_horizon, horizons)
        return super().score(simulation, of_log, channel, of_horizon)


def _check_known(what: str, name: str | float, known: Sequence[str] | Sequence[float]) -> None:
    """Raise ConfigError where a name, or a horizon, is none of those that there are."""
    if name not in known:
        raise ConfigError(f"The evaluation has no {what} {name!r}. It has: {', '.join(map(str, known))}.")


@interruptible()
@one_thread
def evaluate_simulation(
    simulations: Mapping[str, str],
    episodes: GivenEpisodes,
    robot: RobotLike = "paper",
    overrides: Sequence[str] = (),
    *,
    progress: Callable[[str], None] = lambda line: None,
) -> CheckedEvaluation:
    """How well simulations predict measured episodes, nothing refitted, beside the nominal one.

    `score(simulation, log, channel, horizon)` of the result is one of its numbers; a name that the result does not have
    is a ConfigError.

    Args:
        simulations: by name, files such as the `augmented.yaml` of a diagnosis, or choices such as `regbot`.
        episodes: measured, of one robot, or paths as `twbal.read_episodes` takes them.
        robot: name of a packaged robot, path of a sheet, or nominal parameters.
        overrides: settings of `twbal evaluate-sim`, as on its command line: `["sim=regbot", "horizons=[0.1,0.2]"]`.
        progress: is told what is being done, a line at a time; `print` shows it.

    Raises:
        LogError: a log is not there, or cannot be read.
        DataError: there is no episode, or one is of another robot or too short; the message says which and what to
            try.
        ConfigError: a simulation or a setting cannot be right.

    Warns:
        UserWarning: two episodes are the same recording.

    On logged data of a simulated robot with dry friction in its joints:

    >>> import tempfile, twbal
    >>> from pathlib import Path
    >>> episodes = twbal.read_episodes("data/regression/excited")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder) / "friction.yaml"
    ...     _ = file.write_text("effects: {coulomb_friction: {torque: 0.4}}")
    ...     found = twbal.evaluate_simulation({"friction": str(file)}, episodes, overrides=["horizons=[0.15]"])
    >>> found.score("friction", "all logs", "tilt", 0.16).is_better
    True
    """
    check_progress(progress)
    check_overrides(overrides, {"episodes": "episodes", "sims": "simulations"})
    if not isinstance(simulations, Mapping):
        raise ConfigError(
            "simulations must be files or choices by name, such as {'mine': 'augmented.yaml'}; found "
            f"{simulations!r:.80}."
        )
    measured = episodes_in("episode", episodes)
    if not measured:
        raise DataError("An evaluation needs at least one episode; found none.")
    warn_of_duplicates(measured)
    sims = {str(name): str(each) for name, each in simulations.items()}
    plain = _plain_names(sims)
    words = [*words_for(robot, overrides), f"sims={text({plain[name]: each for name, each in sims.items()} or None)}"]
    composed, parameters, settings = composed_evaluation(words)
    own_names = {internal: name for name, internal in plain.items()}
    given = [_renamed(each, own_names.get(each.name, each.name)) for each in composed]
    logs = [GivenLog(each.name, "in memory", "", each.episode) for each in measured]
    found = evaluate_simulations(_by_own_names(given, sims), logs, parameters, settings, progress)
    return CheckedEvaluation(found.robot, found.reference, found.simulations, found.logs, found.scores)


def _plain_names(names: Collection[str]) -> dict[str, str]:
    """Names that an override can have as keys, by those that a person gave, which may be any text."""
    plain = {name: name for name in names if _PLAIN.fullmatch(name) and name.lower() not in _NO_NAMES}
    others = (free for number in count() if (free := f"simulation_{number}") not in plain)
    return {name: plain.get(name) or next(others) for name in names}


def _renamed(simulation: GivenSimulation, name: str) -> GivenSimulation:
    """The same simulation under a name, which its note has, too."""
    return replace(simulation, name=name, note=simulation.note.replace(simulation.name, name))


def _by_own_names(composed: Sequence[GivenSimulation], names: Iterable[str]) -> list[GivenSimulation]:
    """The reference and all that were named, in order: the command leaves out a name that the reference has, too."""
    reference, *others = composed
    by_name = {each.name: each for each in others}
    named = [by_name.get(name, replace(reference, name=name)) for name in names if name != reference.name]
    return [reference, *named]
