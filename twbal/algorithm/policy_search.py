"""Policy search and recalibration, as Algorithm 1 asks for them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from twbal.algorithm.identification import EffectValues
from twbal.core.channels import Channels
from twbal.core.cost import Cost
from twbal.core.coverage import calibrated
from twbal.core.episode import Episode
from twbal.core.errors import ConfigError
from twbal.core.gaussian import Array, Gaussian
from twbal.core.robot_parameters import RobotParameters
from twbal.core.start_pose import StartPose
from twbal.core.threads import cores
from twbal.models.dynamics import DynamicsModel
from twbal.planar.robot_distribution import RobotDistribution, prior_of
from twbal.policies.linear import LinearPolicy
from twbal.policies.rbf import RbfPolicy
from twbal.search.optimise import SearchResult, judge_policy, search_policy
from twbal.search.predicted_rollout import PredictedRollout, ranked_by_crps
from twbal.search.robust import PHYSICAL, RobustSettings, SampledRobots
from twbal.search.start_state import start_state
from twbal.search.starts import PolicyParametrisation
from twbal.search.task import SearchSettings, Task
from twbal.search.validation import Validation
from twbal.search.warm import is_compiled


@dataclass(frozen=True)
class PolicySearch:
    """What every search of a run shares.

    Attributes:
        channels: the state.
        start: where rollouts begin.
        cost: of a state.
        shape: of the policies.
        search: how to search.
        validation: of the long rollouts.
        robot: its sheet.
        simulated: effects of the simulation that learning starts from, by name and parameter.
        robust: how policies are found for robots of the parameter distribution; None: on models alone.
        seed: of all that is drawn.
        workers: threads; 0: one a core. What is found does not depend on it.
        with_margin: whether policies are to balance robots that change, too; only where rollouts tell of the robot.
        set_aside: indices of earlier policies that are no candidates.
    """

    channels: Channels
    start: StartPose
    cost: Cost
    shape: PolicyParametrisation
    search: SearchSettings
    validation: Validation
    robot: RobotParameters
    simulated: EffectValues
    robust: RobustSettings | None
    seed: int
    workers: int = 0
    with_margin: bool = False
    set_aside: Sequence[int] = ()

    def find(
        self,
        models: Sequence[DynamicsModel],
        earlier: Sequence[RbfPolicy],
        base: LinearPolicy | None,
        known: RobotDistribution | None,
        progress: Callable[[str], None],
    ) -> SearchResult:
        """Search the policy that is best on the models; see `search_policy`.

        Args:
            models: that the policy is to serve.
            earlier: policies of earlier iterations, oldest first.
            base: regulator that stays beneath the network that is searched; None searches the whole policy.
            known: of the robot's parameters by its rollouts; None: by its sheet and the simulation.
            progress: is told what is being done, a line at a time.

        Raises:
            SearchError: no start has a finite cost.
            ConfigError: what is set aside is none of the earlier policies, or all that there is to judge.
        """
        self._check_set_aside(len(earlier))
        return search_policy(
            task=self._task(models, known, progress),
            shape=self.shape,
            torque_limit=self.robot.torque_limit,
            earlier=earlier,
            progress=progress,
            workers=self.workers or cores(),
            base=base,
            are_robots_new=known is not None,  # else they are the sheet's, as they were for the earlier policies
            set_aside=self.set_aside,
        )

    def judge(
        self,
        models: Sequence[DynamicsModel],
        policy: RbfPolicy,
        known: RobotDistribution | None,
        progress: Callable[[str], None],
    ) -> SearchResult:
        """What is to be expected of a policy, without a search; for `recalibrated`. Arguments as of `find`."""
        self.without_search()._check_set_aside(1)
        return judge_policy(self._task(models, known, progress), policy, progress, self.workers or cores())

    def _task(
        self, models: Sequence[DynamicsModel], known: RobotDistribution | None, progress: Callable[[str], None]
    ) -> Task:
        if not is_compiled():
            progress("compiling the search, once for this version of twbal (about a minute)")
        start = start_state(self.start, self.channels.names)
        robots = self._sampled(start, known, progress)
        return Task(models, start, self.cost, self.search, self.validation, self.seed, robots)

    def _check_set_aside(self, earlier: int) -> None:
        unknown = [number for number in self.set_aside if not 0 <= number < earlier]
        if unknown:
            raise ConfigError(
                f"set_aside has policy {unknown[0]}; there are {earlier} in initial_policies, numbered from 0."
            )
        if not self.search.restarts and earlier and len(set(self.set_aside)) == earlier:
            raise ConfigError("set_aside leaves none of initial_policies, and optimise=false searches no other.")

    def _sampled(
        self, start: Gaussian, known: RobotDistribution | None, progress: Callable[[str], None]
    ) -> SampledRobots | None:
        """Robots as sheet and simulation, or what is known beyond these, say; they begin as `start` says.

        None where none are asked for, or the state lacks a channel that their regulators need.

        Raises:
            ConfigError: margin is asked, or something known, without what it needs.
        """
        if self.with_margin and (known is None or self.robust is None):
            raise ConfigError(
                "with_margin=true searches for robots that changed from what their rollouts tell: give "
                "known=<run folder of identify>, and robust other than none."
            )
        if self.robust is None and known is not None:
            raise ConfigError("known=... tells of the robots of `robust`; robust=none asks for none: leave one out.")
        if self.robust is None:
            return None
        missing = [name for name in PHYSICAL if name not in self.channels.names]
        if missing:
            progress(f"no robots of the parameter distribution (robust): the state has no {', '.join(missing)}")
            return None
        return SampledRobots(
            known or prior_of(self.robot, self.simulated),
            self.channels,
            self.cost,
            self.validation.success,
            start,
            self.robust,
            self.seed,
            are_measured=known is not None,
            with_margin=self.with_margin,
        )

    def without_search(self) -> "PolicySearch":
        """Only judges earlier policies."""
        return replace(self, search=replace(self.search, restarts=0))


def recalibrated(
    result: SearchResult, episodes: Sequence[Episode], driver: str, channels: Channels, cost: Cost
) -> SearchResult:
    """The result with the prediction that fits rollouts of that very policy best, as wide as they ask for.

    The predictions are compared by CRPS (`ranked_by_crps`); the best is `calibrated`.

    Args:
        result: of `PolicySearch.judge`.
        episodes: of the policy.
        driver: its sha256.
        channels: the state.
        cost: of a state; its widths are the units in which channels are compared.

    Raises:
        ConfigError: another policy drove an episode.
    """
    for episode in episodes:
        if episode.provenance.policy_hash != driver:
            raise ConfigError(
                f"Trial {episode.provenance.trial} is to confirm the prediction of the policy in "
                "initial_policies=[...], but another one drove it. Give calibration_episodes=[...] rollouts of that "
                "very policy."
            )
    first, *others = ranked_by_crps(result.predictions, episodes, channels.measured, np.asarray(cost.widths))
    states = calibrated(first.states, episodes, channels.measured)
    first = first._replace(states=states, unknown=_calibrated_unknown(first, states))
    return result._replace(predictions=(first, *others))


def _calibrated_unknown(before: PredictedRollout, states: Sequence[Gaussian]) -> Array | None:
    """How much of calibrated variances is not known, (H + 1, D): what was added, too, as nothing explains it."""
    if before.unknown is None:
        return None
    old, new = (np.array([state.sd**2 for state in each]) for each in (before.states, states))
    kept = np.divide(new, old, out=np.ones_like(old), where=old > 0.0)
    unknown: Array = before.unknown * np.minimum(kept, 1.0) + np.maximum(new - old, 0.0)
    return unknown
