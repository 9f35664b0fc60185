"""Rollouts in simulations that differ from the robot by what is not known of it yet, and f of them."""

from functools import partial
from pathlib import Path
from typing import Generic

from twbal.algorithm.iteration import Base
from twbal.algorithm.learned import UpdateInputs
from twbal.algorithm.settings import AlgorithmSettings
from twbal.algorithm.steps import Conditions, K, M, P, R, S, Steps, Timed

FIRST_TRIAL = 1000
"""Number of policy 0's first trial; those of policy i begin at (i + 1) times that, apart from what is learned from."""


class Simulations(Generic[R, M, P, S, K]):
    """Drives simulated robots.

    Args:
        steps: does the work.
        settings: of the run.
    """

    def __init__(self, steps: Steps[R, M, P, S, K], settings: AlgorithmSettings) -> None:
        self._steps, self._settings = steps, settings

    def rollouts(
        self,
        place: Path,
        round_number: int,
        policy: P | None,
        simulation: S | None = None,
        exploration: float | None = None,
    ) -> R:
        """Rollouts in simulation: at random, or by the policy of a round, with numbers of their own.

        `exploration` is that of a policy's command, as a share of the torque limit; None: that of the settings.
        """
        if policy is None:
            return self._steps.simulate(place, None, simulation=simulation)
        conditions = Conditions(
            trials=self._settings.sim_round_rollouts,
            first_trial=FIRST_TRIAL * round_number,
            exploration=self._settings.sim_round_exploration if exploration is None else exploration,
        )
        return self._steps.simulate(place, policy, conditions, simulation)

    def f_of(self, base: Base, simulation: S, inputs: UpdateInputs[R, M, P]) -> Timed[M]:
        """f of a simulation: of random rollouts there, and of some by each policy that drove the robot.

        These explore. What calibrates a model to undisturbed driving adds as many that do not: where noise makes a
        robot fall at once, f would say nothing of how it stands.
        """
        drivers = inputs.earlier if inputs.drivers is None else inputs.drivers
        place, simulate = inputs.place, partial(self.rollouts, simulation=simulation)
        collecting = [partial(simulate, place / f"{base}_collect", 0, None)]
        for number, driver in enumerate(drivers, start=1):
            collecting.append(partial(simulate, place / f"{base}_driven_{number - 1}", number, driver))
            if inputs.recalibration:
                calm = place / f"{base}_undisturbed_{number - 1}"
                collecting.append(partial(simulate, calm, len(drivers) + number, driver, exploration=0.0))
        begun = len(collecting) // 2  # about as long as the others, as most are at random
        with self._steps.begun_ahead(lambda: [collect() for collect in collecting[begun:]]):
            simulated = [collect() for collect in collecting[:begun]]
        simulated += [collect() for collect in collecting[begun:]]
        return self._steps.fit_simulation(place / f"{base}_model", simulated)
