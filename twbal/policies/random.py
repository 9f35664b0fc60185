"""Torque at random: the law that collects the first samples."""

from dataclasses import dataclass

import numpy as np

from twbal.core.errors import ConfigError
from twbal.core.gaussian import Array
from twbal.policies.policy import Controller, Policy


@dataclass(frozen=True)
class RandomPolicy(Policy):
    """Piecewise constant torque, uniform in ±share · torque_limit, blind to the state.

    Attributes:
        amplitude: of the torque limit that is used, in (0, 1]; strong torques unload the wheels and teach little.
        torque_limit: u_max [N·m].
        hold: control periods for which each torque is held.

    Raises:
        ConfigError: a value out of range.
    """

    amplitude: float
    torque_limit: float
    hold: int

    def __post_init__(self) -> None:
        if not 0 < self.amplitude <= 1:
            raise ConfigError(
                f"The amplitude, a share of the torque limit, must lie in (0, 1]; found {self.amplitude}."
            )
        if self.hold < 1:
            raise ConfigError(f"A random torque must be held for at least 1 control period; found {self.hold}.")

    def controller(self, rng: np.random.Generator) -> Controller:
        """A fresh sequence of torques, drawn from `rng` as it goes."""
        amplitude = self.amplitude * self.torque_limit
        held, left = 0.0, 0

        def law(state: Array) -> float:
            nonlocal held, left
            if left == 0:
                held, left = float(rng.uniform(-amplitude, amplitude)), self.hold
            left -= 1
            return held

        return law
