"""All that a run of Algorithm 1 in memory is set up with."""

from collections.abc import Mapping
from dataclasses import dataclass

from twbal.algorithm.iteration_findings import Measures
from twbal.algorithm.policy_search import PolicySearch
from twbal.algorithm.settings import AlgorithmSettings, RolloutSettings
from twbal.algorithm.simulation import Simulation
from twbal.core.evaluation import SuccessCriterion, check_horizon
from twbal.diagnosis.inputs import DataSettings
from twbal.diagnosis.settings import Settings
from twbal.effects.effect import Effect
from twbal.environment.agent import AgentRecipe
from twbal.models.recipe import ModelRecipe
from twbal.planar.robot_distribution import RobotDistribution
from twbal.policies.policy import Policy


@dataclass(frozen=True)
class ModelFits:
    """How models are learned.

    Attributes:
        recipe: of f and g.
        f_seed: of the fit of f.
        g_seed: of the fit of g.
    """

    recipe: ModelRecipe
    f_seed: int
    g_seed: int


@dataclass(frozen=True)
class AgentTraining:
    """How a model-free agent is trained.

    Attributes:
        recipe: what it is.
        steps: control periods that it drives.
        seed: of all that is drawn.
    """

    recipe: AgentRecipe
    steps: int
    seed: int


@dataclass(frozen=True)
class Setup:
    """A robot, and how it learns.

    Attributes:
        simulation: the simulated robot that learning starts from.
        ensemble: further effects of each simulated robot that policy 0 must serve too, by name.
        at_random: policy that collects the first samples.
        simulated: rollouts in simulation that f is learned from.
        workers: processes that drive them; 0: one a core.
        driving: rollouts of the robot that an update learns from.
        models: how models are learned.
        search: how policies are searched; has the state and the cost.
        rule: what makes a trial a success.
        regulator_command_width: command that costs as much as a width of the cost, as a share of the torque limit.
        algorithm: how often and how much.
        diagnosis: how a diagnosis of the rollouts names effects.
        diagnosis_data: what it reads of them.
        agent: how a model-free agent is trained.
        known: of the robot's parameters before the run, by rollouts; None: there were none.

    Raises:
        ConfigError: a trial ends before the horizon of the cost.
    """

    simulation: Simulation
    ensemble: Mapping[str, tuple[Effect, ...]]
    at_random: Policy
    simulated: RolloutSettings
    workers: int
    driving: RolloutSettings
    models: ModelFits
    search: PolicySearch
    rule: SuccessCriterion
    regulator_command_width: float
    algorithm: AlgorithmSettings
    diagnosis: Settings
    diagnosis_data: DataSettings
    agent: AgentTraining
    known: RobotDistribution | None = None

    def __post_init__(self) -> None:
        check_horizon(self.rule, self.search.search.horizon)

    @property
    def measures(self) -> Measures:
        """By what trials are measured."""
        return Measures(self.rule, self.search.cost, self.search.search.horizon, self.search.channels)
