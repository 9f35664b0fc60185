"""The steps of Algorithm 1 in memory: a robot that is there, episodes, models and policies as values."""

import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

from twbal.algorithm.collection import RolloutPlan, explored, simulate
from twbal.algorithm.identification import identify
from twbal.algorithm.iteration import PolicyFile
from twbal.algorithm.policy_search import recalibrated
from twbal.algorithm.prediction import Prediction, prediction_of
from twbal.algorithm.setup import Setup
from twbal.algorithm.simulation import Simulation
from twbal.algorithm.steps import (
    AS_CONFIGURED,
    Conditions,
    CorrectedSimulation,
    FittedDifference,
    Identified,
    SearchInputs,
    Steps,
    Timed,
)
from twbal.core.episode import Episode, Provenance
from twbal.core.errors import ConfigError
from twbal.core.plant import Plant
from twbal.core.robot_parameters import parameter_hash
from twbal.diagnosis.inputs import DiagnosedSimulation, NamedEpisodes
from twbal.diagnosis.pipeline import diagnose_episodes
from twbal.diagnosis.usability import FEW_DATA, ONE_RUN_TOLERANCES
from twbal.effects.library import values_of
from twbal.io.checkpoint import checkpoint_hash
from twbal.link.frozen_sensors import FrozenSensors
from twbal.models.bases import learn_on_likeliest
from twbal.models.dynamics import DynamicsModel, without_simulation
from twbal.planar.robot_distribution import RobotDistribution
from twbal.policies.linear import LinearPolicy
from twbal.policies.rbf import RbfPolicy
from twbal.policies.saved import SavedPolicy, load_policy
from twbal.search.regulator import regulator_for

Episodes = tuple[Episode, ...]
Progress = Callable[[str], None]
T = TypeVar("T")
Kind = TypeVar("Kind", RbfPolicy, LinearPolicy)


@dataclass(frozen=True, eq=False)
class MadePolicy:
    """A policy with what was predicted of it.

    Attributes:
        place: name of the step that made it.
        policy: the policy.
        sha256: of the checkpoint that holds it.
        predicted: what a model expects of it; None where none was asked.
    """

    place: Path
    policy: SavedPolicy
    sha256: str
    predicted: Prediction | None = None


