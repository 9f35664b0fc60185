"""A policy with noise on its command, so that the data tell what each command does."""

from dataclasses import dataclass

import numpy as np

from twbal.gaussian import Array
from twbal.policies.policy import Controller, Policy


@dataclass(frozen=True)
class ExploringPolicy(Policy):
    """Adds white noise to another policy's command, and keeps the sum within its bounds.

    Attributes:
        policy: the policy that is disturbed.
        noise_sd: [N·m].
        max_command: [N·m].
    """

    policy: Policy
    noise_sd: float
    max_command: float

    def controller(self, rng: np.random.Generator) -> Controller:
        """The other policy's law with noise drawn from `rng`."""
        law = self.policy.controller(rng)

        def disturbed(state: Array) -> float:
            command = law(state) + self.noise_sd * rng.standard_normal()
            return float(np.clip(command, -self.max_command, self.max_command))

        return disturbed
