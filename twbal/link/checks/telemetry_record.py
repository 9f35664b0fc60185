"""What a robot says while it is sent given commands, or asked whether it is there."""

import math
import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

from twbal.core.errors import LinkError, LinkLostError
from twbal.link.protocol import Status, Stop, Telemetry
from twbal.link.serial_plant import SerialPlant
from twbal.link.telemetry_meaning import is_telemetry
from twbal.link.wheel_commands import WheelCommands

HostClock = Callable[[], float]
"""The host's time [s]."""

_PATIENCE = 0.25  # an answer that is not there by then is lost [s]
_LATE = 0.05  # after which the host sends a message again [s]


class TelemetryRecord(NamedTuple):
    """What came while the robot was armed; the first telemetry is that of the arming.

    Attributes:
        seen: telemetry, one a command that was answered, in order.
        host_times: when each arrived [s].
        missed: control periods without telemetry.
    """

    seen: tuple[Telemetry, ...]
    host_times: tuple[float, ...]
    missed: int

    def values(self, name: str) -> list[float]:
        """A measured value at each instant."""
        return [float(getattr(each, name)) for each in self.seen]

    def elapsed(self) -> list[float]:
        """The robot's clock since arming, whatever it wrapped at [s]."""
        total, times = 0, [0.0]
        for before, now in zip(self.seen, self.seen[1:], strict=False):
            total += (now.time_us - before.time_us) % 2**32
            times.append(total * 1e-6)
        return times


class Pings(NamedTuple):
    """Answers to Stop from a robot whose motors are off.

    Attributes:
        round_trips: time until each answer that came [s].
        late: of these, after the host would have sent again.
        lost: that never came.
        dropped: frames that the robot says it dropped meanwhile.
    """

    round_trips: tuple[float, ...]
    late: int
    lost: int
    dropped: int


def record(plant: SerialPlant, commands: Sequence[WheelCommands], clock: HostClock = time.monotonic) -> TelemetryRecord:
    """Arm the robot for trial 0, send commands, and stop it; shorter where it stops itself because of its tilt.

    Args:
        plant: the robot.
        commands: sum and difference, one each control period [N·m]; differences only where it turns.
        clock: of the host.

    Raises:
        LinkError: it does not arm, falls silent, or does not confirm that it has stopped.
    """
    plant.reset(0)
    seen, times = [plant.telemetry], [clock()]
    try:
        for command in commands:
            if not plant.telemetry.status & Status.ARMED:
                break
            if plant.turns:
                plant.steer(command.difference)
            plant.step(command.total)
            seen.append(plant.telemetry)
            times.append(clock())
    finally:
        plant.stop()
    return TelemetryRecord(tuple(seen), tuple(times), plant.missed_periods)


def ping(plant: SerialPlant, count: int, clock: HostClock = time.monotonic) -> Pings:
    """Send Stop to a robot whose motors are off, once each, and measure how long its answers take.

    It is the one message that a robot answers at once, in lockstep and in real time, and that moves nothing.

    Args:
        plant: the robot, not armed.
        count: of messages.
        clock: of the host.

    Raises:
        LinkLostError: the port is gone.
    """
    round_trips, counts, lost = [], list[int](), 0
    for _ in range(count):
        sent = clock()
        try:
            answer = plant.line.ask(Stop(plant.line.next_number()), _PATIENCE, is_telemetry, resend_after=math.inf)
        except LinkLostError:
            raise
        except LinkError:
            lost += 1
            continue
        round_trips.append(clock() - sent)
        if isinstance(answer, Telemetry):
            counts.append(answer.dropped)
    dropped = (counts[-1] - counts[0]) % 2**16 if counts else 0
    return Pings(tuple(round_trips), sum(trip > _LATE for trip in round_trips), lost, dropped)