class InMemory(Steps[Episodes, DynamicsModel, MadePolicy, Simulation, RobotDistribution]):
    """Does the steps at once.

    Args:
        plant: the robot; stays open.
        setup: how it learns.
        progress: is told what is being done, a line at a time.
        while_driving: makes what holds while the robot is driven, such as handlers of signals.
    """

    def __init__(
        self,
        plant: Plant,
        setup: Setup,
        progress: Progress,
        while_driving: Callable[[], AbstractContextManager[None]] = nullcontext,
    ) -> None:
        self._plant, self._setup, self._say, self._while_driving = plant, setup, progress, while_driving
        self._channels, self._robot = setup.search.channels, setup.simulation.robot
        self.ensemble = list(setup.ensemble)
        self.identifies = setup.search.robust is not None
        self.known = setup.known

    def say(self, line: str) -> None:
        """Tell `progress`."""
        self._say(line)

    def simulate(
        self,
        place: Path,
        policy: MadePolicy | None,
        conditions: Conditions = AS_CONFIGURED,
        simulation: Simulation | None = None,
    ) -> Episodes:
        """Rollouts of a simulated robot."""
        self._say(f"simulating {place}")
        simulated = simulation or self._setup.simulation
        settings, source = replace(self._setup.simulated, **conditions.given), self._source(simulated, policy)
        driver = policy.policy if policy else self._setup.at_random
        return tuple(simulate(simulated, driver, self._channels, settings, source, self._setup.workers))

    def simulate_variant(self, place: Path, name: str) -> Episodes:
        """Rollouts of the simulated robot with further effects."""
        return self.simulate(place, None, simulation=self._setup.simulation.having(self._setup.ensemble[name]))

    def drive(self, place: Path, policy: MadePolicy | None, conditions: Conditions) -> Episodes:
        """Rollouts of the robot."""
        self._say(f"driving the robot {place}")
        settings, source = replace(self._setup.driving, **conditions.given), self._source(None, policy)
        driver = explored(policy.policy if policy else self._setup.at_random, settings, self._robot.torque_limit)
        limits = settings.steps, settings.tilt_limit
        plan = RolloutPlan(lambda: self._plant, driver, self._channels, *limits, new_watch=FrozenSensors)
        with self._while_driving():
            return tuple(plan.drive_on(self._plant, [replace(source, trial=trial) for trial in settings.numbers]))

    def fit_simulation(self, place: Path, rollouts: Sequence[Episodes]) -> Timed[DynamicsModel]:
        """f."""
        fits = self._setup.models
        return self._timed(
            place,
            lambda: fits.recipe.learn_simulation(self.episodes(rollouts), self._channels, fits.f_seed).model,
        )

    def fit_difference(
        self, place: Path, bases: Sequence[DynamicsModel | None], rollouts: Sequence[Episodes]
    ) -> Timed[FittedDifference[DynamicsModel]]:
        """f + g."""
        recipe, seed, episodes = self._setup.models.recipe, self._setup.models.g_seed, self.episodes(rollouts)
        candidates = [without_simulation(self._channels) if base is None else base for base in bases]

        def learn() -> FittedDifference[DynamicsModel]:
            if len(candidates) == 1:
                return FittedDifference(recipe.learn_difference(candidates[0], episodes, seed).model)
            learned = learn_on_likeliest(recipe, candidates, episodes, seed)
            return FittedDifference(learned.learned.model, learned.chosen, learned.totals)

        return self._timed(place, learn)

    def identify(self, place: Path, rollouts: Sequence[Episodes]) -> Timed[Identified[RobotDistribution, Simulation]]:
        """The robot's parameters."""

        def work() -> Identified[RobotDistribution, Simulation]:
            simulation = self._setup.simulation
            found = identify(self._robot, values_of(simulation.effects), self.episodes(rollouts), self._say)
            return Identified(found.known, simulation.with_values(found.effects, simulation.physics_step))

        return self._timed(place, work)

    def search(
        self, place: Path, inputs: SearchInputs[Episodes, DynamicsModel, MadePolicy, RobotDistribution]
    ) -> Timed[MadePolicy]:
        """A policy search, or a recalibration."""
        search = replace(self._setup.search, with_margin=inputs.with_margin, set_aside=inputs.set_aside)
        earlier = [_of_kind(RbfPolicy, made) for made in inputs.earlier]
        base = _of_kind(LinearPolicy, inputs.base) if inputs.base else None

        def find() -> MadePolicy:
            if inputs.recalibration:
                result = search.judge(inputs.models, earlier[0], inputs.known, self._say)
                driven, driver = self.episodes(inputs.recalibration), inputs.earlier[0].sha256
                result = recalibrated(result, driven, driver, self._channels, search.cost)
            else:
                result = search.find(inputs.models, earlier, base, inputs.known, self._say)
            return _made(place, result.best.policy, prediction_of(result))

        return self._timed(place, find)

    def regulator(self, place: Path, rollouts: Sequence[Episodes]) -> Timed[MadePolicy]:
        """A linear-quadratic regulator."""
        setup = self._setup
        return self._timed(
            place,
            lambda: _made(
                place,
                regulator_for(
                    *(self._robot, self._channels, setup.search.cost, setup.regulator_command_width),
                    episodes=self.episodes(rollouts),
                    progress=self._say,
                ),
            ),
        )

    def agent(self, place: Path, trained: str | None) -> Timed[MadePolicy]:
        """A model-free agent."""
        if trained is not None:
            file = Path(trained) / "policy.pt" if Path(trained).is_dir() else Path(trained)
            return Timed(_made(place, load_policy(file, self._channels.names)), 0.0)
        return self._timed(place, lambda: _made(place, self._trained_agent()))

    def diagnose(self, place: Path, rollouts: Sequence[Episodes]) -> CorrectedSimulation[Simulation]:
        """What the simulation lacks."""
        self._say(f"diagnosing {place}")
        setup, episodes = self._setup, self.episodes(rollouts)
        own = DiagnosedSimulation(self._robot, values_of(setup.simulation.effects), setup.simulation.physics_step)
        names = [f"trial {episode.provenance.trial}" for episode in episodes]
        data = replace(setup.diagnosis_data, **FEW_DATA._asdict(), next_experiment=False, free_form=False)
        settings = replace(setup.diagnosis, tolerances=replace(setup.diagnosis.tolerances, **ONE_RUN_TOLERANCES))
        result = diagnose_episodes(
            NamedEpisodes(episodes, names), NamedEpisodes((), ()), own, settings, data, self._say
        )
        headline = result.diagnosis.headline
        closed = headline.closed if headline else None
        found = result.simulation
        return CorrectedSimulation(setup.simulation.with_values(found.effects, found.physics_step), closed or 0.0)

    def episodes(self, rollouts: Sequence[Episodes]) -> Episodes:
        """All of them, in order."""
        return tuple(episode for driven in rollouts for episode in driven)

    def prediction(self, policy: MadePolicy) -> Prediction:
        """What came with the policy."""
        if policy.predicted is None:
            raise ConfigError(f"Nothing was predicted of the policy of {policy.place}.")
        return policy.predicted

    def policy_file(self, policy: MadePolicy) -> PolicyFile:
        """The checkpoint that would hold it."""
        return PolicyFile((policy.place / "policy.pt").as_posix(), policy.sha256)

    def _trained_agent(self) -> SavedPolicy:
        from twbal.environment.agent_training import policy_of, train  # needs the extra [rl]
        from twbal.environment.two_wheeled import TwoWheeled

        training, search = self._setup.agent, self._setup.search
        plant = self._setup.simulation.plant(training.seed)
        with TwoWheeled(plant, self._robot, self._channels, search.cost, self._setup.rule) as env:
            agent = train(env, training.recipe, training.steps, training.seed, lambda steps, mean_return: None)
            policy = policy_of(agent, env, training.recipe)
        return policy

    def _source(self, simulation: Simulation | None, policy: MadePolicy | None) -> Provenance:
        """Where episodes come from: a simulation, or the robot."""
        driver = policy.sha256 if policy else ""
        if simulation is None:
            sheet = parameter_hash(self._robot)
            return Provenance(self._robot.name, "robot", sheet, driver, self._setup.driving.seed)
        made_of = parameter_hash(self._robot, simulation.effects, simulation.used_step)
        return Provenance(self._robot.name, "simulation", made_of, driver, self._setup.simulated.seed)

    def _timed(self, place: Path, work: Callable[[], T]) -> Timed[T]:
        self._say(str(place))
        began = time.monotonic()
        return Timed(work(), time.monotonic() - began)


def _made(place: Path, policy: SavedPolicy, predicted: Prediction | None = None) -> MadePolicy:
    return MadePolicy(place, policy, checkpoint_hash("policy", policy.to_payload()), predicted)


def _of_kind(kind: type[Kind], made: MadePolicy) -> Kind:
    if not isinstance(made.policy, kind):
        raise ConfigError(
            f"The policy of {made.place} is a {type(made.policy).__name__}; a search goes on from a {kind.__name__}."
        )
    return made.policy
