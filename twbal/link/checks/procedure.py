"""All checks of a link, in the order in which they are safe: first without motors, then with little torque."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from twbal.core.check import Check, CheckStatus, problems
from twbal.core.errors import LinkError, MotorsOnError
from twbal.core.robot_parameters import RobotParameters
from twbal.link.checks.by_hand import SIGNS_BY_HAND, Helper, by_hand_checks
from twbal.link.checks.line import clock_check, handshake_check, loss_check, round_trip_check
from twbal.link.checks.motors import Pulse, dead_time_check, pulse_commands, torque_check, turning_check
from twbal.link.checks.rest import rest_check
from twbal.link.checks.safety import stop_check, watchdog_check
from twbal.link.checks.telemetry_record import HostClock, Pings, ping, record
from twbal.link.protocol import Clock, Sensors
from twbal.link.serial_plant import SerialPlant
from twbal.link.sheet_check import limit_check
from twbal.link.wheel_commands import WheelCommands

MUST_HOLD = ("stop", "watchdog")
"""Checks before a torque is held for longer than a control period."""

_BROKEN = "Is this computer busy, or a plug loose? `twbal doctor` looks at the computer."
_NOBODY = Helper(lambda what: None, lambda found: False, lambda line: None)


@dataclass(frozen=True)
class LinkTrial:
    """How a link is tried.

    Attributes:
        exchanges: messages whose answers are timed.
        rest: how long the robot is armed without torque [s].
        pulse: torque of a pulse, as a share of the lower one of the robot's and the sheet's limits.
        pulse_time: how long it lasts, at most 0.3 s [s].
        is_held: somebody holds the robot, with its wheels off the ground.
        by_hand: that person moves body and wheels, too.
        hand_time: how long each such motion may take [s].
    """

    exchanges: int
    rest: float
    pulse: float
    pulse_time: float
    is_held: bool
    by_hand: bool
    hand_time: float


@dataclass(frozen=True)
class LinkReport:
    """What came of it.

    Attributes:
        robot: name.
        version: of the protocol that it speaks.
        firmware: number of its build; 0: unknown.
        control_period: [s].
        torque_limit: [N·m].
        checks: in order.
        round_trips: [s].
        motors_may_be_on: the robot did not confirm in the end that they are off.
    """

    robot: str
    version: int
    firmware: int
    control_period: float
    torque_limit: float
    checks: tuple[Check, ...]
    round_trips: tuple[float, ...]
    motors_may_be_on: bool = False


def check_link(
    plant: SerialPlant,
    trial: LinkTrial,
    say: Callable[[str], None],
    helper: Helper = _NOBODY,
    clock: HostClock = time.monotonic,
    sheet: RobotParameters | None = None,
) -> LinkReport:
    """Try the robot; whatever happens, its motors are off at the end of each part.

    A part in which the link fails is a problem, and the parts after it are skipped; so is what drives the motors where
    Stop or the watchdog does not switch them off, and everything where the sheet is that of another robot.

    Args:
        plant: the robot, which nobody needs to place: its wheels are off the ground.
        trial: how.
        say: is told what comes next.
        helper: the person who holds the robot, and moves it by hand.
        clock: of the host.
        sheet: of the robot; None: there is none to be held against it.

    Raises:
        KeyboardInterrupt: the person pressed Ctrl-C.
    """
    pings: list[Pings] = []
    torque = trial.pulse * min(plant.torque_limit, sheet.torque_limit if sheet else plant.torque_limit)
    parts: dict[str, Callable[[], Iterator[Check]]] = {
        "line": lambda: _line(plant, trial, pings, clock),
        "rest": lambda: _rest(plant, trial, clock),
        "stop": lambda: iter([stop_check(plant, torque)]),
        "watchdog": lambda: iter([watchdog_check(plant, torque)]),
        "by hand": lambda: iter(_by_hand(plant, trial, helper)),
        "motors": lambda: _motors(plant, torque, trial.pulse_time),
    }
    checks: list[Check] = [handshake_check(plant), *([limit_check(plant, sheet)] if sheet else [])]
    failed, may_be_on = ("sheet" if problems(checks) else ""), False
    for name, part in parts.items():
        if failed:
            checks.append(Check(name, CheckStatus.SKIPPED, f"not tried after the problem of the part {failed!r}"))
            continue
        say(_part_in_words(name, trial))
        found, is_broken, may_be_on = _tried(plant, name, part)
        checks += found
        failed = name if is_broken or (name in MUST_HOLD and not _holds(plant, found)) else ""
    trips = pings[0].round_trips if pings else ()
    limits = (plant.control_period, plant.torque_limit)
    return LinkReport(plant.robot_name, plant.version, plant.firmware, *limits, tuple(checks), trips, may_be_on)


class _Part(NamedTuple):
    """What came of a part.

    Attributes:
        found: checks, at least one.
        is_broken: the link failed in it.
        may_be_on: the robot does not confirm after it that its motors are off.
    """

    found: list[Check]
    is_broken: bool
    may_be_on: bool


def _tried(plant: SerialPlant, name: str, part: Callable[[], Iterator[Check]]) -> _Part:
    """Do a part, and switch the motors off after it, however it ended."""
    found, is_broken, may_be_on = list[Check](), False, False
    try:
        found += part()
    except LinkError as error:
        found, is_broken, may_be_on = [_broken(name, error)], True, isinstance(error, MotorsOnError)
    try:
        plant.stop()
    except MotorsOnError as error:
        if not may_be_on:
            found.append(_broken("motors off", error))
        is_broken = may_be_on = True
    return _Part(found, is_broken, may_be_on)


def _holds(plant: SerialPlant, found: Sequence[Check]) -> bool:
    """Whether checks that must hold do; a robot in lockstep, which is a simulated one, has no watchdog to be tried."""
    if plant.clock is Clock.LOCKSTEP:
        return not problems(found)
    return all(check.verdict is CheckStatus.OK for check in found)


def _broken(name: str, error: LinkError) -> Check:
    return Check(name, CheckStatus.PROBLEM, str(error).rstrip("."), "", _BROKEN)


def _part_in_words(part: str, trial: LinkTrial) -> str:
    """What a part does, as a line."""
    words = {
        "line": f"{trial.exchanges} messages are timed",
        "rest": f"the sensors are watched for {trial.rest:g} s, without torque: keep the robot still",
        "stop": "a small torque, and Stop",
        "watchdog": "a small torque, and silence of the host",
        "by hand": "you lean the body, turn the wheels and the robot, without torque",
        "motors": "THE WHEELS TURN, twice as a rule",
    }
    return f"{part}: {words[part]}"


def _line(plant: SerialPlant, trial: LinkTrial, pings: list[Pings], clock: HostClock) -> Iterator[Check]:
    damaged = plant.bad_frames
    found = ping(plant, trial.exchanges, clock)
    pings.append(found)
    yield round_trip_check(found, plant.control_period)
    yield loss_check(found, plant.bad_frames - damaged)


def _rest(plant: SerialPlant, trial: LinkTrial, clock: HostClock) -> Iterator[Check]:
    rest = record(plant, [WheelCommands(0.0)] * round(trial.rest / plant.control_period), clock)
    yield clock_check(plant, rest)
    yield rest_check(rest, trial.is_held)


def _by_hand(plant: SerialPlant, trial: LinkTrial, helper: Helper) -> list[Check]:
    if trial.is_held and trial.by_hand:
        return by_hand_checks(plant, trial.hand_time, helper)
    why = "by_hand=false" if trial.is_held else "nobody can move a virtual robot, or one that places itself, by hand"
    advice = "Signs of tilt and encoders are not known: docs/your_robot.md has a table of them."
    return [Check(SIGNS_BY_HAND, CheckStatus.SKIPPED, why, "", advice)]


def _motors(plant: SerialPlant, torque: float, seconds: float) -> Iterator[Check]:
    ahead = _pulse(plant, WheelCommands(torque), seconds)
    sign = torque_check(plant, ahead)
    yield sign
    if sign.verdict is CheckStatus.PROBLEM:
        for name in ("dead time", "difference sign"):
            yield Check(name, CheckStatus.SKIPPED, f"not tried after the problem of the {sign.name}")
        return
    yield dead_time_check(plant, ahead)
    if plant.turns and plant.sensors & Sensors.WHEEL_DIFFERENCE:
        yield turning_check(_pulse(plant, WheelCommands(0.0, torque), seconds))
    else:
        yield Check("difference sign", CheckStatus.SKIPPED, "it does not turn, or does not tell its wheels apart")


def _pulse(plant: SerialPlant, command: WheelCommands, seconds: float) -> Pulse:
    commands = pulse_commands(command, seconds, plant.control_period)
    return Pulse(command, record(plant, [WheelCommands(0.0)] * len(commands)), record(plant, commands))
