"""A robot that is held with its wheels in the air, as a plant, and ways in which firmware and lines fail it."""

import numpy as np

from twbal.core.plant import Observation, Plant, WheelDifference
from twbal.link.protocol import Status
from twbal.virtual_robot.firmware import Firmware

PERIOD = 0.02


class HeldRobot(Plant):
    """Two wheels of inertia I on bearings with viscous friction; the body is clamped. Euler steps.

    Args:
        signs: of left and right motor.
        delay: control periods by which torques act late.
        bias: of the gyro [rad/s].
        swapped: the left wheel gets what is meant for the right one.
        dead_zone: torque of a wheel that does not move it [N·m].
        noise: standard deviation of the gyro's noise [rad/s].
    """

    control_period = PERIOD
    turns = True

    def __init__(self, signs=(1.0, 1.0), delay=0, bias=0.01, swapped=False, dead_zone=0.0, noise=0.003):
        self._signs, self._delay, self._bias, self._swapped = np.array(signs), delay, bias, swapped
        self._dead_zone, self._noise = dead_zone, noise
        self._rng = np.random.default_rng(5)
        self.motion = lambda seconds: (0.0,) * 5  # tilt, its rate, angles of left and right wheel, yaw rate, by hand
        self.reset(0)

    def reset(self, trial):
        self._angle, self._rate = np.zeros(2), np.zeros(2)
        self._queue, self._periods, self._difference = [np.zeros(2)] * self._delay, 0, 0.0
        return self._observe()

    def steer(self, difference):
        self._difference = difference

    def step(self, command):
        wheels = np.array([command - self._difference, command + self._difference]) / 2
        wheels = wheels[::-1] if self._swapped else wheels
        self._queue.append(self._signs * np.where(np.abs(wheels) > self._dead_zone, wheels, 0.0))
        self._rate = self._rate + PERIOD * (self._queue.pop(0) - 0.02 * self._rate) / 0.05
        self._angle = self._angle + PERIOD * self._rate
        self._periods += 1
        return self._observe()

    def wheel_difference(self):
        left, right = self._angle + self.motion(self._periods * PERIOD)[2:4]
        return WheelDifference(float(right - left), float(self._rate[1] - self._rate[0]))

    def stop(self):
        pass

    def close(self):
        pass

    def _observe(self):
        now = self._periods * PERIOD
        lean, lean_rate, *wheels, yaw_rate = self.motion(now)
        before = self.motion(max(0.0, now - PERIOD))[2:4]
        tilt = 0.02 + lean + self._rng.normal(0.0, 5e-4)
        rate = self._bias + lean_rate + self._rng.normal(0.0, self._noise)
        angle = float((self._angle + wheels).mean())
        wheel_rate = float(self._rate.mean() + np.mean(np.subtract(wheels, before)) / PERIOD)
        return Observation(now, tilt, rate, 0.0, angle, wheel_rate, yaw_rate)


class SilentWatchdog(Firmware):
    """Never stops its motors for want of a command."""

    def _trip(self, reason):
        if reason is not Status.WATCHDOG_STOPPED:
            super()._trip(reason)


class TripsBeforeItsWatchdog(Firmware):
    """Stops itself 50 ms after the last command, for another reason than its watchdog, which it does not have."""

    reason = Status.TILT_STOPPED

    def _watch(self, now_us):
        if self._status & Status.ARMED and now_us > self._commanded_us + 50_000:
            self._trip(self.reason)


class TripsWithoutReason(TripsBeforeItsWatchdog):
    """The same, and does not say why."""

    reason = Status(0)


class TripsByTorque(Firmware):
    """Is beyond its tilt limit at each torque."""

    def _command(self, asked, now_us):
        if asked.total:
            self._trip(Status.TILT_STOPPED)
        return super()._command(asked, now_us)


class TripsAtStop(Firmware):
    """Answers Stop by saying that a sensor had stopped it."""

    def _disarm(self):
        super()._disarm()
        self._status = Status.SENSOR_STOPPED


class DeafToStop(Firmware):
    """Answers Stop as if it had been a command: its motors stay on."""

    def _disarm(self):
        if getattr(self, "_greeted", False) and getattr(self, "_status", Status(0)) & Status.ARMED:
            return
        super()._disarm()


class WakesUp(Firmware):
    """Confirms Stop, and lets the next command arm it again."""

    def _command(self, asked, now_us):
        self._status |= Status.ARMED
        return super()._command(asked, now_us)

    def _disarm(self):
        super()._disarm()
        self._standing = not getattr(self, "_greeted", False)


class WakesForGood(WakesUp):
    """The same, and nothing switches it off after that."""

    woken = False

    def _command(self, asked, now_us):
        self.woken = self.woken or not self._status & Status.ARMED
        return super()._command(asked, now_us)

    def _disarm(self):
        if not self.woken:
            super()._disarm()


def lossy(share, seed=3):
    """What a line does that loses a share of all frames."""
    rng = np.random.default_rng(seed)
    return lambda data: b"" if rng.random() < share else data


def damaging(share, seed=3):
    """What a line does that changes a bit of a share of all frames."""
    rng = np.random.default_rng(seed)

    def spoil(data):
        if not data or rng.random() >= share:
            return data
        spoilt = bytearray(data)
        spoilt[int(rng.integers(1, len(spoilt) - 1))] ^= 1 << int(rng.integers(8))
        return bytes(spoilt)

    return spoil
