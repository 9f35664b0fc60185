"""Policies for robots of a parameter distribution: planar models whose parameters are known with an uncertainty.

Regulators of some of the likely robots are driven on all of them (`planar_rollouts`), with noise of the sensors, slow
torques and the error of a tilt filter. Those under which most robots succeed, and among these those under which robots
use less of the limits and oscillate less, are candidates of the search. A regulator answers to a motor's dead zone and
dry friction by a jump of the command (`policies.squash`).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np
import scipy.optimize

from twbal.core.channels import Channels
from twbal.core.cost import Cost
from twbal.core.evaluation import SuccessCriterion
from twbal.core.gaussian import Array, Gaussian
from twbal.core.streams import Stream, generator
from twbal.core.threads import in_threads
from twbal.planar.linearised import sampled_with_delay, torque_response
from twbal.planar.parameters import PlanarParameters
from twbal.planar.robot_distribution import RobotDistribution
from twbal.policies.rbf import RbfPolicy
from twbal.policies.squash import NARROWEST, WIDEST
from twbal.search.linear_starts import linear_law, regulator, state_space
from twbal.search.margin import Margin
from twbal.search.planar_rollouts import Driven, PlanarDraws, planar_rollouts
from twbal.search.reliability import AS_IT_IS
from twbal.search.sampled_rollouts import Limits, limits_of

PHYSICAL = ("tilt", "tilt_rate", "speed")
"""Channels that a state needs for regulators of planar robots."""
_FIRST, _CHANGED, _AGAIN = 1, 2, 3  # series of draws
_DISTURBED = 1.0  # s over which a disturbing torque is forgotten: a robot crosses a wave of the floor in about that
_OLDEST_RATE = 0.5  # control periods: of a wheel rate that is the difference of angles over a control period
_MOST_COMPENSATION = 0.6
_MORE_RESTLESS = 1.2  # gears with play and encoders with ticks let commands change more than those of planar robots
_RESTARTS = 2
_FIRST_STEP = 0.3  # of the direct search, in logarithms of the gains
_PAST_STEP = 0.5  # of the gains of past commands, which may change their sign, per torque limit
_WIDTH_STEP = 2.0  # of the compensation's width, in its logarithm
_BALANCE_STEP = 0.02  # of the tilt that the bias stands for [rad]
_COMPENSATION_STEP = 0.1  # the same for the compensation, as a share of the torque limit


@dataclass(frozen=True)
class RobustSettings:
    """How policies are found for robots of a distribution.

    Attributes:
        robots: how many are drawn; the first has the mean numbers.
        designs: for how many of them regulators are designed.
        screening: robots on which all regulators are driven ...
        finalists: ... and how many of the regulators, the best, are driven on all robots.
        width_scales: factors on the cost's widths of channels by name, in all regulators; 1 where there is none.
        position_scales: more factors on those of position and its integral.
        change_scales: of the cost's price on changes of the command, as factors on its width.
        command_widths: that cost as much as the cost's widths, as shares of the torque limit.
        compensations: of the robot's dead zone and Coulomb friction, as shares.
        compensation_tilt: the compensation's width, as the tilt that moves the activation so far [rad].
        improved: how many of the finalists, the best, are improved by direct search ...
        evaluations: ... with so many evaluations each, at most ...
        improving: ... on so many of the robots.
        enough: mean share of the limits that the robots use under the best, at which none is improved.
        doubt: factor on the standard deviations of what is known: where no planar model is quite right, its numbers are
            known less well than a fit says.
        margin: by how much robots change that a policy with margin is to balance, too.
        reliability_sheet: of probabilities of success where the sheet alone tells of the robot: how often policies
            really succeeded (`success_probability`).
        reliability_rollouts: the same where rollouts tell of it.
    """

    robots: int
    designs: int
    screening: int
    finalists: int
    width_scales: dict[str, float]
    position_scales: tuple[float, ...]
    change_scales: tuple[float, ...]
    command_widths: tuple[float, ...]
    compensations: tuple[float, ...]
    compensation_tilt: float
    improved: int
    evaluations: int
    improving: int
    enough: float
    doubt: float
    margin: Margin
    reliability_sheet: tuple[float, float] = AS_IT_IS
    reliability_rollouts: tuple[float, float] = AS_IT_IS


class RankedPolicy(NamedTuple):
    """A policy and how it did on the sampled robots.

    Attributes:
        origin: what it was designed for: a sampled robot; factors on the widths of the cost for place, changes of the
            command and command; and the share of the dead zone and the friction that it makes up for.
        policy: the policy.
        success: share of the robots under which it succeeds.
        use: mean share of the limits that the robots used (`Driven`), those that changed among them.
        cost: mean cost of a step.
        margin: share of robots that changed under which it succeeds; None: not asked.
    """

    origin: str
    policy: RbfPolicy
    success: float
    use: float
    cost: float
    margin: float | None = None

    @property
    def rank(self) -> tuple[float, float]:
        """Less is better: success in tenths first; where margin is asked, `shortfall` alone."""
        return (-round(self.success, 1), self.use) if self.margin is None else (self.shortfall, 0.0)

    @property
    def shortfall(self) -> float:
        """Less is better: the use of the limits, and what is missing to full success, in one number."""
        return self.use - (self.success if self.margin is None else 0.5 * (self.success + self.margin))


@dataclass(frozen=True, eq=False)
class SampledRobots:
    """Robots drawn from a distribution, with their starts and noises: the same for every policy.

    Attributes:
        distribution: what is known of the robot.
        channels: of the state.
        cost: of a state.
        rule: when a rollout is a success.
        start: distribution of the first state.
        settings: how many, and how policies for them are designed.
        seed: of all that is drawn.
        are_measured: whether rollouts of the robot told of its parameters, not the sheet alone.
        with_margin: whether policies are to balance as many robots that changed, too.
    """

    distribution: RobotDistribution
    channels: Channels
    cost: Cost
    rule: SuccessCriterion
    start: Gaussian
    settings: RobustSettings
    seed: int
    are_measured: bool = False
    with_margin: bool = False

    @property
    def reliability(self) -> tuple[float, float]:
        """Of probabilities of success by these robots; see `success_probability`."""
        intercept, slope = self.settings.reliability_rollouts if self.are_measured else self.settings.reliability_sheet
        return intercept, slope

    def driven(self, policy: RbfPolicy, robots: int | None = None) -> Driven:
        """What becomes of the first `robots` of them under a policy; None: of all."""
        return self._driven(self._models, self._draws, policy, robots)

    def changed(self, policy: RbfPolicy, robots: int | None = None) -> Driven:
        """What becomes of the first `robots` of as many that changed; None: of all."""
        return self._driven(self._changed_models, self._changed_draws, policy, robots)

    def _driven(
        self, models: Sequence[PlanarParameters], draws: PlanarDraws, policy: RbfPolicy, robots: int | None
    ) -> Driven:
        period = self.distribution.robot.control_period
        return planar_rollouts(
            models[:robots], self.channels, policy, self.cost, self._limits, draws.first(robots), period
        )

    def _use(self, policy: RbfPolicy, robots: int) -> float:
        """What the direct search makes small: mean use of the limits."""
        use = self.driven(policy, robots).mean_use
        return 0.5 * (use + self.changed(policy, robots).mean_use) if self.with_margin else use

    def states(self, policy: RbfPolicy, steps: int, again: bool = False) -> Array:
        """The states of all n under a policy at t = 0..`steps` as the sensors show them, NaN after a fall.

        (n, `steps` + 1, D); `steps` may be other than those of a rollout by the rule. `again` draws what differs from
        rollout to rollout (start, noise, slow torques) anew; the robots stay the same.
        """
        draws = self._drawn(steps)
        if again:
            other = self._drawn(steps, _AGAIN)
            draws = other._replace(filter_rates=draws.filter_rates, rate_ages=draws.rate_ages)
        period, cost = self.distribution.robot.control_period, self.cost
        shown = np.full((len(self._models), steps + 1, len(self.channels.names)), np.nan)
        planar_rollouts(self._models, self.channels, policy, cost, self._limits, draws, period, shown)
        return shown

    def ranked(self, origin: str, policy: RbfPolicy, robots: int | None = None) -> RankedPolicy:
        """A policy with how it does on the first `robots` of them."""
        found = self.driven(policy, robots)
        as_known = RankedPolicy(origin, policy, found.success, found.mean_use, float(found.costs.mean()))
        if not self.with_margin:
            return as_known
        changed = self.changed(policy, robots)
        return as_known._replace(use=0.5 * (found.mean_use + changed.mean_use), margin=changed.success)

    def regulators(self, workers: int = 1) -> list[RankedPolicy]:
        """The regulators under which most robots succeed, best first.

        Args:
            workers: threads; what is found does not depend on it.

        Raises:
            ConfigError: the state lacks tilt, tilt rate or speed.
        """
        settings = self.settings
        screened = in_threads(lambda each: self.ranked(*each, settings.screening), self._designs(), workers)
        best = sorted(screened, key=lambda found: found.shortfall)[: settings.finalists]
        driven = in_threads(lambda found: self.ranked(found.origin, found.policy), best, workers)
        finalists = sorted(driven, key=lambda found: found.shortfall)
        if finalists and finalists[0].use > settings.enough:
            finalists += in_threads(self._improved, finalists[: settings.improved], workers)
        return sorted(finalists, key=lambda found: found.shortfall)

    def _improved(self, begin: RankedPolicy) -> RankedPolicy:
        """A policy after a direct search (Nelder and Mead 1965) over its gains, compensation and bias."""
        policy, tilt = begin.policy, self.channels.index("tilt")
        past = np.array([name in self.channels.lags for name in self.channels.names])

        def varied(x: Array) -> RbfPolicy:
            gains, (jump, widening, shift) = x[:-3], x[-3:]
            gain = np.where(past, policy.gain + _PAST_STEP / policy.max_command * gains, policy.gain * np.exp(gains))
            compensation = float(np.clip(policy.compensation + _COMPENSATION_STEP * jump, 0.0, _MOST_COMPENSATION))
            bias = policy.bias - _BALANCE_STEP * shift * float(gain[tilt])
            width = float(np.clip(policy.compensation_width * np.exp(_WIDTH_STEP * widening), NARROWEST, WIDEST))
            return replace(policy, gain=gain, compensation=compensation, bias=bias, compensation_width=width)

        found = np.zeros(len(past) + 3)
        for _ in range(_RESTARTS):  # a simplex that has shrunk to a point on a slope goes on from there anew
            simplex = found + _FIRST_STEP * np.eye(len(found) + 1, len(found), -1)
            options = {"maxfev": self.settings.evaluations // _RESTARTS, "initial_simplex": simplex}
            found = scipy.optimize.minimize(
                lambda x: self._use(varied(x), self.settings.improving),
                found,
                method="Nelder-Mead",
                options=options,
            ).x
        return self.ranked(f"{begin.origin}, improved", varied(found))

    @cached_property
    def _limits(self) -> Limits:
        limits = limits_of(self.rule, self.channels.names)
        return limits._replace(command_change=limits.command_change / _MORE_RESTLESS)

    @cached_property
    def _models(self) -> Sequence[PlanarParameters]:
        rng = generator(Stream.SAMPLED_ROBOTS, self.seed)
        return self.distribution.models(self.settings.robots, rng, self.settings.doubt)

    @cached_property
    def _draws(self) -> PlanarDraws:
        return self._drawn(self.rule.steps)

    @cached_property
    def _changed_models(self) -> Sequence[PlanarParameters]:
        rng, settings = generator(Stream.SAMPLED_ROBOTS, self.seed, _CHANGED), self.settings
        return settings.margin.models(self.distribution, settings.robots, rng, settings.doubt)

    @cached_property
    def _changed_draws(self) -> PlanarDraws:
        robot, ages = self.distribution.robot, len(self.channels.lags)
        return self.settings.margin.draws(self._draws, self._changed_models, robot, ages)

    def _drawn(self, steps: int, series: int = _FIRST) -> PlanarDraws:
        """Starts and noises of all robots for a rollout of `steps` control periods."""
        count = self.settings.robots
        rng = generator(Stream.SAMPLED_ROBOTS, self.seed, series)
        physical = [self.channels.index(name) for name in PHYSICAL]
        start = self.start.sample(count, rng)[:, physical]
        noise = rng.standard_normal((count, steps, len(self.distribution.sensor_sd)))
        period = self.distribution.robot.control_period
        torques = self.distribution.torque_sd * slow_noise((count, steps, 2), period / _DISTURBED, rng)
        jolts = np.stack([drawn @ torque_response(m, period).T for m, drawn in zip(self._models, torques, strict=True)])
        mean, sd = self.distribution.filter_rate
        filter_rates = np.abs(mean + sd * rng.standard_normal(count))
        ages = rng.uniform(0.0, _OLDEST_RATE, count)
        return PlanarDraws(np.ascontiguousarray(start), self.distribution.sensor_sd * noise, jolts, filter_rates, ages)

    def _designs(self) -> Iterator[tuple[str, RbfPolicy]]:
        robot, settings = self.distribution.robot, self.settings
        limit = robot.torque_limit
        for number, model in enumerate(self._models[: settings.designs]):
            linear = sampled_with_delay(model, robot.control_period, len(self.channels.lags))
            A, B = state_space(linear, self.channels)
            friction = model.dead_zone_width + 2.0 * model.coulomb_friction_torque / model.torque_gain_gain
            for place, change, width in product(
                settings.position_scales, settings.change_scales, settings.command_widths
            ):
                cost = scaled(self.cost, self.channels, settings.width_scales, place, change)
                gain = regulator(A, B, cost, width * limit)
                if gain is None:
                    continue
                asked = f"place {place:g}, changes {change:g}, command {width:g}"
                for share in settings.compensations:
                    compensation = min(share * friction / limit, _MOST_COMPENSATION)
                    jump = (compensation, linear.balance, settings.compensation_tilt)
                    policy = linear_law(self.channels.names, gain, limit, *jump)
                    yield f"regulator of sampled robot {number} ({asked}, friction {share:g})", policy


def scaled(cost: Cost, channels: Channels, by_name: Mapping[str, float], place: float, change: float) -> Cost:
    """A cost with other widths of named channels, of the position and its integral, and of changes of the command.

    Args:
        cost: it.
        channels: of the state.
        by_name: factors on widths, by channel; what is not in the state is left out.
        place: another factor on those of position and its integral.
        change: factor on the width of changes of the command.
    """
    widths = np.array(cost.widths) * [by_name.get(name, 1.0) for name in channels.names]
    widths[list(channels.kinematic)] *= place
    return cost.with_widths(widths, change)


def slow_noise(shape: tuple[int, int, int], forgotten: float, rng: np.random.Generator) -> Array:
    """Standard normal numbers (n, T, k) whose correlation over time fades by exp(-`forgotten`) a step.

    A first-order autoregressive process, AR(1), in its stationary state: G. E. P. Box, G. M. Jenkins, G. C. Reinsel,
    G. M. Ljung: Time Series Analysis, 5th ed., Wiley 2015, section 3.2.

    Args:
        shape: n independent series of T steps for each of k quantities.
        forgotten: time of a step over the correlation time.
        rng: of all draws.
    """
    kept = np.exp(-forgotten)
    found = rng.standard_normal(shape)
    for t in range(1, shape[1]):
        found[:, t] = kept * found[:, t - 1] + np.sqrt(1.0 - kept**2) * found[:, t]
    return found
