"""The model of the robot's dynamics: what f learned in simulation, plus the difference g that real data showed."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np

from twbal.core.channels import Channels
from twbal.core.errors import ConfigError, DataError
from twbal.core.gaussian import Array
from twbal.core.payload import Payload
from twbal.models.gp import GaussianProcess, Posterior


class OneStepPrediction(NamedTuple):
    """One-step prediction from m known states and commands.

    Attributes:
        mean: (m, D), of the next state.
        variance: (m, E), of the latent change of each measured channel (measurement noise is not in it); past commands
            have none.
    """

    mean: Array
    variance: Array


@dataclass(frozen=True, eq=False)
class DynamicsModel:
    """x_t = A (x_{t-1}, u_{t-1}) + P Δ, with Δ ~ f + g over the E measured channels (eq. 7 and 8).

    A and P are those of the channels; changes Δ do not depend on the kinematic ones.

    Attributes:
        channels: the state, D channels.
        f: of the change in simulation, E outputs over the d inputs of `Channels.inputs`.
        g: of the difference of the real robot from it, likewise; None before there is real data.
        keep_f_variance: count f's variance in; the paper drops it (below eq. 6).
        process_noise: (E,) variances by which the measured channels' own uncertainty grows at each step.
        observation_noise: (E,) variances that the sensors add to what is seen of them; the state does not grow by it.

    Raises:
        ConfigError: f or g does not fit the channels.
    """

    channels: Channels
    f: Posterior
    g: Posterior | None
    keep_f_variance: bool
    process_noise: Array
    observation_noise: Array

    def __post_init__(self) -> None:
        expected = (len(self.inputs), len(self.measured))
        for name, gp in (("f", self.f), ("g", self.g)):
            if gp is not None and (gp.inputs, gp.outputs) != expected:
                raise ConfigError(
                    f"The state {', '.join(self.names)} needs a model {name} with {expected[0]} inputs and "
                    f"{expected[1]} outputs; found {gp.inputs} and {gp.outputs}. Fit it anew with this state."
                )

    @property
    def has_simulation(self) -> bool:
        """Whether f says anything."""
        return bool(self.f.weights.any())

    @property
    def names(self) -> tuple[str, ...]:
        """Of the channels of the state, D."""
        return self.channels.names

    @property
    def measured(self) -> tuple[int, ...]:
        """Indices of the E channels whose change f and g predict."""
        return self.channels.measured

    @property
    def inputs(self) -> tuple[int, ...]:
        """Indices into (x, u) of the d numbers that f and g depend on."""
        return self.channels.inputs

    @property
    def transition_matrix(self) -> Array:
        """A, (D, D + 1)."""
        return self.channels.transition_matrix

    @property
    def selection(self) -> Array:
        """P, (D, E): what each GP output adds to the channels."""
        return self.channels.selection

    @property
    def sensor_variance(self) -> Array:
        """Variances that the sensors add to what is seen of each channel, (D,); zero for those that no sensor shows."""
        variance = np.zeros(len(self.names))
        variance[list(self.measured)] = self.observation_noise
        return variance

    @property
    def noise_variance(self) -> Array:
        """Noise of the one-step residual, (E,): g's where there is one, for it saw the real robot; else f's."""
        return (self.f if self.g is None else self.g).noise_variance

    def change(self, inputs: Array) -> Array:
        """Mean of Δ at `inputs` (m, D + 1), (m, E)."""
        seen = inputs[:, list(self.inputs)]
        mean = self.f.mean(seen)
        return mean if self.g is None else mean + self.g.mean(seen)

    def change_slope(self, inputs: Array) -> Array:
        """Gradient of the mean of Δ at `inputs` (m, D + 1), (m, E, D + 1)."""
        kept = list(self.inputs)
        slope = np.zeros((len(inputs), self.f.outputs, inputs.shape[1]))
        slope[:, :, kept] = self.f.slope(inputs[:, kept])
        if self.g is not None:
            slope[:, :, kept] += self.g.slope(inputs[:, kept])
        return slope

    def step_mean(self, states: Array, commands: Array) -> Array:
        """Mean of the next states, (m, D), from `states` (m, D) and `commands` (m,) [N·m].

        Raises:
            DataError: states or commands are of another shape.
        """
        inputs = self._inputs_of(states, commands)
        return inputs @ self.transition_matrix.T + self.change(inputs) @ self.selection.T

    def step_distribution(self, states: Array, commands: Array) -> OneStepPrediction:
        """Distribution of the next states from `states` (m, D) and `commands` (m,) [N·m], eq. 7.

        Raises:
            DataError: states or commands are of another shape.
        """
        inputs = self._inputs_of(states, commands)
        variance = np.zeros((len(inputs), self.f.outputs))
        if self.keep_f_variance:
            variance += self.f.predict(inputs[:, list(self.inputs)]).variance
        if self.g is not None:
            variance += self.g.predict(inputs[:, list(self.inputs)]).variance
        return OneStepPrediction(self.step_mean(states, commands), variance)

    def _inputs_of(self, states: Array, commands: Array) -> Array:
        """(x, u) of known states and commands, (m, D + 1)."""
        found, given = np.shape(states), np.shape(commands)
        if len(found) != 2 or found[1] != len(self.names) or given != found[:1]:
            raise DataError(
                f"A step needs states of shape (m, {len(self.names)}), with the channels {', '.join(self.names)} side "
                f"by side, and commands of shape (m,); found {found} and {given}."
            )
        return np.column_stack([states, commands])

    def to_payload(self) -> dict[str, Any]:
        """Plain values and arrays from which `from_payload` makes the same model."""
        return {
            "channels": list(self.names),
            "wheel_radius": float(self.channels.wheel_radius),
            "control_period": float(self.channels.control_period),
            "f": self.f.to_payload(),
            "g": None if self.g is None else self.g.to_payload(),
            "keep_f_variance": self.keep_f_variance,
            "process_noise": self.process_noise,
            "observation_noise": self.observation_noise,
        }

    @classmethod
    def from_payload(cls, payload: Mapping[str, Any]) -> Self:
        """The model that `to_payload` described.

        Raises:
            CheckpointError: an entry is missing, or cannot be one of a model.
            ConfigError: f or g does not fit the channels.
        """
        found = Payload("model", payload)
        f = posterior_from_payload(found["f"])
        g = found["g"]
        return cls(
            channels=Channels(
                found.texts("channels"),
                found.number("wheel_radius", 1e-9, 1e3),
                found.number("control_period", 0.0, 1e3) if "control_period" in found.names else 0.0,
            ),
            f=f,
            g=None if g is None else posterior_from_payload(g),
            keep_f_variance=found.flag("keep_f_variance"),
            process_noise=found.numbers("process_noise", (f.outputs,), 0.0),
            observation_noise=found.numbers("observation_noise", (f.outputs,), 0.0),
        )


def posterior_from_payload(payload: Mapping[str, Any]) -> Posterior:
    """The GPs that `Posterior.to_payload` described; those with the squared exponential kernel name none.

    Raises:
        CheckpointError: an entry is missing, or cannot be one of a GP.
    """
    if "kernel" not in Payload("GP", payload).names:
        return GaussianProcess.from_payload(payload)
    from twbal.models.kernels.kernel_process import KernelProcess  # here, as GPyTorch takes a while to import

    return KernelProcess.from_payload(payload)


def without_simulation(channels: Channels) -> DynamicsModel:
    """A model by which nothing changes: f is zero, and all is left to g."""
    d, E = len(channels.inputs), len(channels.measured)
    nothing = GaussianProcess(
        centres=np.zeros((1, d)),
        length_scales=np.ones((E, d)),
        signal_variance=np.ones(E),
        noise_variance=np.zeros(E),
        weights=np.zeros((E, 1)),
        variance_matrix=np.zeros((E, 1, 1)),
    )
    return DynamicsModel(channels, nothing, None, False, np.zeros(E), np.zeros(E))
