"""Algorithm 1 of the paper, and what it is to be compared with: what is done next, and when it is enough.

    f from random rollouts in simulation; policy 0 from f
    repeat: drive the robot by policy i; g from all real rollouts; policy i + 1 from f + g

Beyond the paper, f is learned once more from rollouts of its own policy in simulation before the robot is touched;
policy 0 must hold robots as the sheet says with its doubts, and later policies robots as the rollouts tell
(`search.robust`), or the further simulated robots of an ensemble; and every new policy is driven in trials that
nothing is learned from. The first policy that succeeds in all of them is followed by one more update, whose policy is
to balance robots that change, too (`search.margin`), and by another one where the tilt oscillates under the better of
the two. The best (`ranking`) is driven a few times more, as it is, to recalibrate the model: what that then predicts is
what the robot does, in bands as wide as these rollouts ask for. New trials show whether it does.

Other methods begin elsewhere (`InitialPolicy`) or learn something else from the robot's rollouts (`ModelUpdate`).
"""

from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import Generic

from twbal.algorithm.iteration import Basis
from twbal.algorithm.learned import LearnedPolicy, RunResult, UpdateInputs
from twbal.algorithm.settings import AlgorithmSettings, InitialPolicy, RolloutSettings
from twbal.algorithm.simulations import FIRST_TRIAL, Simulations
from twbal.algorithm.steps import Conditions, K, M, P, R, S, SearchInputs, Steps
from twbal.algorithm.update import REGULATOR, Update
from twbal.core.errors import ConfigError
from twbal.core.evaluation import SuccessCriterion

_SIMULATION = Path("simulation")
MAX_MARGIN_UPDATES = 2
"""Updates after the first policy that succeeded, where the tilt oscillates under the best one; else it is one."""


