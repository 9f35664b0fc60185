"""The firmware of `firmware/`, built for this computer, with a robot's physics behind its board layer.

The program holds the line to the host; its sensors and motors are two pipes. It says how far each control period has
gone, and asks for what is seen at its end, so that the physics' clock is the firmware's. Numbers travel as the
program's own machine has them: it runs on this one.
"""

import os
import select
import struct
import subprocess
import time
from collections.abc import Sequence
from math import nan
from pathlib import Path
from typing import IO

from twbal.core.errors import ConfigError
from twbal.core.plant import Observation, Plant
from twbal.virtual_robot.firmware import Identity, measured_by

_ORDER = struct.Struct("<cIIff")  # `PhysicsOrder`: kind, trial, time [µs], sum and difference of the torques
_ANSWER = struct.Struct("<14f")  # ten values of `Sensed`, four of a pose: `PhysicsAnswer`
_LOOK_ROUND = 0.5  # longest wait before looking whether the parent lives [s]
_STARTS = 10.0  # time in which the program must have said its port [s]
_GRACE = 2.0  # between asking the program to end and ending it [s]


def serve_firmware(program: Path, plant: Plant, identity: Identity, idle_timeout: float, parent: int) -> None:
    """Run the program as a robot until nobody needs it any more; its port is printed as `port <path>`.

    Args:
        program: `firmware/build/robot_posix`, made by `make -C firmware`.
        plant: what moves.
        identity: what the robot says of itself.
        idle_timeout: how long it waits for a host, the first or the next [s].
        parent: process that started this one.

    Raises:
        ConfigError: the program cannot be run, ended by itself, or does not say its port within 10 s.
    """
    try:
        process = subprocess.Popen(
            [str(program.resolve()), *_arguments(plant, identity, idle_timeout)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            bufsize=0,
        )
    except OSError as error:
        raise ConfigError(
            f"Cannot run the firmware {program}: {error.strerror}. Build it by `make -C firmware`, and give its "
            "build/robot_posix."
        ) from error
    assert process.stdin and process.stdout and process.stderr
    try:
        with plant, process.stdin, process.stdout, process.stderr:
            print(_said(process.stderr, program), flush=True)
            _Body(plant).attend(process.stdout, process.stdin, parent)
    finally:
        _end(process)


def _arguments(plant: Plant, me: Identity, idle_timeout: float) -> Sequence[str]:
    """As `boards/posix/main.cpp` reads them."""
    limits = (me.torque_limit, me.torque_limit if plant.turns else 0.0, me.tilt_limit)
    return [
        *(me.name, str(round(plant.control_period * 1e6)), *map(repr, map(float, limits))),
        *(str(round(me.watchdog * 1e6)), str(int(me.clock)), str(int(measured_by(plant))), str(float(idle_timeout))),
    ]


def _said(stream: IO[bytes], program: Path) -> str:
    data, end = b"", time.monotonic() + _STARTS
    while not data.endswith(b"\n") and select.select([stream], [], [], max(end - time.monotonic(), 0.0))[0]:
        byte = stream.read(1)  # not more: the stream is not buffered, and what follows is not for here
        if not byte:
            break
        data += byte
    line = data.decode(errors="replace").strip()
    if not line.startswith("port "):
        raise ConfigError(f"The firmware {program} does not start: {line or 'it says nothing'}.")
    return line


class _Body:
    """Answers the program's orders by the plant."""

    def __init__(self, plant: Plant) -> None:
        self._plant = plant

    def attend(self, orders: IO[bytes], answers: IO[bytes], parent: int) -> None:
        """While the program asks and the parent lives."""
        waiting = b""
        while os.getppid() == parent:
            if not select.select([orders], [], [], _LOOK_ROUND)[0]:
                continue
            data = os.read(orders.fileno(), 4096)
            if not data:
                return
            waiting += data
            while len(waiting) >= _ORDER.size:
                order, waiting = waiting[: _ORDER.size], waiting[_ORDER.size :]
                if answer := self._answer(*_ORDER.unpack(order)):
                    answers.write(answer)

    def _answer(self, kind: bytes, trial: int, since_us: int, total: float, difference: float) -> bytes:
        if kind == b"R":
            return self._seen(self._plant.reset(trial))
        if self._plant.turns:
            self._plant.steer(difference)
        if kind == b"P":
            self._plant.drive_until(since_us * 1e-6, total)
            return b""
        return self._seen(self._plant.step(total))

    def _seen(self, seen: Observation) -> bytes:
        apart, pose = self._plant.wheel_difference(), self._plant.pose()
        wheels = (apart.angle, apart.rate) if apart else (nan, nan)
        sensed = (seen.tilt, seen.tilt_rate, seen.acceleration, seen.wheel_angle, seen.wheel_rate, *wheels)
        return _ANSWER.pack(*sensed, seen.yaw_rate, nan, nan, *(pose or (nan,) * 4))


def _end(process: subprocess.Popen[bytes]) -> None:
    if process.poll() is None:
        process.terminate()
        try:
            process.wait(_GRACE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
