"""Driving a robot by a policy, in simulation or for real, and what is to be made of it."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from twbal.algorithm.collection import RolloutPlan, end_if_read_again
from twbal.algorithm.collection import simulate as driven
from twbal.algorithm.settings import RolloutSettings
from twbal.algorithm.setup import Setup
from twbal.api.arguments import check_plant, check_policy, check_tell, check_whole, checked_effects
from twbal.api.configured import setup as configured
from twbal.api.files import load_policy
from twbal.api.read_settings import READ_BY_EVALUATION, READ_BY_SIMULATION, check_read
from twbal.api.real_robots import stoppable
from twbal.api.sheets import RobotLike, check_overrides
from twbal.cli.composed import warn_of
from twbal.cli.policy_check import check_made_for, check_torque, other_past_commands
from twbal.cli.signals import interruptible
from twbal.core.channels import Channels
from twbal.core.episode import Episode, Provenance
from twbal.core.errors import ConfigError
from twbal.core.evaluation import TrialVerdict, drift, judged, real_cost
from twbal.core.plant import Plant
from twbal.core.robot_parameters import RobotParameters
from twbal.core.threads import one_thread
from twbal.effects.effect import Effect
from twbal.link.frozen_sensors import FrozenSensors
from twbal.link.sheet_check import check_robot, check_sensors
from twbal.policies.policy import Policy, PolicyOfChannels


@dataclass(frozen=True, eq=False)
class Evaluation:
    """What trials say of a policy.

    Attributes:
        successes: trials that show all that the success rule asks.
        cost: mean long-term cost of a trial (eq. 9, without expectation): 0 .. horizon.
        drift: median distance between start and end of a trial [m].
        episodes: the trials.
        verdicts: what each of them shows, part by part.
    """

    successes: int
    cost: float
    drift: float
    episodes: tuple[Episode, ...]
    verdicts: tuple[TrialVerdict, ...]

    @property
    def trials(self) -> int:
        """How many were driven."""
        return len(self.episodes)


@interruptible()
@one_thread
def simulate(
    robot: RobotLike = "paper",
    policy: Policy | str | Path | None = None,
    *,
    effects: Sequence[Effect] = (),
    trials: int = 1,
    steps: int = 100,
    seed: int = 0,
    overrides: Sequence[str] = (),
) -> list[Episode]:
    """Rollouts of the simulated robot in PyBullet; trial k with one seed is always the same rollout.

    Args:
        robot: name of a packaged robot, path of a sheet, or nominal parameters.
        policy: that drives it, or the path of a `policy.pt`; None drives at random.
        effects: what the nominal parameters leave out (twbal/effects/), beside those of the settings.
        trials: how many rollouts.
        steps: control periods of each, at most; the tilt limit ends one earlier.
        seed: of start poses, noise and the policy's randomness.
        overrides: settings of `twbal iterate` that a simulation reads, such as `["sim=regbot", "state=paper"]`.

    Raises:
        ConfigError: an argument or a setting cannot be right, or is not read here, or the policy was made for another
            control period.
        CheckpointError: the policy cannot be read.
        DataError: the policy gives no law, or commands what is no number.

    Warns:
        UserWarning: the policy or a value of the sheet is hardly right for this robot.

    >>> import twbal
    >>> from twbal.effects.dead_zone import DeadZone
    >>> (episode,) = twbal.simulate("paper", effects=[DeadZone(1.0)], steps=10)  # ±1 N·m do nothing
    >>> episode.observations.shape, episode.commands.shape
    ((11, 7), (10,))
    """
    _check_counts(trials, seed, overrides)
    check_whole("steps", steps, 1)
    given = checked_effects(effects)
    driver = None if policy is None else _policy(policy)
    setup = configured(robot, overrides)
    check_read("simulate", overrides, (*READ_BY_SIMULATION, *["policy"] * (driver is None)))
    simulation = setup.simulation.having(given)
    if driver is not None:
        _check_made_for(driver, setup)
    settings = RolloutSettings(seed, trials, 0, steps, setup.simulated.tilt_limit, exploration=0.0)
    channels = _channels(driver, setup.search.channels)
    source = Provenance(simulation.robot.name, "simulation", seed=seed)
    return list(driven(simulation, driver or setup.at_random, channels, settings, source))


@interruptible()
@one_thread
def evaluate(
    policy: Policy | str | Path,
    robot: RobotLike = "paper",
    *,
    plant: Plant | None = None,
    effects: Sequence[Effect] = (),
    trials: int = 10,
    seed: int = 0,
    overrides: Sequence[str] = (),
    tell: Callable[[Episode], object] = lambda episode: None,
) -> Evaluation:
    """Drive trials by a policy and count the successes, by the rule and the cost of `twbal iterate`.

    While a robot on a link is driven in the main thread, SIGTERM and a closed terminal stop it and raise
    KeyboardInterrupt, as Ctrl-C does.

    Args:
        policy: that drives, or the path of a `policy.pt`.
        robot: name of a packaged robot, path of a sheet, or nominal parameters.
        plant: the robot to drive; None drives the simulated one.
        effects: of the simulated robot, what the nominal parameters leave out.
        trials: how many.
        seed: of start poses, noise and the policy's randomness.
        overrides: settings of `twbal iterate` that trials read, such as `["success.place_radii=null"]`.
        tell: is given each trial as it ends, so that none is lost where a later one breaks off.

    Raises:
        ConfigError: an argument or a setting cannot be right, or is not read here; the policy was made for another
            control period, or commands more than the plant's torque limit; or the plant is another robot.
        DataError: the policy gives no law or commands what is no number, or the plant returns no observation.
        CheckpointError: the policy cannot be read.
        LinkError: the plant was closed; or the robot fell silent, measures the same again and again, or does not
            confirm that it has stopped.

    Warns:
        UserWarning: the policy or a value of the sheet is hardly right for this robot.

    >>> import twbal
    >>> shorter = ["success.duration=4", "success.place_radii=null"]
    >>> found = twbal.evaluate("data/regression/policy.pt", trials=2, overrides=shorter)
    >>> found.successes, found.trials
    (2, 2)
    """
    _check_counts(trials, seed, overrides)
    check_tell(tell)
    given = checked_effects(effects)
    driver = _policy(policy)
    setup = configured(robot, overrides)
    check_read("evaluate", overrides, READ_BY_EVALUATION, plant is not None)
    if plant is not None:
        check_torque(driver, setup.simulation.robot)
    _check_made_for(driver, setup)
    if _channels(driver, setup.search.channels) != setup.search.channels:
        setup = configured(robot, [*overrides, *_state_of(driver)])
    rule, cost, horizon = setup.rule, setup.search.cost, setup.search.search.horizon
    channels, name = _channels(driver, setup.search.channels), setup.simulation.robot.name
    settings = RolloutSettings(seed, trials, 0, rule.steps, rule.tilt_limit, exploration=0.0)
    if plant is None:
        source = Provenance(name, "simulation", seed=seed)
        episodes = _told(driven(setup.simulation.having(given), driver, channels, settings, source), tell)
    else:
        _check_driven(plant, given)
        episodes = _driven_on(plant, driver, channels, settings, setup.simulation.robot, tell)
    verdicts = tuple(judged(episode, rule) for episode in episodes)
    return Evaluation(
        successes=sum(verdict.succeeded for verdict in verdicts),
        cost=float(np.mean([real_cost(episode, cost, horizon) for episode in episodes])),
        drift=float(np.median([drift(episode, channels.wheel_radius) for episode in episodes])),
        episodes=episodes,
        verdicts=verdicts,
    )


def _driven_on(
    plant: Plant,
    driver: Policy,
    channels: Channels,
    settings: RolloutSettings,
    robot: RobotParameters,
    tell: Callable[[Episode], object],
) -> tuple[Episode, ...]:
    """Trials on a robot that is there already, if it is that one; `tell` is given each as it ends."""
    check_robot(plant, robot)
    check_sensors(plant, channels.names)
    source = Provenance(robot.name, "robot", seed=settings.seed)
    plan = RolloutPlan(lambda: plant, driver, channels, settings.steps, settings.tilt_limit, new_watch=FrozenSensors)
    with stoppable(plant):
        return _told(plan.drive_on(plant, [replace(source, trial=trial) for trial in settings.numbers]), tell)


def _check_driven(plant: Plant, effects: Sequence[Effect]) -> None:
    """Raise ConfigError where a robot to drive is none, or effects are given, which only the simulated one has."""
    end_if_read_again()
    check_plant(plant)
    if effects:
        raise ConfigError("effects are those of the simulated robot, and here a plant is driven; give one of both.")


def _told(driven: Iterable[Episode], tell: Callable[[Episode], object]) -> tuple[Episode, ...]:
    """The trials, of which `tell` is given each as it ends."""
    episodes = list[Episode]()
    for episode in driven:
        tell(episode)
        episodes.append(episode)
    return tuple(episodes)


def _check_counts(trials: int, seed: int, overrides: Sequence[str]) -> None:
    """Check the two numbers, and that no override says them, too, which would not act."""
    check_whole("trials", trials, 1)
    check_whole("seed", seed, 0)
    check_overrides(overrides, {"trials": "trials", "seed": "seed"})


def _policy(policy: Policy | str | Path) -> Policy:
    """The policy itself, or that of a file."""
    check_policy(policy)
    return load_policy(policy) if isinstance(policy, str | Path) else policy


def _check_made_for(policy: Policy, setup: Setup) -> None:
    """Hold what a policy tells of the robot that it was made for against the one that it is to drive."""
    robot, configured_state = setup.simulation.robot, setup.search.channels.names
    warn_of([*check_made_for(policy, robot), *other_past_commands(policy, configured_state, robot)])


def _state_of(policy: Policy) -> list[str]:
    """The setting by which the state, and with it the cost, is that which a policy reads; none where it says none."""
    return [f"state.names=[{','.join(policy.channels)}]"] if isinstance(policy, PolicyOfChannels) else []


def _channels(policy: Policy | None, configured: Channels) -> Channels:
    """The state that a policy reads; where it says none, that of the settings."""
    return replace(configured, names=tuple(policy.channels)) if isinstance(policy, PolicyOfChannels) else configured
