"""The evaluation of simulations as a function."""

from collections.abc import Callable, Mapping, Sequence

from twbal.api.configured import words_for
from twbal.cli.commands import text
from twbal.cli.evaluation_config import composed_evaluation
from twbal.core.episode import Episode
from twbal.core.robot_parameters import RobotParameters
from twbal.diagnosis.evaluation import evaluate_simulations
from twbal.diagnosis.evaluation_inputs import GivenLog
from twbal.diagnosis.evaluation_record import SimulationEvaluation


def evaluate_simulation(
    simulations: Mapping[str, str],
    episodes: Sequence[Episode],
    robot: str | RobotParameters = "paper",
    overrides: Sequence[str] = (),
    *,
    progress: Callable[[str], None] = lambda line: None,
) -> SimulationEvaluation:
    """How well simulations predict measured episodes, nothing refitted, beside the nominal one.

    Args:
        simulations: by name, files such as the `augmented.yaml` of a diagnosis, or choices such as `regbot`.
        episodes: measured, of one robot.
        robot: name of a packaged robot, or its nominal parameters.
        overrides: settings of `twbal evaluate-sim`, as on its command line: `["sim=regbot", "horizons=[0.1,0.2]"]`.
        progress: is told what is being done, a line at a time; `print` shows it.

    Raises:
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
    words = [*words_for(robot, overrides), f"sims={text(dict(simulations))}"]
    given, parameters, settings = composed_evaluation(words)
    logs = [GivenLog(f"episode {k}", "in memory", "", episode) for k, episode in enumerate(episodes)]
    return evaluate_simulations(given, logs, parameters, settings, progress)
