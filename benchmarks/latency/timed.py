"""The robot on a port as `twbal.link.serial_plant` has it, which writes down when the robot took each command.

Both times of a command are of the robot's clock: of the measurement that it answers (`time_us`), and of its arrival at
the robot (`command_us`). The clock of a virtual robot is this computer's monotonic one. `link._target_` of a stage
names `open_timed`; so the loop that is timed is that of the stage itself.
"""

import time
from array import array
from math import isnan
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from twbal.core.errors import LinkLostError
from twbal.core.plant import Observation
from twbal.link.serial_plant import SerialPlant
from twbal.link.transport import SerialTransport

ARMED = ".armed"
"""Ending of the file that appears beside the times when the robot is armed."""


class TimedPlant(SerialPlant):
    """A robot whose times are written to a file when it is closed.

    Attributes:
        file: for them; None: they are kept.
        measured, taken: of each command, on the robot's clock modulo 2³² [µs].
        stopped: when the robot had confirmed that its motors are off, on this computer's monotonic clock [s].
    """

    file: Path | None = None
    stopped = 0.0

    def reset(self, trial: int) -> Observation:
        """Arm it; see `SerialPlant.reset`."""
        self.measured, self.taken = array("q"), array("q")
        seen = super().reset(trial)  # which stops it first
        self.stopped = float("nan")
        if self.file is not None:
            Path(f"{self.file}{ARMED}").touch()
        return seen

    def step(self, command: float) -> Observation:
        """Command, and note both times; a command at which the robot stopped was not there in time."""
        before = self.telemetry
        try:
            seen = super().step(command)
        except LinkLostError:
            self._write_down(before.time_us, self.telemetry.time_us)
            raise
        self._write_down(before.time_us, self.telemetry.command_us)
        return seen

    def _write_down(self, measured: int, taken: int) -> None:
        self.measured.append(measured)
        self.taken.append(taken)

    def stop(self) -> None:
        """Stop it; see `SerialPlant.stop`."""
        super().stop()
        if isnan(self.stopped):
            self.stopped = time.monotonic()

    def close(self) -> None:
        """Close it, and write the times."""
        super().close()
        if self.file is not None and hasattr(self, "measured"):
            with open(self.file, "wb") as out:
                np.savez(out, measured=self.measured, taken=self.taken, stopped=self.stopped)


def open_timed(port: str, baud_rate: int, times: str, **settings: Any) -> TimedPlant:
    """The plant behind a port; see `SerialPlant.open`. Its times go to the file `times`."""
    plant = TimedPlant(SerialTransport(port, baud_rate), **settings)
    plant.file = Path(times)
    return plant


class Times(NamedTuple):
    """What was written.

    Attributes:
        measured, taken: (N,) of each command, on the robot's clock [µs].
        stopped: see `TimedPlant` [s].
    """

    measured: NDArray[np.int64]
    taken: NDArray[np.int64]
    stopped: float

    @classmethod
    def read(cls, file: Path) -> Self:
        """Those of a file."""
        with np.load(file) as found:
            return cls(found["measured"], found["taken"], float(found["stopped"]))

    @property
    def seconds(self) -> list[float]:
        """(N,) from the measurement until the command was there [s]."""
        return list(map(float, (self.taken - self.measured) % 2**32 * 1e-6))


def words(port: str, times: Path) -> list[str]:
    """Settings of a stage by which it drives the robot on a port, timed."""
    return [
        *("link=serial", f"link.port={port}", "link.confirm_placed=null", "heed_check=false"),
        *("link._target_=benchmarks.latency.timed.open_timed", f"+link.times={times}"),
    ]