class Algorithm(Generic[R, M, P, S, K]):
    """Runs Algorithm 1.

    Args:
        steps: does the work.
        settings: how often and how much.
        driving: of the rollouts that an update learns from.
        rule: how long trials are, and when the robot has fallen.

    Raises:
        ConfigError: a variant's name is no word.
    """

    def __init__(
        self, steps: Steps[R, M, P, S, K], settings: AlgorithmSettings, driving: RolloutSettings, rule: SuccessCriterion
    ) -> None:
        self._steps, self._settings, self._driving = steps, settings, driving
        self._update, self._simulations = Update(steps, settings, rule), Simulations(steps, settings)
        for name in steps.ensemble:  # names of places, beside those of the rounds, which are numbers
            if not name.isidentifier():
                raise ConfigError(f"The name of a robot of the ensemble must be a word, as `latency`; found {name!r}.")

    def run(self) -> RunResult[R, M, P]:
        """From nothing to the last policy."""
        simulated, first = self._first()
        policies = [self._tried(first, ())]
        while (found := self._next(policies)) is not None:
            policies.append(self._tried(found, policies))
        return RunResult(simulated, tuple(policies))

    def _next(self, policies: Sequence[LearnedPolicy[R, M, P]]) -> LearnedPolicy[R, M, P] | None:
        """What comes after these policies, without trials; None: nothing, it is enough."""
        settings, newest = self._settings, policies[-1]
        is_update_left = sum(not each.recalibrates for each in policies) <= settings.updates
        solving = self._solving(policies)
        if not solving:
            return self._updated(policies) if is_update_left else None
        if newest.recalibrates:
            return None
        best = min(solving, key=self._rank)
        if self._steps.was_driven(_calibration(newest)):  # of a run with fewer updates, which ends as it did
            return self._recalibrated(best, policies)
        wanted = MAX_MARGIN_UPDATES if self._falls_or_oscillates(best) else 1
        if settings.improve and is_update_left and newest.index - solving[0].index < wanted and self._steps.identifies:
            return self._updated(policies, with_margin=True)
        if settings.calibration_rollouts and best.predicted:
            return self._recalibrated(best, policies)
        return None

    def _falls_or_oscillates(self, tried: LearnedPolicy[R, M, P]) -> bool:
        """Whether the trials of a policy show that the tilt oscillates, or that the robot falls."""
        limit = self._settings.oscillation_limit
        return limit is not None and tried.trials is not None and self._update.shown(tried.trials).oscillation > limit

    def _rank(self, solving: LearnedPolicy[R, M, P]) -> tuple[float, ...]:
        """Of a policy that solved it, lower is better: what its trials show, and the newer of equals."""
        shown = (
            () if solving.trials is None else self._update.shown(solving.trials).rank(self._settings.oscillation_limit)
        )
        return (*shown, -float(solving.index))

    def _solving(self, policies: Sequence[LearnedPolicy[R, M, P]]) -> list[LearnedPolicy[R, M, P]]:
        """The policies that solved it, oldest first; none of before one failed when it was driven again."""
        failed = [i for i, each in enumerate(policies) if each.recalibrates and not self._is_enough(each)]
        return [each for each in policies[max(failed, default=-1) + 1 :] if self._is_enough(each)]

    def _first(self) -> tuple[tuple[R, ...], LearnedPolicy[R, M, P]]:
        """The simulated rollouts that policy 0 was learned from, and policy 0."""
        match self._settings.initial_policy:
            case InitialPolicy.SIMULATION:
                return self._from_simulation()
            case InitialPolicy.RANDOM:
                conditions = Conditions(trials=self._settings.random_rollouts, exploration=0.0)
                rollouts = self._steps.drive(Path("random") / "rollout", None, conditions)
                inputs = UpdateInputs[R, M, P](0, Path("iteration_0"), (rollouts,), (), None)
                return (), self._update.with_g(inputs, Basis.ROBOT)
            case InitialPolicy.LQR:
                made = self._steps.regulator(REGULATOR, ())
                return (), LearnedPolicy(0, made.value, Basis.DATA_SHEET, search_s=made.seconds)
            case InitialPolicy.AGENT:
                made = self._steps.agent(Path("agent"), self._settings.trained_agent)
                return (), LearnedPolicy(0, made.value, Basis.AGENT, search_s=made.seconds)

    def _from_simulation(self) -> tuple[tuple[R, ...], LearnedPolicy[R, M, P]]:
        """f and its policy, and again on rollouts of that policy; the last policy serves the ensemble too."""
        steps, last = self._steps, self._settings.sim_rounds
        simulated: list[R] = []
        varied: list[R] = []
        policies: list[P] = []
        fit_s = search_s = 0.0
        for i in range(last + 1):
            place = _SIMULATION / f"{i}_collect"
            simulated.append(self._simulations.rollouts(place, i, policies[-1] if i else None))
            fits = [steps.fit_simulation(_SIMULATION / f"{i}_model", simulated)]
            for name in steps.ensemble if i == last else ():
                varied.append(steps.simulate_variant(_SIMULATION / f"{name}_collect", name))
                fits.append(steps.fit_simulation(_SIMULATION / f"{name}_model", varied[-1:]))
            inputs = SearchInputs[R, M, P, K]([fit.value for fit in fits], policies[-1:], known=steps.known)
            found = self._update.searched(_SIMULATION / f"{i}_policy", inputs)
            policies.append(found.value)
            fit_s, search_s = fit_s + sum(fit.seconds for fit in fits), search_s + found.seconds
        f = fits[0].value
        first = LearnedPolicy[R, M, P](0, policies[-1], Basis.SIMULATION, f, f, fit_s, search_s, last + 1)
        return (*simulated, *varied), first

    def _updated(self, policies: Sequence[LearnedPolicy[R, M, P]], with_margin: bool = False) -> LearnedPolicy[R, M, P]:
        """Drive the robot by the newest policy, learn from all that was driven, and search again.

        With margin, a policy under which the tilt oscillates or the robot falls is not to be chosen again: no model has
        predicted that.
        """
        inputs = self._driven_for_update(policies)
        aside = tuple(each.index for each in policies if self._falls_or_oscillates(each)) if with_margin else ()
        failed = policies[-1].index > 0 and not with_margin and self._has_failed(policies[-1])
        return self._update.learned(replace(inputs, with_margin=with_margin, set_aside=aside, has_failed=failed))

    def _driven_for_update(self, policies: Sequence[LearnedPolicy[R, M, P]]) -> UpdateInputs[R, M, P]:
        """Drive the robot by the newest policy: what the update after it learns from."""
        return _inputs(policies[-1], self._driven_enough(policies[-1]), [each.policy for each in policies])

    def _recalibrated(
        self, solving: LearnedPolicy[R, M, P], policies: Sequence[LearnedPolicy[R, M, P]]
    ) -> LearnedPolicy[R, M, P]:
        """Drive a policy that solved it again and learn again; the policy stays."""
        settings, newest = self._settings, policies[-1]
        undisturbed = Conditions(
            trials=settings.calibration_rollouts,
            first_trial=self._first_trial(newest) + settings.max_update_rollouts * self._driving.trials,
            steps=settings.calibration_steps,
            exploration=0.0,
        )
        rollouts = self._steps.drive(_calibration(newest), solving.policy, undisturbed)
        inputs = _inputs(newest, (rollouts,), [solving.policy])
        drivers = tuple(each.policy for each in policies)
        inputs = replace(inputs, f=solving.f, recalibration=(rollouts,), drivers=drivers)
        with self._trials_begun(inputs.index, solving.policy):
            learned = self._update.learned(inputs)
        return replace(learned, recalibrates=True, trials=self._judged_trials(inputs.index, solving.policy))

    def _driven_enough(self, newest: LearnedPolicy[R, M, P]) -> tuple[R, ...]:
        """Rollouts of a policy until they last long enough together: of a robot that falls at once, several."""
        driven: list[R] = []
        while len(driven) < self._settings.max_update_rollouts:
            driven.append(self._driven(newest, Conditions(trials=self._driving.trials), len(driven)))
            lasted = sum(len(e) * e.control_period for e in self._steps.episodes(driven))
            if lasted >= self._settings.min_update_time:
                break
        return tuple(driven)

    def _driven(self, newest: LearnedPolicy[R, M, P], conditions: Conditions, again: int = 0) -> R:
        """Rollouts of a policy to learn from, the first or again."""
        first = self._first_trial(newest) + again * self._driving.trials
        place = Path(f"iteration_{newest.index}") / (f"rollout_{again}" if again else "rollout")
        return self._steps.drive(place, newest.policy, replace(conditions, first_trial=first))

    def _first_trial(self, newest: LearnedPolicy[R, M, P]) -> int:
        """Number of the first rollout to learn from after a policy; no two rollouts of a run have one number."""
        settings = self._settings
        most = settings.max_update_rollouts * self._driving.trials + settings.calibration_rollouts
        at_random = settings.random_rollouts if settings.initial_policy is InitialPolicy.RANDOM else 0
        return self._driving.first_trial + at_random + newest.index * most

    def _tried(
        self, learned: LearnedPolicy[R, M, P], before: Sequence[LearnedPolicy[R, M, P]]
    ) -> LearnedPolicy[R, M, P]:
        """`learned`, which comes after others, with its trials: driven now, or the newest of that policy."""
        if learned.trials is not None:
            return learned
        file = self._steps.policy_file(learned.policy)
        for each in reversed(before):
            if each.trials is not None and self._steps.policy_file(each.policy).sha256 == file.sha256:
                of = each.index if each.trials_of is None else each.trials_of
                return replace(learned, trials=each.trials, trials_of=of)
        if self._steps.robot_waits and self._is_updated_anyway(learned, before):
            inputs = self._driven_for_update([*before, learned])
            with self._trials_begun(learned.index, learned.policy):
                self._update.begin(inputs, may_fail=learned.index > 0)
        return replace(learned, trials=self._judged_trials(learned.index, learned.policy))

    def _is_updated_anyway(self, newest: LearnedPolicy[R, M, P], before: Sequence[LearnedPolicy[R, M, P]]) -> bool:
        """Whether an update that learns a model at once comes after the newest policy, whatever its trials show."""
        settings = self._settings
        if (
            not (settings.trials and self._update.begins)
            or sum(not each.recalibrates for each in before) >= settings.updates
        ):
            return False
        return not settings.stop_when_solved or (
            settings.improve and self._steps.identifies and not self._solving(before)
        )

    def _trials_begun(self, index: int, policy: P) -> AbstractContextManager[None]:
        """Lets trials begin while the body learns, if the robot waits for its host."""
        return self._steps.begun_ahead(lambda: self._trials(index, policy), drives=True)

    def _judged_trials(self, index: int, policy: P) -> R | None:
        """Trials as of `_trials`; it is said how many succeeded."""
        found = self._trials(index, policy)
        if found is not None:
            succeeded, trials = self._update.shown(found).share * self._settings.trials, self._settings.trials
            self._steps.say(f"{succeeded:.0f} of {trials} trials succeeded")
        return found

    def _trials(self, index: int, policy: P) -> R | None:
        """Trials of a policy, as those of iteration `index`; None where none are asked for."""
        if not self._settings.trials:
            return None
        first = FIRST_TRIAL * (index + 1)
        conditions = replace(self._update.as_judged, trials=self._settings.trials, first_trial=first)
        return self._steps.drive(Path(f"iteration_{index}") / "trials", policy, conditions)

    def _has_failed(self, tried: LearnedPolicy[R, M, P]) -> bool:
        """Whether some trial of a policy failed."""
        return tried.trials is not None and not self._update.solved(tried.trials)

    def _is_enough(self, learned: LearnedPolicy[R, M, P]) -> bool:
        return self._settings.stop_when_solved and learned.trials is not None and self._update.solved(learned.trials)


def _calibration(newest: LearnedPolicy[R, M, P]) -> Path:
    """Where the robot is driven to recalibrate the model, after the newest policy."""
    return Path(f"iteration_{newest.index}") / "calibration"


def _inputs(newest: LearnedPolicy[R, M, P], rollouts: tuple[R, ...], earlier: Sequence[P]) -> UpdateInputs[R, M, P]:
    """What the update after `newest` learns from."""
    index = newest.index + 1
    return UpdateInputs(index, Path(f"iteration_{index}"), (*newest.rollouts, *rollouts), tuple(earlier), newest.f)
