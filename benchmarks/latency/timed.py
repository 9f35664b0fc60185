"""The robot on a port as `twbal.link.serial_plant` has it, which writes down when the robot took each command.

Both times of a command are of the robot's clock: of the measurement that it answers (`time_us`), and of its arrival at
the robot (`command_us`). A robot of the tests has the monotonic clock of this computer. `link._target_` of a stage names
`open_timed`; so the loop that is timed is that of the stage itself.
"""

import time
from array import array
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

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

    def reset(self, trial: int) -> Observation:
        """Arm it; see `SerialPlant.reset`."""
        self.measured, self.taken, self.stopped = array("q"), array("q"), float("nan")
        seen = super().reset(trial)
        if self.file is not None:
            Path(f"{self.file}{ARMED}").touch()
        return seen

    def step(self, command: float) -> Observation:
        """Command, and note both times; a command that ends the rollout was not taken before the last telemetry."""
        before = self.telemetry
        self.measured.append(before.time_us)
        try:
            seen = super().step(command)
        except Exception:
            self.taken.append(self.telemetry.time_us)
            raise
        self.taken.append(self.telemetry.command_us)
        return seen

    def stop(self) -> None:
        """Stop it; see `SerialPlant.stop`."""
        super().stop()
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
    def seconds(self) -> NDArray[np.float64]:
        """(N,) from the measurement until the command was there [s]."""
        return (self.taken - self.measured) % 2**32 * 1e-6


def words(port: str, times: Path) -> list[str]:
    """Settings of a stage by which it drives the robot on a port, timed."""
    return [
        *("link=serial", f"link.port={port}", "link.confirm_placed=null", "heed_check=false"),
        *("link._target_=benchmarks.latency.timed.open_timed", f"+link.times={times}"),
    ]
