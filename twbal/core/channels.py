"""Which numbers make up the state x: a choice of configuration, never a constant of the code."""

import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from twbal.core.errors import ConfigError
from twbal.core.gaussian import Array
from twbal.core.plant import Observation

MEASURED_UNITS = {"tilt": "rad", "tilt_rate": "rad/s", "acceleration": "m/s²", "speed": "m/s", "yaw_rate": "rad/s"}
_PAST_COMMAND = re.compile(r"command_([1-9])")


@dataclass(frozen=True)
class Channels:
    """The state channels by name, in order.

    `tilt`, `tilt_rate`, `acceleration` and `yaw_rate` are read off the observation. `speed` is the speed of the axle
    over ground [m/s], wheel_radius · (wheel_rate + tilt_rate), as encoders see the wheel relative to the body.
    `command_k` is the command [N·m] given k control periods ago (0 before the rollout began): with past commands in it,
    the state of a robot that reacts late is Markov again.

    Attributes:
        names: channel names; the paper's are ("tilt", "tilt_rate", "acceleration").
        wheel_radius: of the data sheet [m].
    """

    names: tuple[str, ...]
    wheel_radius: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "names", tuple(self.names))
        unknown = [n for n in self.names if n not in MEASURED_UNITS and not _PAST_COMMAND.fullmatch(n)]
        if unknown:
            known = ", ".join([*MEASURED_UNITS, "command_1", "command_2", "..."])
            raise ConfigError(f"Unknown state channel {unknown[0]!r}; the channels are: {known}.")
        if len(set(self.names)) != len(self.names) or not self.names:
            raise ConfigError(f"State channels must be distinct and at least one; found {list(self.names)}.")
        lags = sorted(self.lags.values())
        if lags != list(range(1, len(lags) + 1)):
            raise ConfigError(
                f"Past commands must be command_1, command_2, ... without a gap; found {list(self.names)}."
            )

    @property
    def lags(self) -> dict[str, int]:
        """Past-command channels and how many control periods each looks back."""
        return {n: int(m.group(1)) for n in self.names if (m := _PAST_COMMAND.fullmatch(n))}

    @property
    def measured(self) -> tuple[int, ...]:
        """Indices of the channels that a sensor measures; the others are past commands, known exactly."""
        return tuple(i for i, n in enumerate(self.names) if n in MEASURED_UNITS)

    @property
    def units(self) -> tuple[str, ...]:
        """Unit of each channel."""
        return tuple(MEASURED_UNITS.get(n, "N·m") for n in self.names)

    def index(self, name: str) -> int:
        """Where a channel is in the state.

        Raises:
            ConfigError: the state does not have it.
        """
        if name not in self.names:
            raise ConfigError(
                f"The state {', '.join(self.names)} has no {name}, which is needed here. Choose one that has it by "
                "state=..."
            )
        return self.names.index(name)

    def state(self, seen: Observation, past_commands: list[float]) -> Array:
        """The state at one instant, (D,).

        Args:
            seen: the observation at that instant.
            past_commands: commands given so far, oldest first [N·m].
        """
        values = self._values(seen)
        for name, lag in self.lags.items():
            values[name] = past_commands[-lag] if lag <= len(past_commands) else 0.0
        return np.array([values[n] for n in self.names])

    def states(self, observations: Array, commands: Array) -> Array:
        """The states of a whole rollout, (T + 1, D).

        Args:
            observations: (T + 1, 7) in the order of `Observation`.
            commands: (T,) [N·m].
        """
        values = self._values(Observation(*observations.T))
        for name, lag in self.lags.items():
            values[name] = np.concatenate([np.zeros(lag), commands])[: len(observations)]
        return np.column_stack([values[n] for n in self.names])

    def _values(self, seen: Observation) -> dict[str, Any]:
        """The measured channels, as numbers or as columns, as `seen` is."""
        return {
            "tilt": seen.tilt,
            "tilt_rate": seen.tilt_rate,
            "acceleration": seen.acceleration,
            "speed": self.wheel_radius * (seen.wheel_rate + seen.tilt_rate),
            "yaw_rate": seen.yaw_rate,
        }
