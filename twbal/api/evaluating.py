"""The evaluation of simulations as a function."""

from collections.abc import Callable, Mapping, Sequence

from twbal.api.arguments import check_progress
from twbal.api.files import GivenEpisodes, episodes_in
from twbal.api.sheets import RobotLike, check_overrides, words_for
from twbal.cli.commands import text
from twbal.cli.evaluation_config import composed_evaluation
from twbal.cli.signals import interruptible
from twbal.core.errors import ConfigError
from twbal.diagnosis.evaluation_inputs import GivenLog
from twbal.diagnosis.evaluation_record import SimulationEvaluation
from twbal.diagnosis.simulation_evaluation import evaluate_simulations


@interruptible()
def evaluate_simulation(
    simulations: Mapping[str, str],
    episodes: GivenEpisodes,
    robot: RobotLike = "paper",
    overrides: Sequence[str] = (),
    *,
    progress: Callable[[str], None] = lambda line: None,
) -> SimulationEvaluation:
    """How well simulations predict measured episodes, nothing refitted, beside the nominal one.

    Args:
        simulations: by name, files such as the `augmented.yaml` of a diagnosis, or choices such as `regbot`.
        episodes: measured, of one robot, or paths as `twbal.read_episodes` takes them.
        robot: name of a packaged robot, path of a sheet, or nominal parameters.
        overrides: settings of `twbal evaluate-sim`, as on its command line: `["sim=regbot", "horizons=[0.1,0.2]"]`.
        progress: is told what is being done, a line at a time; `print` shows it.

    Raises:
        LogError: a log is not there, or cannot be read.
        DataError: an episode is of another robot or too short; the message says which and what to try.
        ConfigError: a simulation or a setting cannot be right.

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
    names, measured = episodes_in("episode", episodes)
    sims = {name: str(each) for name, each in simulations.items()}
    words = [*words_for(robot, overrides), f"sims={text(sims or None)}"]
    given, parameters, settings = composed_evaluation(words)
    logs = [GivenLog(name, "in memory", "", episode) for name, episode in zip(names, measured, strict=True)]
    return evaluate_simulations(given, logs, parameters, settings, progress)
