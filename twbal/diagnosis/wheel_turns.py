"""How far wheels in the air turn in short windows of recordings, and how far a model says they would."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from twbal.core.compiled import kernel
from twbal.core.errors import DataError
from twbal.core.gaussian import Array
from twbal.planar.actuation import EVEN, driver_torque
from twbal.planar.constants import Constants, constants
from twbal.planar.parameters import PlanarParameters
from twbal.planar.planar_plant import hold, standing
from twbal.planar.planar_state import STRAIGHT, PlanarState
from twbal.planar.sensing import encoder_angle, imu_settled
from twbal.sysid.model import Data
from twbal.sysid.recording import MEASURED

WINDOW = 0.3  # s, long beside the time in which wheels in the air reach their speed
_ANGLE = MEASURED.index("wheel_angle")
_FEWEST = 4  # windows
_SPAN = 2  # instants before and after a window's start, from which the speed there is taken


class Window(NamedTuple):
    """A stretch of a recording.

    Attributes:
        recording: number of the recording.
        begin: its first instant.
        rate: of the wheels there [rad/s].
    """

    recording: int
    begin: int
    rate: float


@dataclass(frozen=True, eq=False)
class Turns:
    """How far the wheels turned in each of K windows.

    Attributes:
        data: the recordings.
        windows: the K windows.
        length: of a window [control periods].
    """

    data: Data
    windows: Sequence[Window]
    length: int

    def off_by(self, planar: PlanarParameters) -> Array:
        """Measured less what a planar model turns from each window's start on, (K,) [rad]."""
        k = constants(planar, self.data.period / self.data.substeps)
        off = []
        for window in self.windows:
            recording = self.data.recordings[window.recording]
            angle = recording.measured[:, _ANGLE]
            turned = turned_angle(
                planar,
                k,
                recording.commands,
                window.begin,
                self.length,
                self.data.substeps,
                angle[window.begin],
                window.rate,
            )
            off.append(angle[window.begin + self.length] - turned)
        return np.array(off)

    @property
    def floor(self) -> float:
        """What the sensors' steps alone make windows be off by [rad]."""
        return float(max(2.0 * self.data.resolution[_ANGLE], 1e-6))


@kernel()
def turned_angle(
    p: PlanarParameters,
    k: Constants,
    commands: Array,
    begin: int,
    length: int,
    substeps: int,
    angle: float,
    rate: float,
) -> float:
    """Angle of the encoders to which the wheels turn from an angle [rad] and a rate [rad/s], after `length` periods."""
    s = standing(k, 0.0, 0.0, rate * k.radius, angle)
    torque = driver_torque(p, commands[max(begin - 1, 0)], begin * k.step * substeps)
    s = PlanarState(
        s.tilt, s.wheel, s.tilt_rate, s.wheel_speed, torque, s.rotor, s.rotor_speed, s.slip, s.position, torque, s.sway,
        s.sway_rate, s.x, s.y, s.left_joint, s.right_joint, s.left_ground, s.right_ground,
    )  # fmt: skip
    imu = imu_settled(k, s, 2 * substeps)
    for n in range(begin, begin + length):
        s = hold(p, k, s, commands, n, substeps, STRAIGHT, imu, EVEN)
    return encoder_angle(k, s)


def windows_of(data: Data) -> tuple[list[Window], int]:
    """Windows of all recordings, one after the other, and their length in control periods."""
    length = max(1, round(WINDOW / data.period))
    found = []
    for number, recording in enumerate(data.recordings):
        angle = recording.measured[:, _ANGLE]
        for begin in range(_SPAN, len(recording) - length, length):
            rate = (angle[begin + _SPAN] - angle[begin - _SPAN]) / (2 * _SPAN * data.period)
            found.append(Window(number, begin, float(rate)))
    if len(found) < _FEWEST:
        raise DataError(
            f"Wheels in the air are judged by how far they turn in windows of {WINDOW} s; found {len(found)} windows "
            f"of at least {_FEWEST}. Record for longer."
        )
    return found, length
