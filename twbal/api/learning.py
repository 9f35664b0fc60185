"""Algorithm 1 as a function."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from twbal.algorithm.collection import end_if_read_again
from twbal.algorithm.in_memory import InMemory
from twbal.algorithm.iteration_findings import findings, summarise
from twbal.algorithm.learning import Algorithm
from twbal.algorithm.setup import Setup
from twbal.algorithm.summary import Summary
from twbal.api.arguments import check_plant, check_progress
from twbal.api.configured import setup as configured
from twbal.api.real_robots import stoppable
from twbal.api.sheets import RobotLike, sheet_of
from twbal.cli.policy_check import check_torque
from twbal.cli.signals import interruptible
from twbal.core.episode import Episode
from twbal.core.errors import ConfigError
from twbal.core.plant import Plant
from twbal.core.threads import one_thread
from twbal.link.sheet_check import check_robot, check_sensors
from twbal.models.dynamics import DynamicsModel
from twbal.policies.saved import SavedPolicy

_DEFAULT_ROBOT = "paper"


@dataclass(frozen=True, eq=False)
class LearningResult:
    """What a run of Algorithm 1 came to, iteration by iteration; index 0 is the policy from simulation alone.

    Attributes:
        policies: one for each iteration.
        models: f + g that each policy was searched on; None where there was none.
        trials: episodes of each policy that nothing was learned from.
        summary: costs, successes, seconds of driving; the same as `summary.json` of `twbal iterate`.
    """

    policies: tuple[SavedPolicy, ...]
    models: tuple[DynamicsModel | None, ...]
    trials: tuple[tuple[Episode, ...], ...]
    summary: Summary

    @property
    def policy(self) -> SavedPolicy:
        """The best policy: most successes in its trials, then the lowest cost."""
        return self.policies[self.summary.best_iteration]


@interruptible()
@one_thread
def learn(
    plant: Plant,
    robot: RobotLike | None = None,
    overrides: Sequence[str] = (),
    *,
    setup: Setup | None = None,
    progress: Callable[[str], None] = lambda line: None,
) -> LearningResult:
    """Learn to balance a robot by Algorithm 1: simulator model f, policy, real rollouts, correction g, better policy.

    The same seed on the same robot gives the same policies as `twbal iterate`, bit for bit. While a robot on a link is
    driven in the main thread, SIGTERM and a closed terminal stop it and raise KeyboardInterrupt, as Ctrl-C does.

    Args:
        plant: the robot to drive: of `twbal.connect`, or any `twbal.core.plant.Plant`; stays open.
        robot: name of a packaged robot, path of a sheet, or nominal parameters; None: that of the set-up, and without
            one the packaged robot paper.
        overrides: settings of `twbal iterate`, as on its command line: `["updates=2", "method=pilco", "seed=1"]`.
        setup: in place of `overrides`: of `twbal.setup` for the same robot, maybe with parts replaced.
        progress: is told what is being done, a line at a time; `print` shows it.

    Raises:
        ConfigError: a setting cannot be right, the plant is not the robot that was named, or the set-up is of another
            robot or comes with overrides.
        LinkError: the plant was closed; or the robot fell silent, measures the same again and again, or does not
            confirm that it has stopped.
        FitError: a model cannot be learned from the rollouts.
        SearchError: no policy has a finite cost.

    A run of seconds on a simulated robot whose motors are weaker than its nominal parameters say:

    >>> import twbal
    >>> from twbal.effects.torque_gain import TorqueGain
    >>> quick = ["sim_collect.rollouts=6", "sim_rounds=0", "ensemble=none", "updates=0", "trials=1"]
    >>> quick += ["calibration_rollouts=0"]
    >>> quick += ["search.horizon=20", "search.restarts=1", "search.iterations=5", "validation.robots=3"]
    >>> quick += ["parametrisation.basis=5"]
    >>> setup = twbal.setup(overrides=quick)
    >>> with setup.simulation.having([TorqueGain(0.9)]).plant(seed=1) as plant:
    ...     result = twbal.learn(plant, setup=setup)
    >>> result.summary.best.trials, len(result.policies)
    (1, 1)
    """
    end_if_read_again()
    check_plant(plant)
    check_progress(progress)
    if setup is None:
        setup = configured(_DEFAULT_ROBOT if robot is None else robot, overrides)
    else:
        _check(setup, robot, overrides)
    check_robot(plant, setup.simulation.robot)
    check_sensors(plant, setup.search.channels.names)
    check_torque(setup.at_random, setup.simulation.robot)
    began, steps = time.monotonic(), InMemory(plant, setup, progress, lambda: stoppable(plant))
    learned = Algorithm(steps, setup.algorithm, setup.driving, setup.rule).run()
    found = findings(learned, steps, setup.measures)
    summary = summarise(
        found,
        steps.episodes(learned.simulated),
        setup.simulation.robot.name,
        setup.algorithm.seed,
        round(time.monotonic() - began, 3),
        setup.rule,
        setup.algorithm.oscillation_limit,
    )
    return LearningResult(
        policies=tuple(each.policy.policy for each in learned.policies),
        models=tuple(each.model for each in learned.policies),
        trials=tuple(each.trials for each in found),
        summary=summary,
    )


def _check(setup: Setup, robot: RobotLike | None, overrides: Sequence[str]) -> None:
    """Raise ConfigError where something that was given beside a set-up contradicts it."""
    if not isinstance(setup, Setup):
        raise ConfigError(f"setup must be what twbal.setup(...) returns; found a {type(setup).__name__}.")
    if overrides:
        raise ConfigError(
            f"overrides={list(overrides)!r:.200} would not act beside a set-up. Give them to the set-up: "
            "twbal.setup(robot, overrides)."
        )
    if robot is None:
        return
    given, own = sheet_of(robot), setup.simulation.robot
    if given != own:
        raise ConfigError(
            f"The robot is {given.name!r}, and the set-up is of {own.name!r} or of other parameters of it. Make the "
            "set-up by twbal.setup(robot, overrides), or leave robot out."
        )
