"""What a policy is."""

from abc import ABC, abstractmethod
from collections.abc import Callable

import numpy as np

from twbal.gaussian import Array

Controller = Callable[[Array], float]
"""One rollout's law: from the state (D,) to the command [N·m]."""


class Policy(ABC):
    """Gives out a controller for each rollout.

    What a law must remember within a rollout (a held random torque, a noise stream) lives in its controller, so the
    policy itself never changes.
    """

    @abstractmethod
    def controller(self, rng: np.random.Generator) -> Controller:
        """The law for one rollout; whatever is random in it is drawn from `rng`."""
