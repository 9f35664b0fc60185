"""What an update of Algorithm 1 makes of the robot's rollouts: a model, and a policy that is searched on it."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Generic, NamedTuple

from twbal.algorithm.iteration import Base, Basis, DiagnosisOutcome
from twbal.algorithm.learned import LearnedPolicy, UpdateInputs
from twbal.algorithm.ranking import Shown, shown_by
from twbal.algorithm.settings import AlgorithmSettings, ModelUpdate
from twbal.algorithm.simulations import Simulations
from twbal.algorithm.steps import (
    Conditions,
    CorrectedSimulation,
    FittedDifference,
    K,
    M,
    P,
    R,
    S,
    SearchInputs,
    Steps,
    Timed,
)
from twbal.core.errors import DataError
from twbal.core.evaluation import SuccessCriterion, judged
from twbal.diagnosis.record import CLOSED
from twbal.diagnosis.usability import enough_for_diagnosis

REGULATOR = Path("regulator")
"""Place of the regulator of the nominal parameters."""


class _Bases(NamedTuple, Generic[M, K]):
    """What g may be learned on top of.

    Attributes:
        known: of the robot's parameters; None: nothing was asked.
        candidates: the f of each; None where there is no simulation.
        diagnosed: whether the rollouts were diagnosed.
        seconds: that the fits took.
    """

    known: K | None
    candidates: Mapping[Base, M | None]
    diagnosed: bool
    seconds: float


class Update(Generic[R, M, P, S, K]):
    """Makes policies of rollouts.

    Args:
        steps: does the work.
        settings: of the run.
        rule: what makes a success.
    """

    def __init__(self, steps: Steps[R, M, P, S, K], settings: AlgorithmSettings, rule: SuccessCriterion) -> None:
        self._steps, self._settings, self._rule = steps, settings, rule
        self._simulations = Simulations(steps, settings)
        self.as_judged = Conditions(steps=rule.steps, tilt_limit=rule.tilt_limit, exploration=0.0)

    def learned(self, inputs: UpdateInputs[R, M, P]) -> LearnedPolicy[R, M, P]:
        """The next policy."""
        match self._settings.model_update:
            case ModelUpdate.FULL:
                return self.with_g(replace(inputs, f=None), Basis.ROBOT)
            case ModelUpdate.RESIDUAL:
                return self._with_diagnosis(inputs)
            case ModelUpdate.LINEAR:
                made = self._steps.regulator(inputs.place / "policy", inputs.rollouts)
                return LearnedPolicy(
                    inputs.index, made.value, Basis.IDENTIFIED, search_s=made.seconds, rollouts=inputs.rollouts
                )

    def with_g(self, inputs: UpdateInputs[R, M, P], basis: Basis) -> LearnedPolicy[R, M, P]:
        """Learn g on top of the likeliest base, and search.

        Args:
            inputs: what to learn from.
            basis: what the policy is made from, where g is learned on top of an f.
        """
        bases = self._bases(inputs)
        fit = self._fit(inputs, bases)
        base = list(bases.candidates)[fit.value.base]
        searching = SearchInputs(
            [fit.value.model],
            inputs.earlier,
            recalibration=inputs.recalibration,
            known=bases.known,
            with_margin=inputs.with_margin,
            set_aside=inputs.set_aside,
        )
        found = self.searched(inputs.place / "policy", searching)
        return LearnedPolicy(
            index=inputs.index,
            policy=found.value,
            basis=Basis.ROBOT if base is Base.NONE else basis,
            model=fit.value.model,
            f=inputs.f,
            fit_s=bases.seconds + fit.seconds,
            search_s=found.seconds,
            rollouts=inputs.rollouts,
            diagnosis=_outcome(bases.diagnosed, base),
            base=base,
            log_evidences=dict(zip(bases.candidates, fit.value.log_evidences, strict=False)),  # of one base: none
        )

    @property
    def begins(self) -> bool:
        """Whether there is something to `begin`."""
        return self._settings.model_update is ModelUpdate.RESIDUAL and not self._settings.diagnose

    def begin(self, inputs: UpdateInputs[R, M, P], may_fail: bool) -> None:
        """Do of `learned` what its trials do not matter to; what policies it chooses among does not, either.

        Args:
            inputs: without what the trials of the newest policy show.
            may_fail: whether they may show that it `has_failed`, after which there is one more base of g.
        """
        bases = self._bases(inputs)
        if not (may_fail and self._steps.identifies and self._settings.base_by_evidence):
            self._fit(inputs, bases)

    def _bases(self, inputs: UpdateInputs[R, M, P]) -> _Bases[M, K]:
        """What g may be learned on top of; the search asks what is known of the robot's parameters, too."""
        known: K | None = None
        simulations: dict[Base, S] = {}
        seconds, diagnosed = 0.0, None
        if self._steps.identifies:
            identified = self._steps.identify(inputs.place / "identify", inputs.rollouts)
            known, seconds = identified.value.known, identified.seconds
            simulations[Base.IDENTIFIED] = identified.value.simulation
        if inputs.f is None:
            return _Bases(known, {Base.NONE: None}, False, seconds)
        candidates: dict[Base, M | None] = {Base.GIVEN: inputs.f}
        if simulations and self._settings.base_by_evidence:
            diagnosed = self._diagnosed(inputs) if inputs.has_failed and not self._settings.diagnose else None
            if diagnosed is not None and diagnosed.closed > 0.0:
                simulations[Base.DIAGNOSED] = diagnosed.simulation
            for base, simulation in simulations.items():
                f = self._simulations.f_of(base, simulation, inputs)
                candidates[base], seconds = f.value, seconds + f.seconds
            candidates[Base.NONE] = None
        return _Bases(known, candidates, diagnosed is not None, seconds)

    def _fit(self, inputs: UpdateInputs[R, M, P], bases: _Bases[M, K]) -> Timed[FittedDifference[M]]:
        """g on top of the base under which the rollouts are likeliest."""
        return self._steps.fit_difference(inputs.place / "model", list(bases.candidates.values()), inputs.rollouts)

    def _diagnosed(self, inputs: UpdateInputs[R, M, P]) -> CorrectedSimulation[S] | None:
        """What a diagnosis of the rollouts finds; None where they do not suffice for one."""
        if not enough_for_diagnosis(self._steps.episodes(inputs.rollouts)):
            return None
        try:
            return self._steps.diagnose(inputs.place / "diagnosis", inputs.rollouts)
        except (DataError, ArithmeticError, ValueError) as error:  # g may be learned from them all the same
            self._steps.say(f"no diagnosis: {error}")
            return None

    def searched(self, place: Path, inputs: SearchInputs[R, M, P, K]) -> Timed[P]:
        """Search a policy: the whole of it, or a network on top of the regulator of the nominal parameters."""
        if self._settings.on_lqr:
            inputs = replace(inputs, base=self._steps.regulator(REGULATOR, ()).value)
        return self._steps.search(place, inputs)

    def solved(self, rollouts: R) -> bool:
        """Whether all of them succeeded."""
        return all(judged(episode, self._rule).succeeded for episode in self._steps.episodes([rollouts]))

    def shown(self, rollouts: R) -> Shown:
        """What trials show."""
        return shown_by(judged(episode, self._rule) for episode in self._steps.episodes([rollouts]))

    def _with_diagnosis(self, inputs: UpdateInputs[R, M, P]) -> LearnedPolicy[R, M, P]:
        """Learn g, with a diagnosis before where that is asked for and there are rollouts enough.

        What it finds is used if it closes the better part of the gap. A policy that stays asks for none: another f
        would change nothing of it.
        """
        asked = self._settings.diagnose and not inputs.recalibration
        found = self._diagnosed(inputs) if asked else None
        if found is None:
            return self.with_g(inputs, Basis.CORRECTED)
        if found.closed > CLOSED:
            return self._with_corrected_simulation(inputs, found.simulation)
        return replace(self.with_g(inputs, Basis.CORRECTED), diagnosis=DiagnosisOutcome.NOT_USED)

    def _with_corrected_simulation(self, inputs: UpdateInputs[R, M, P], simulation: S) -> LearnedPolicy[R, M, P]:
        """Learn f from the corrected simulation, g, and a policy that balances there.

        f must say what the robot did under each of its policies, so each of them drives the new simulation, too: f says
        nothing of where no rollout has been. For the same reason the new policy is validated there before it drives the
        robot: where it falls, f learns from how, and the search is done again.
        """
        place, drivers = inputs.place, list(inputs.earlier)
        simulated = [self._simulations.rollouts(place / "sim_collect", 0, None, simulation)]
        places = [place, *(place / f"again_{i}" for i in range(1, self._settings.search_retries + 1))]
        found: list[LearnedPolicy[R, M, P]] = []
        for here in places:
            for number in range(len(simulated), len(drivers) + 1):
                driven = place / f"sim_driven_{number - 1}"
                simulated.append(self._simulations.rollouts(driven, number, drivers[number - 1], simulation))
            f = self._steps.fit_simulation(here / "sim_model", simulated)
            learned = self.with_g(replace(inputs, place=here, f=f.value), Basis.CORRECTED)
            found.append(replace(learned, fit_s=f.seconds + learned.fit_s))
            drivers.append(learned.policy)
            if here == places[-1] or self._balances(here / "sim_validation", learned.policy, simulation):
                break
        return _joined(found)

    def _balances(self, place: Path, policy: P, simulation: S) -> bool:
        """Whether a policy succeeds in trials in a simulation."""
        return self.solved(self._steps.simulate(place, policy, self.as_judged, simulation))


def _outcome(diagnosed: bool, base: Base) -> DiagnosisOutcome:
    """What became of a diagnosis, if there was one, by the base that was kept."""
    if not diagnosed:
        return DiagnosisOutcome.NOT_MADE
    return DiagnosisOutcome.USED if base is Base.DIAGNOSED else DiagnosisOutcome.NOT_USED


def _joined(found: Sequence[LearnedPolicy[R, M, P]]) -> LearnedPolicy[R, M, P]:
    """The last of several searches, with the time of all of them."""
    return replace(
        found[-1],
        fit_s=sum(each.fit_s for each in found),
        search_s=sum(each.search_s for each in found),
        searches=len(found),
        diagnosis=DiagnosisOutcome.USED if found[-1].base is Base.GIVEN else DiagnosisOutcome.NOT_USED,
    )
