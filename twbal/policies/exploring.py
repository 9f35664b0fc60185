"""A policy with noise on its command, so that the data tell what each command does."""

import math
from dataclasses import dataclass
from itertools import count

import numpy as np

from twbal.core.errors import ConfigError
from twbal.core.gaussian import Array
from twbal.policies.policy import Controller, Policy


@dataclass(frozen=True)
class ExploringPolicy(Policy):
    """Adds white noise to another policy's command, and keeps the sum within its bounds.

    Attributes:
        policy: the policy that is disturbed.
        noise_sd: [N·m].
        max_command: [N·m].
        periods: control periods for which it is disturbed; from then on the other policy drives alone. None disturbs
        throughout.

    Raises:
        ConfigError: the noise or the bound is no number to drive a robot by.
    """

    policy: Policy
    noise_sd: float
    max_command: float
    periods: int | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.noise_sd < math.inf or not 0 < self.max_command < math.inf:
            raise ConfigError(
                f"Exploration needs a finite noise of 0 or more and a positive, finite bound of the command; found "
                f"{self.noise_sd} and {self.max_command} N·m."
            )

    def controller(self, rng: np.random.Generator) -> Controller:
        """The other policy's law with noise drawn from `rng`."""
        law = self.policy.controller(rng)
        left = count() if self.periods is None else iter(range(self.periods))

        def disturbed(state: Array) -> float:
            disturbance = 0.0 if next(left, None) is None else self.noise_sd * rng.standard_normal()
            command = law(state) + disturbance
            return float(np.clip(command, -self.max_command, self.max_command))

        return disturbed
