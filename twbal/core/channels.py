"""Which numbers make up the state x: a choice of configuration, never a constant of the code."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from twbal.core.errors import ConfigError
from twbal.core.feed_forward import NO_OFFSET, FeedForward, FeedForwardGenerator, FeedForwardOffset
from twbal.core.gaussian import Array
from twbal.core.plant import Observation
from twbal.core.reference import Reference

MEASURED_UNITS = {"tilt": "rad", "tilt_rate": "rad/s", "acceleration": "m/s²", "speed": "m/s", "yaw_rate": "rad/s"}
KINEMATIC_UNITS = {"position": "m", "position_integral": "m·s"}
"""Channels that follow from the speed without any model."""
MAX_POSITION_INTEGRAL = 10.0
"""The position's integral stays within ± this [wheel radii · s], so that a robot that is held cannot wind it up."""
DRIVING_INTEGRAL = 1.5
"""Times as fast the position's integral changes behind a reference that moves, or that the robot is more than a wheel
radius off: dry friction opposes the motion from the moment it begins, a slope lasts, and the integral of a policy that
was searched for standing is slow to make up for them."""
_TIME = Observation._fields.index("time")
_PAST_COMMAND = re.compile(r"command_([1-9])")


@dataclass(frozen=True)
class Channels:
    """The state channels by name, in order.

    `tilt`, `tilt_rate`, `acceleration` and `yaw_rate` are read off the observation. `speed` is the speed of the axle
    over ground [m/s], wheel_radius · (wheel_rate + tilt_rate), as encoders see the wheel relative to the body.
    `command_k` is the command [N·m] given k control periods ago (0 before the rollout began): with past commands in it,
    the state of a robot that reacts late is Markov again. `position` is how far the axle has rolled since the rollout
    began [m], wheel_radius · (wheel_angle + tilt) less its first value, and `position_integral` its integral over time
    [m·s]: both follow from the speed by kinematics, so that there is nothing to learn about them.

    Attributes:
        names: channel names; the paper's are ("tilt", "tilt_rate", "acceleration").
        wheel_radius: of the data sheet [m].
        control_period: [s]; needed for `position` and its integral only.

    Raises:
        ConfigError: a name is unknown or twice there, or a channel lacks one that it follows from.
    """

    names: tuple[str, ...]
    wheel_radius: float
    control_period: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "names", tuple(self.names))
        units = {**MEASURED_UNITS, **KINEMATIC_UNITS}
        unknown = [n for n in self.names if n not in units and not _PAST_COMMAND.fullmatch(n)]
        if unknown:
            known = ", ".join([*units, "command_1", "command_2", "..."])
            raise ConfigError(f"Unknown state channel {unknown[0]!r}; the channels are: {known}.")
        if len(set(self.names)) != len(self.names) or not self.names:
            raise ConfigError(f"State channels must be distinct and at least one; found {list(self.names)}.")
        lags = sorted(self.lags.values())
        if lags != list(range(1, len(lags) + 1)):
            raise ConfigError(
                f"Past commands must be command_1, command_2, ... without a gap; found {list(self.names)}."
            )
        self._check_kinematics()

    def _check_kinematics(self) -> None:
        for name, source in (("position", "speed"), ("position_integral", "position")):
            if name in self.names and source not in self.names:
                raise ConfigError(f"The state channel {name} follows from {source}; found {list(self.names)}.")
        if self.kinematic and not self.control_period > 0:
            raise ConfigError(
                f"The state channel {self.names[self.kinematic[0]]} needs the control period; found "
                f"{self.control_period} s."
            )

    @cached_property
    def lags(self) -> dict[str, int]:
        """Past-command channels and how many control periods each looks back."""
        return {n: int(m.group(1)) for n in self.names if (m := _PAST_COMMAND.fullmatch(n))}

    @property
    def measured(self) -> tuple[int, ...]:
        """Indices of the channels whose change is learned; past commands and kinematic channels are known exactly."""
        return tuple(i for i, n in enumerate(self.names) if n in MEASURED_UNITS)

    @property
    def kinematic(self) -> tuple[int, ...]:
        """Indices of the channels that follow from the speed."""
        return tuple(i for i, n in enumerate(self.names) if n in KINEMATIC_UNITS)

    @property
    def inputs(self) -> tuple[int, ...]:
        """Indices into (x, u) of what a change depends on: all but the kinematic channels; the command comes last."""
        return tuple(i for i in range(len(self.names) + 1) if i not in self.kinematic)

    @property
    def units(self) -> tuple[str, ...]:
        """Unit of each channel."""
        return tuple({**MEASURED_UNITS, **KINEMATIC_UNITS}.get(n, "N·m") for n in self.names)

    def index(self, name: str) -> int:
        """Where a channel is in the state.

        Raises:
            ConfigError: the state does not have it.
        """
        return index_of(name, self.names)

    @property
    def transition_matrix(self) -> Array:
        """A (D, D + 1), what is known of x' without any model: x' = A (x, u) + P Δ, Δ being the measured changes.

        The identity for the measured channels; past commands are copied: command_1' = u, command_k' = command_{k-1}.
        The position p and its integral q follow from the speed v: p' = p + ½ dt (v + v') and q' = q + dt p.
        """
        matrix = np.zeros((len(self.names), len(self.names) + 1))
        for i in self.measured:
            matrix[i, i] = 1.0
        for name, lag in self.lags.items():
            source = len(self.names) if lag == 1 else self.names.index(f"command_{lag - 1}")
            matrix[self.names.index(name), source] = 1.0
        for i in self.kinematic:
            source = self.names.index("speed" if self.names[i] == "position" else "position")
            matrix[i, i], matrix[i, source] = 1.0, self.control_period
        return matrix

    @property
    def selection(self) -> Array:
        """P (D, E): what the change of each of the E measured channels adds to the state."""
        matrix = np.eye(len(self.names))[:, list(self.measured)]
        if "position" in self.names:
            matrix[self.names.index("position")] = 0.5 * self.control_period * matrix[self.names.index("speed")]
        return matrix

    def states(self, observations: Array, commands: Array) -> Array:
        """The states of a whole rollout, (T + 1, D).

        Args:
            observations: (T + 1, 7) in the order of `Observation`.
            commands: (T,) [N·m].
        """
        seen = Observation(*observations.T)
        values = self.measured_values(seen)
        path = self.path(seen)
        values["position"] = path - path[0]
        values["position_integral"] = self._integrals(values["position"], observations[:, _TIME])
        for name, lag in self.lags.items():
            values[name] = np.concatenate([np.zeros(lag), commands])[: len(observations)]
        return np.column_stack([values[n] for n in self.names])

    def path(self, seen: Observation) -> Any:
        """Way that the wheels have rolled over ground, from wherever the encoders count [m]; see `measured_values`."""
        return self.wheel_radius * (seen.wheel_angle + seen.tilt)

    def integrated(self, integral: float, position: float, duration: float) -> float:
        """The position's integral [m·s] after it stood at `position` [m] for `duration` [s]."""
        bound = self.max_position_integral
        return min(max(integral + duration * position, -bound), bound)

    @property
    def max_position_integral(self) -> float:
        """Bound of the position's integral, either way [m·s]."""
        return MAX_POSITION_INTEGRAL * self.wheel_radius

    def _integrals(self, positions: Array, times: Array) -> Array:
        found = np.zeros(len(positions))
        for t in range(1, len(found)):
            found[t] = self.integrated(found[t - 1], positions[t - 1], times[t] - times[t - 1])
        return found

    def measured_values(self, seen: Observation) -> dict[str, Any]:
        """The measured channels, as numbers or as columns, as `seen` is."""
        return {
            "tilt": seen.tilt,
            "tilt_rate": seen.tilt_rate,
            "acceleration": seen.acceleration,
            "speed": self.wheel_radius * (seen.wheel_rate + seen.tilt_rate),
            "yaw_rate": seen.yaw_rate,
        }


