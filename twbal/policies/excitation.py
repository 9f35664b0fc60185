"""A balancing law with excitation on top, so that the data tell effects apart."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count
from typing import NamedTuple

import numpy as np

from twbal.core.compiled import kernel
from twbal.core.errors import ConfigError
from twbal.core.gaussian import Array
from twbal.policies.policy import Controller, Policy

_SINES, _SLOWEST, _FASTEST = 8, 0.2, 5.0  # of the multisine; frequencies in Hz
_BINARY_PERIODS = 5  # for which the pseudo-random binary torque keeps its sign
_LEG = 3.0  # time for which the robot is asked to drive one way, stand, or drive the other way [s]


class ExcitationLaw(NamedTuple):
    """The numbers of an `Excitation`, for kernels; see there.

    Attributes:
        by_tilt, by_tilt_rate, by_speed: k.
        fade_tilt: [rad].
        limit: u_max [N·m].
    """

    by_tilt: float
    by_tilt_rate: float
    by_speed: float
    fade_tilt: float
    limit: float


@kernel()
def excited_command(law: ExcitationLaw, tilt: float, rate: float, speed: float, drawn: Array) -> tuple[float, bool]:
    """The command [N·m] of an `Excitation`, and whether it was cut; `drawn` has what that yields for the period."""
    fade = min(max(2.0 - 2.0 * abs(tilt) / law.fade_tilt, 0.0), 1.0)
    command = fade * law.limit * drawn[1]
    command -= law.by_tilt * tilt + law.by_tilt_rate * rate + law.by_speed * (speed - drawn[0])
    return min(max(command, -law.limit), law.limit), abs(command) >= law.limit


@dataclass(frozen=True, eq=False)
class Excitation(Policy):
    """u = -kᵀ(x - x_asked(t)) + a(x) d(t), within ±u_max.

    The disturbance d is a multisine of 0.2-5 Hz with random phases and a pseudo-random binary torque; the speed that is
    asked for goes in steps forth, to rest and back. Near the tilt limit the disturbance fades, so that the robot stays
    up: a(x) falls from 1 at half of `fade_tilt` to 0 at it.

    Attributes:
        channels: names of the state channels; tilt, tilt_rate and speed are needed.
        gain: k for tilt [N·m/rad], tilt rate [N·m·s/rad] and speed [N·s].
        control_period: [s].
        max_command: u_max [N·m].
        multisine: standard deviation of the multisine, as a share of u_max.
        prbs: torque of the binary signal, likewise.
        speed: asked for at most [m/s].
        fade_tilt: where the disturbance has faded [rad].

    Raises:
        ConfigError: a channel is missing.
    """

    channels: tuple[str, ...]
    gain: tuple[float, float, float]
    control_period: float
    max_command: float
    multisine: float
    prbs: float
    speed: float
    fade_tilt: float

    def __post_init__(self) -> None:
        missing = [name for name in ("tilt", "tilt_rate", "speed") if name not in self.channels]
        if missing:
            raise ConfigError(
                f"Excitation balances by tilt, tilt_rate and speed; the state {', '.join(self.channels)} lacks "
                f"{', '.join(missing)}. Choose a state that has them by state=..."
            )

    @property
    def reach(self) -> float:
        """How far the asked speed takes the robot to one side of where it was put [m]."""
        return self.speed * _LEG

    @property
    def drift(self) -> float:
        """Speed with which a robot rolls off besides, for each radian by which it balances elsewhere [m/s/rad].

        Leaning there it needs no torque, so that -k_tilt · tilt - k_speed · (speed - asked) is 0.
        """
        return self.gain[0] / self.gain[2]

    @property
    def law(self) -> ExcitationLaw:
        """Its numbers."""
        return ExcitationLaw(*self.gain, self.fade_tilt, self.max_command)

    def controller(self, rng: np.random.Generator) -> Controller:
        """The law with a disturbance drawn from `rng`; it counts control periods from its first call."""
        places = [self.channels.index(name) for name in ("tilt", "tilt_rate", "speed")]
        drawn = self.drawn(rng)

        def excited(state: Array) -> float:
            asked, disturbance = next(drawn)
            off = state[places] - [0.0, 0.0, asked]
            fade = min(max(2.0 - 2.0 * abs(off[0]) / self.fade_tilt, 0.0), 1.0)
            command = -np.dot(self.gain, off) + fade * self.max_command * disturbance
            return float(np.clip(command, -self.max_command, self.max_command))

        return excited

    def drawn(self, rng: np.random.Generator) -> Iterator[tuple[float, float]]:
        """The asked speed [m/s] and the disturbance d(t) as a share of u_max, of one control period after the other."""
        frequencies = rng.uniform(_SLOWEST, _FASTEST, _SINES)  # [Hz]
        phases = rng.uniform(0.0, 2.0 * np.pi, _SINES)
        forth = rng.choice([-1.0, 1.0])
        size, sign = self.multisine * np.sqrt(2.0 / _SINES), 1.0
        for period in count():
            time = period * self.control_period
            if period % _BINARY_PERIODS == 0:
                sign = rng.choice([-1.0, 0.0, 1.0])
            asked = self.speed * forth * (0.0, 1.0, 0.0, -1.0)[int(time / _LEG) % 4]
            yield asked, size * np.sin(2.0 * np.pi * frequencies * time + phases).sum() + self.prbs * sign
