"""The data sheet's regulator with integral action as a policy of the state."""

import numpy as np

from benchmarks.hidden_robots.data_sheet import regulator
from benchmarks.hidden_robots.robots import Workshop
from twbal.core.channels import Channels
from twbal.core.gaussian import Array
from twbal.core.plant import Observation
from twbal.policies.policy import Controller, Policy

CHANNELS = ("tilt", "tilt_rate", "speed", "position")


class IntegralPolicy(Policy):
    """The regulator, which reads observations, behind the interface of policies, which read states.

    Args:
        shop: whose data sheet it is of.

    Attributes:
        channels: of the state that it reads.
        max_command: [N·m].
    """

    def __init__(self, shop: Workshop) -> None:
        self._shop = shop
        self.channels = Channels(CHANNELS, shop.sheet.wheel_radius, shop.sheet.control_period)
        self.max_command = shop.sheet.torque_limit

    def controller(self, rng: np.random.Generator) -> Controller:
        """A regulator that remembers one rollout; nothing in it is random."""
        law, period, radius = regulator(self._shop), self._shop.sheet.control_period, self._shop.sheet.wheel_radius
        periods = 0

        def command(state: Array) -> float:
            nonlocal periods
            tilt, rate, speed, position = map(float, state)
            seen = Observation(periods * period, tilt, rate, 0.0, position / radius - tilt, speed / radius - rate, 0.0)
            periods += 1
            return law.command(seen)

        return command