def index_of(name: str, names: Sequence[str]) -> int:
    """Where a channel is in a state.

    Args:
        name: of the channel.
        names: of the channels of the state.

    Raises:
        ConfigError: the state does not have it.
    """
    if name not in names:
        raise ConfigError(
            f"The state {', '.join(names)} has no {name}, which is needed here. Choose one that has it by state=..."
        )
    return names.index(name)


class StateTracker:
    """Makes the state of each observation of one rollout, as they come.

    Where the robot follows a reference, position and speed are less those of the reference: they are errors, and a
    policy that holds a place follows a moving one. While the reference gives way, the position's integral may shrink,
    but does not grow (conditional integration; Åström and Hägglund, Advanced PID Control, 2006, §3.5). While the
    reference moves, the integral changes `DRIVING_INTEGRAL` times as fast.

    With feed-forward a policy sees more errors: tilt, tilt rate and acceleration are less those that go with the
    reference's acceleration, past commands less the torque that was added to them, position and its integral, and speed
    less those of the axle of a robot that leans so (`FeedForwardOffset`). What is recorded stays less the reference
    alone.

    Attributes:
        for_policy: the last state as a policy is to see it, (D,).
    """

    def __init__(
        self, channels: Channels, reference: Reference | None = None, feed_forward: FeedForward | None = None
    ) -> None:
        self._channels = channels
        self._reference = reference
        self.for_policy = np.zeros(len(channels.names))
        self._generator = (
            FeedForwardGenerator(feed_forward) if reference is not None and feed_forward is not None else None
        )
        self._origin: float | None = None
        self._before = (0.0, 0.0)  # time and position at the last observation [s], [m]
        self._integral = 0.0

    def state(self, seen: Observation, past_commands: Sequence[float]) -> Array:
        """The state at one instant, (D,).

        Args:
            seen: the observation at that instant, which comes after those of earlier calls.
            past_commands: commands given so far, oldest first [N·m].
        """
        channels, reference = self._channels, self._reference
        path = channels.path(seen)
        if self._origin is None:
            self._origin, self._before = path, (seen.time, 0.0)
        values = channels.measured_values(seen)
        values["position"] = path - self._origin
        time, position = self._before
        if reference is None or not reference.gives_way or position * self._integral < 0:
            self._integral = self._integrated(position, seen.time - time)
        if reference is not None:
            motion = reference.follow(seen.time, values["position"], values["speed"])
            values["position"] -= motion.position
            values["speed"] -= motion.speed
            if self._generator is not None:
                self._generator.follow(motion.speed, seen.time - time)
        self._before = (seen.time, values["position"] - self.offset.position)
        values["position_integral"] = self._integral
        for name, lag in channels.lags.items():
            values[name] = past_commands[-lag] if lag <= len(past_commands) else 0.0
        state = np.array([values[n] for n in channels.names])
        self.for_policy = state if self._generator is None else state - self._offsets(self._generator.offsets)
        return state

    def _integrated(self, position: float, duration: float) -> float:
        """The position's integral [m·s] after an error of `position` [m] for `duration` [s]."""
        channels, reference = self._channels, self._reference
        is_faster = reference is not None and (reference.motion.is_moving or abs(position) > channels.wheel_radius)
        return channels.integrated(self._integral, (DRIVING_INTEGRAL if is_faster else 1.0) * position, duration)

    @property
    def offset(self) -> FeedForwardOffset:
        """What goes with the reference's acceleration now."""
        return self._generator.offsets[-1] if self._generator is not None and self._generator.offsets else NO_OFFSET

    def _offsets(self, past: Sequence[FeedForwardOffset]) -> Array:
        """The offset of each channel, (D,)."""
        now = past[-1]._asdict()
        added = {name: past[-1 - lag].torque for name, lag in self._channels.lags.items() if lag < len(past)}
        return np.array([added.get(name, now.get(name, 0.0)) for name in self._channels.names])
