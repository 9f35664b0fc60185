"""A robot that a hand holds with its wheels off the ground, to rehearse `twbal check-link` without a board."""

import math
import os
import select
import time
from collections.abc import Callable
from typing import IO

import numpy as np
from numpy.typing import NDArray

from twbal.core.plant import Observation, Plant, WheelDifference
from twbal.core.robot_parameters import RobotParameters

FloatArray = NDArray[np.float64]

KEYS = {
    "l": "lean the body forward by 20°, and again back",
    "a": "turn the left wheel forward by a whole turn",
    "d": "turn the right wheel forward by a whole turn",
    "t": "turn the whole robot to the left by a quarter turn",
    "h": "hang for 3 s: it neither hears nor says anything",
}
"""What the hand does, by what is typed; Ctrl-C pulls the plug."""

_LEAN, _MOTION_TIME, _HANG = math.radians(20.0), 1.5, 3.0  # [rad], [s], [s]
_FASTEST = 30.0  # speed of a wheel in the air at the torque limit [rad/s]
_UPRIGHT = 0.02  # tilt at which it is held [rad]
_BIAS, _GYRO_NOISE, _TILT_NOISE = 0.01, 0.003, 5e-4  # [rad/s], [rad/s], [rad]


class Keys:
    """Lines that a person types, as far as they are there.

    Args:
        source: a file that may be waited for, such as a terminal.
    """

    def __init__(self, source: IO[str]) -> None:
        self._number: int | None = source.fileno()

    def pressed(self) -> str:
        """All characters since the last call; empty where there are none."""
        typed = ""
        while self._number is not None and select.select([self._number], [], [], 0.0)[0]:
            data = os.read(self._number, 1024)
            if not data:
                self._number = None
            typed += data.decode(errors="ignore")
        return typed


class HeldRobot(Plant):
    """A body in a hand, and two wheels that only their bearings brake.

    A wheel of inertia J gets half of the torques and a drag of b times its rate, which is solved exactly over a period.

    Args:
        robot: its sheet.
        pressed: what was typed since the last call.
        pause: waits for a time [s].
    """

    turns = True

    def __init__(
        self, robot: RobotParameters, pressed: Callable[[], str], pause: Callable[[float], None] = time.sleep
    ) -> None:
        self.control_period = robot.control_period
        self._pressed, self._pause = pressed, pause
        self._drag = robot.torque_limit / 2.0 / _FASTEST
        self._settling = robot.wheel_inertia / self._drag  # [s]
        self._rng = np.random.default_rng(0)
        self._held = np.zeros(4)  # lean, left wheel, right wheel, heading, where the hand has put them [rad]
        self._motions: list[tuple[float, FloatArray]] = []  # begin [s], by how much [rad]
        self._is_leaning, self._periods = False, 0
        self.reset(0)

    def reset(self, trial: int) -> Observation:
        """Let the wheels stand."""
        self._held = self._held + sum((by for _, by in self._motions), np.zeros(4))
        self._angle, self._rate, self._difference = np.zeros(2), np.zeros(2), 0.0
        self._motions, self._periods, self._turned = [], 0, 0.0
        self._hand = self._hand_before = self._held
        return self._observation()

    def steer(self, difference: float) -> None:
        """Set the difference of the torques."""
        self._difference = difference

    def step(self, command: float) -> Observation:
        """Turn the wheels by the torques, and let the hand do what was typed."""
        for key in self._pressed():
            self._begin(key)
        self.drive_until(self.control_period, command)
        self._periods, self._turned = self._periods + 1, 0.0
        self._hand_before, self._hand = self._hand, self._hand_now()
        return self._observation()

    def drive_until(self, time: float, command: float) -> None:
        """Turn the wheels up to a time within the control period [s]."""
        torques = np.array([command - self._difference, command + self._difference]) / 2.0
        duration = max(time - self._turned, 0.0)
        end, left = torques / self._drag, math.exp(-duration / self._settling)
        self._angle = self._angle + end * duration + (self._rate - end) * self._settling * (1.0 - left)
        self._rate = end + (self._rate - end) * left
        self._turned += duration

    def wheel_difference(self) -> WheelDifference:
        """How far the wheels are apart."""
        left, right = self._angle + self._hand[1:3]
        slow, fast = self._rate + self._hand_rate()[1:3]
        return WheelDifference(float(right - left), float(fast - slow))

    def stop(self) -> None:
        """Nothing turns the wheels but a step."""

    def close(self) -> None:
        """Nothing is held."""

    def _begin(self, key: str) -> None:
        lean = -_LEAN if self._is_leaning else _LEAN
        by = {
            "l": (lean, 0.0, 0.0, 0.0),
            "a": (0.0, math.tau, 0.0, 0.0),
            "d": (0.0, 0.0, math.tau, 0.0),
            "t": (0.0, 0.0, 0.0, math.pi / 2.0),
        }
        if key == "h":
            self._pause(_HANG)
        elif key in by:
            self._is_leaning ^= key == "l"
            self._motions.append((self._periods * self.control_period, np.array(by[key])))

    def _hand_now(self) -> FloatArray:
        """Where the hand has put body and wheels: smoothly, from rest to rest."""
        now = self._periods * self.control_period
        done = [(min((now - begin) / _MOTION_TIME, 1.0), by) for begin, by in self._motions]
        return self._held + sum((x**2 * (3.0 - 2.0 * x) * by for x, by in done), np.zeros(4))

    def _hand_rate(self) -> FloatArray:
        return (self._hand - self._hand_before) / self.control_period

    def _observation(self) -> Observation:
        rate = self._hand_rate()
        return Observation(
            time=self._periods * self.control_period,
            tilt=_UPRIGHT + float(self._hand[0]) + self._rng.normal(0.0, _TILT_NOISE),
            tilt_rate=_BIAS + float(rate[0]) + self._rng.normal(0.0, _GYRO_NOISE),
            acceleration=0.0,
            wheel_angle=float((self._angle + self._hand[1:3]).mean()),
            wheel_rate=float((self._rate + rate[1:3]).mean()),
            yaw_rate=float(rate[3]) + self._rng.normal(0.0, _GYRO_NOISE),
        )
