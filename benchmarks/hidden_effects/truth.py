"""The hidden robot behind the interface `Plant`, with faults, noise and encoders of its own."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from benchmarks.hidden_effects.faults import ALL, Hooks, Now
from benchmarks.hidden_effects.robot import GRAVITY, STEP, Body, Ride
from twbal.core.plant import Observation, Plant

_TICKS = 4096  # of an encoder, in a turn
_WINDOW = 1  # physics steps over which the encoders' timers measure a rate
_PLAY_STIFFNESS, _PLAY_DAMPING = 400.0, 0.6  # of the gears at either end of the play [N·m/rad], [N·m·s/rad]
_ROTORS = 0.5  # share of the wheels' inertia that is the rotors'


@dataclass(frozen=True)
class Sensors:
    """Noise of the sensors: standard deviations [rad], [rad/s], [rad/s]."""

    tilt: float = 0.002
    gyro: float = 0.01
    wheel_rate: float = 0.03


SENSORS = Sensors()


@dataclass(frozen=True)
class Surface:
    """What the robot drives on, and how it turns.

    Attributes:
        bumps: amplitude of the ground's slope [rad].
        length: of its waves [m].
        turn: yaw rate that is asked for [rad/s].
    """

    bumps: float = 0.0
    length: float = 0.7
    turn: float = 0.0


class HiddenRobot(Plant):
    """MuJoCo's robot with the faults that are named to it.

    Args:
        sheet: the data sheet, for its control period and torque limit.
        body: what the robot is made of.
        faults: by name, their parameters.
        surface: what it drives on.
        seed: of start poses and noise.
        sensors: their noise; without any, encoders have no ticks either.
    """

    def __init__(
        self,
        sheet: Any,
        body: Body,
        faults: Mapping[str, dict[str, float]],
        surface: Surface,
        seed: int,
        sensors: Sensors = SENSORS,
    ) -> None:
        self.control_period = sheet.control_period
        self._limit = sheet.torque_limit
        self._steps = round(sheet.control_period / STEP)
        self._faults, self._surface, self._seed, self._sensors = dict(faults), surface, seed, sensors
        for name, values in self._faults.items():
            change = ALL[name].body
            body = change(body, values) if change else body
        self._body = body
        self._hooks = Hooks()
        self._ride: Ride | None = None

    def reset(self, trial: int) -> Observation:
        """Begin rollout `trial`."""
        self._rng = np.random.default_rng([self._seed, trial])
        self._hooks = Hooks()
        for name, values in self._faults.items():
            act = ALL[name].act
            if act:
                act(self._hooks, values)
        if self._ride is None or self._hooks.slope != self._ride.slope:
            body = self._body
            if self._hooks.play:
                body = replace(body, wheel_inertia=(1 - _ROTORS) * body.wheel_inertia)
            self._ride = Ride(body, self._hooks.slope)
        tilt, rate, speed = self._rng.normal(0.0, [0.03, 0.05, 0.02])
        self._ride.place(tilt, rate, speed)
        self._time = self._position = 0.0
        self._rotor = np.array(self._ride.wheels()[0])
        self._rotor_rate = np.array(self._ride.wheels()[1])
        self._imu: deque[tuple[float, float]] = deque(maxlen=round(self._hooks.imu_delay / STEP) + 1)
        self._ticks: deque[float] = deque(maxlen=_WINDOW + 1)
        self._before = self._ride.speed()
        self._note()
        return self._observe()

    def step(self, command: float) -> Observation:
        """One control period."""
        clipped = min(max(float(command), -self._limit), self._limit)
        for _ in range(self._steps):
            self._advance(clipped)
            self._note()
        return self._observe()

    def stop(self) -> None:
        """Nothing turns between the steps of a simulation."""

    def close(self) -> None:
        """Nothing is held."""

    def motion(self) -> tuple[float, float, float, float, float]:
        """Tilt, tilt rate, speed, wheel angle relative to the body and position as they are, whatever sensors show."""
        ride = self._ride
        assert ride is not None
        return ride.tilt(), ride.tilt_rate(), ride.speed(), float(ride.wheels()[0].mean()), self._position

    def _advance(self, command: float) -> None:
        ride, hooks = self._ride, self._hooks
        assert ride is not None
        torque = command
        for link in hooks.command:
            torque = link(torque, self._time)
        angles, rates = ride.wheels()
        spin = ride.tilt_rate()
        now = Now(self._time, angles, rates, rates + spin, self._position, ride.speed())
        motors = 0.5 * torque * np.array([1 + self._body.uneven, 1 - self._body.uneven])
        if self._surface.turn:
            turn = 2.0 * (self._surface.turn * np.sin(0.9 * self._time) - ride.yaw_rate())
            motors = motors + np.array([-turn, turn])
        joints = self._through_play(motors, angles, rates) if hooks.play else motors
        housing = float(joints.sum() - motors.sum())
        for part in hooks.joint:
            joints = joints + part(now)
        outside = np.zeros(2)
        for part in hooks.ground:
            outside = outside + part(now)
        push = sum(part(now) for part in hooks.push)
        if self._surface.bumps:
            weight = (self._body.mass + 2 * self._body.wheel_mass) * GRAVITY
            push -= weight * self._surface.bumps * np.sin(2 * np.pi * self._position / self._surface.length)
        ride.step(joints, housing, outside, push)
        self._time += STEP
        self._position += STEP * ride.speed()

    def _through_play(self, motors: np.ndarray, angles: np.ndarray, rates: np.ndarray) -> np.ndarray:
        """Rotors that meet springs at either end of the gap."""
        ahead = self._rotor - angles
        beyond = ahead - np.clip(ahead, -0.5 * self._hooks.play, 0.5 * self._hooks.play)
        contact = np.where(beyond != 0.0, _PLAY_STIFFNESS * beyond + _PLAY_DAMPING * (self._rotor_rate - rates), 0.0)
        inertia = _ROTORS * self._body.wheel_inertia
        # The rotor's own motion, relative to the body that carries the motor.
        self._rotor_rate = self._rotor_rate + STEP * (motors - contact) / inertia
        self._rotor = self._rotor + STEP * self._rotor_rate
        return np.asarray(contact)

    def _note(self) -> None:
        ride = self._ride
        assert ride is not None
        self._imu.append((ride.tilt(), ride.tilt_rate()))
        self._ticks.append(float(ride.wheels()[0].mean()))

    def _observe(self) -> Observation:
        ride, rng, hooks, sensors = self._ride, self._rng, self._hooks, self._sensors
        assert ride is not None
        tilt, rate = self._imu[0]
        for change in hooks.gyro:
            rate = change(rate)
        for change in hooks.level:
            tilt = change(tilt)
        unit = 2 * np.pi / _TICKS
        angle = unit * np.round(self._ticks[-1] / unit) if sensors.tilt else self._ticks[-1]
        elapsed = STEP * (len(self._ticks) - 1)
        wheel_rate = (self._ticks[-1] - self._ticks[0]) / elapsed if elapsed else float(ride.wheels()[1].mean())
        speed = ride.speed()
        acceleration, self._before = (speed - self._before) / self.control_period, speed
        return Observation(
            time=round(self._time, 9),
            tilt=tilt + sensors.tilt * rng.standard_normal(),
            tilt_rate=rate + sensors.gyro * rng.standard_normal(),
            acceleration=acceleration,
            wheel_angle=float(angle),
            wheel_rate=float(wheel_rate + sensors.wheel_rate * rng.standard_normal()),
            yaw_rate=ride.yaw_rate() + sensors.gyro * rng.standard_normal(),
        )
