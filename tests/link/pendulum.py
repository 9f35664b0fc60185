"""Small real things to test a link with: a pendulum, and a line in memory."""

import math
from collections.abc import Callable

import numpy as np

from twbal.core.plant import Observation, Plant
from twbal.link.transport import Transport
from twbal.virtual_robot.firmware import Firmware


class Pendulum(Plant):
    """A point mass on a massless stick of 1 m; each control period is one semi-implicit Euler step.

    Attributes:
        torques: given since the last reset; None is appended by a stop.
    """

    control_period = 0.02

    def __init__(self) -> None:
        self.torques: list[float | None] = []

    def reset(self, trial: int) -> Observation:
        self.torques = []
        self._tilt, self._rate, self._periods = float(np.random.default_rng(trial).normal(-0.17, 0.02)), 0.0, 0
        return self._observe()

    def step(self, command: float) -> Observation:
        self.torques.append(command)
        self._rate += self.control_period * (9.81 * math.sin(self._tilt) - command)
        self._tilt += self.control_period * self._rate
        self._periods += 1
        return self._observe()

    def stop(self) -> None:
        self.torques.append(None)

    def close(self) -> None:
        pass

    def _observe(self) -> Observation:
        seconds = self._periods * self.control_period
        return Observation(seconds, self._tilt, self._rate, 0.5, -self._tilt, -self._rate, 0.0)


class MemoryTransport(Transport):
    """A line to firmware in this process; the robot's clock advances by `us_per_read` with every look at the line.

    Attributes:
        to_robot, to_host: what the line does to bytes on their way.
        now_us: the robot's clock.
    """

    name = "memory"

    def __init__(self, firmware: Firmware, us_per_read: int = 0, now_us: int = 0) -> None:
        self.firmware = firmware
        self.to_robot: Callable[[bytes], bytes] = lambda data: data
        self.to_host: Callable[[bytes], bytes] = lambda data: data
        self.now_us = now_us
        self.closed = False
        self._us_per_read = us_per_read
        self._waiting = b""

    def read(self) -> bytes:
        self.pass_time(self._us_per_read)
        data, self._waiting = self._waiting, b""
        return data

    def write(self, data: bytes) -> None:
        self._waiting += self.to_host(self.firmware.receive(self.to_robot(data), self.now_us))

    def pass_time(self, us: int) -> None:
        self.now_us += us
        self._waiting += self.to_host(self.firmware.advance(self.now_us))

    def close(self) -> None:
        self.closed = True
