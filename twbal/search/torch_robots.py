"""Sampled robots that are driven beside each other, in PyTorch."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import torch

from twbal.core.cost import Cost
from twbal.core.gaussian import Array
from twbal.models.dynamics import DynamicsModel
from twbal.search.sampled_rollouts import Balanced, Draws, Limits
from twbal.search.torch_functions import Function, mean_function

_FAR = 1e3
"""No channel of a falling robot is followed beyond this."""


@dataclass(frozen=True)
class Robots:
    """P robots, each with a g of its own, and all that is random in H steps of them.

    Attributes:
        start: (P, D).
        process: (H, P, E), disturbances of the measured channels.
        sensors: (H, P, D), errors of what the policy sees.
        f: mean of the simulation model.
        g: difference model of each robot; None: there is none.
        inputs: (d,) indices into (x, u) of what f and g depend on.
        carry: Aᵀ (D + 1, D).
        selection: Pᵀ (E, D).
    """

    start: torch.Tensor
    process: torch.Tensor
    sensors: torch.Tensor
    f: Function
    g: Function | None
    inputs: torch.Tensor
    carry: torch.Tensor
    selection: torch.Tensor

    @classmethod
    def of(cls, model: DynamicsModel, g: Function | None, draws: Draws) -> "Robots":
        """Robots of a model with given difference models, starts and noises."""
        return cls(
            start=torch.tensor(draws.start),
            process=torch.tensor(draws.process),
            sensors=torch.tensor(draws.sensors),
            f=mean_function(model.f),
            g=g,
            inputs=torch.tensor(model.inputs),
            carry=torch.tensor(model.transition_matrix.T.copy()),
            selection=torch.tensor(model.selection.T.copy()),
        )

    def states(self, policy: Function) -> Iterator[torch.Tensor]:
        """The robots' states (P, D) at t = 1..H.

        Args:
            policy: commands (P,) [N·m] of states (P, D).
        """
        states = self.start
        for noise, seeing in zip(self.process, self.sensors, strict=True):
            inputs = torch.cat([states, policy(states + seeing)[:, None]], dim=1)
            seen = inputs[:, self.inputs]
            change = self.f(seen) + noise
            if self.g is not None:
                change = change + self.g(seen)
            states = (inputs @ self.carry + change @ self.selection).clamp(-_FAR, _FAR)
            yield states

    def balanced(self, command: Callable[[Array], Array], cost: Cost, limits: Limits) -> Balanced:
        """What `sampled_rollouts` tells, for models of any kernel.

        Args:
            command: of a policy: (P,) [N·m] of states (P, D).
            cost: of a state.
            limits: when a robot balances.
        """
        (steps, robots, _), costs = self.sensors.shape, np.zeros(len(self.start))
        standing, stayed = np.ones(robots, dtype=bool), np.ones(robots, dtype=bool)
        commands: list[Array] = []

        def law(seen: torch.Tensor) -> torch.Tensor:
            commands.append(command(seen.numpy()))
            return torch.from_numpy(commands[-1])

        with torch.no_grad():
            for step, states in enumerate(self.states(law)):
                tilt = np.abs(states[:, limits.tilt].numpy())
                standing &= tilt <= limits.limit
                stayed &= (step + 1 < limits.settle_step) | (tilt <= limits.settled_tilt_limit)
                if limits.position >= 0 and step + 1 >= limits.place_step:
                    stayed &= np.abs(states[:, limits.position].numpy()) <= limits.place_radius
                costs += np.where(standing, cost(states.numpy()), 1.0)
                if not standing.any():
                    costs += steps - step - 1
                    break
        changes = np.diff(commands[limits.settle_step :], axis=0)
        quiet = (changes**2).sum(axis=0) <= max(len(changes), 1) * limits.command_change**2
        return Balanced((standing & stayed & quiet).astype(float), costs / steps)
