"""Whether the robot stops its motors when the host falls silent, and when it says Stop."""

from twbal.core.check import Check, CheckStatus
from twbal.core.errors import LinkError, LinkLostError
from twbal.link.message import Message
from twbal.link.protocol import VERSION, WATCHDOG, Clock, Command, Status, Stop, Telemetry
from twbal.link.serial_plant import SerialPlant
from twbal.link.telemetry_meaning import is_telemetry

_SILENCE = 0.2  # beyond the watchdog, in which the host says nothing [s]
_REASONS = {
    Status.TILT_STOPPED: "its tilt limit",
    Status.SENSOR_STOPPED: "a sensor that failed",
    Status.WATCHDOG_STOPPED: "its watchdog",
}
_STILL = "Hold it upright and still, and check the link again."
_AFTER_STOP = 0.3  # in which a command that follows Stop may be answered [s]


def watchdog_check(plant: SerialPlant, torque: float) -> Check:
    """Command a torque once and fall silent: the robot must stop its motors by itself.

    Args:
        plant: the robot.
        torque: [N·m].

    Raises:
        LinkError: it does not arm, or does not answer.
    """
    name = "watchdog"
    if plant.clock is Clock.LOCKSTEP:
        return Check(name, CheckStatus.SKIPPED, "a robot in lockstep waits for its host, and has none")
    plant.reset(0)
    try:
        plant.step(torque)
        answer = plant.telemetry
        heard = [each for each in plant.line.listen(WATCHDOG + _SILENCE) if isinstance(each, Telemetry)]
    finally:
        plant.stop()
    since = answer.command_us if plant.version == VERSION else answer.time_us
    return _judged(heard, since, plant.control_period)


def _judged(heard: list[Telemetry], since_us: int, period: float) -> Check:
    """What telemetry in the silence says, after a command at `since_us` of the robot's clock."""
    name, limit = "watchdog", WATCHDOG + 2 * period
    expected = f"motors off at most {WATCHDOG * 1e3:g} ms and two control periods after the last command"
    advice = "Do not drive this robot. Let its firmware switch the motors off 100 ms after the last valid command."
    if not heard:
        return Check(name, CheckStatus.PROBLEM, "the robot said nothing while the host was silent", expected, advice)
    off = next((each for each in heard if not each.status & Status.ARMED), None)
    if off is None:
        silent = (heard[-1].time_us - since_us) % 2**32 * 1e-6
        found = f"the motors were still on {silent * 1e3:.0f} ms after the last command"
        return Check(name, CheckStatus.PROBLEM, found, expected, advice)
    if (why := _stopped_by(off)) != _REASONS[Status.WATCHDOG_STOPPED]:
        advice = _STILL if why else "Let its firmware say by WATCHDOG_STOPPED that its watchdog did."
        found = f"not its watchdog switched it off, but {why or 'what it does not say'}"
        return Check(name, CheckStatus.PROBLEM, found, expected, advice)
    late = (off.time_us - since_us) % 2**32 * 1e-6
    torques = [each.applied for each in heard if (each.period - off.period) % 2**16 in range(1, 2**15)]
    found = f"motors off {late * 1e3:.0f} ms after the last command, by the robot's clock"
    if any(abs(torque) > 0.0 for torque in torques):  # NaN where it does not say
        return Check(name, CheckStatus.PROBLEM, f"{found}, but {torques[-1]:.3g} N·m were applied", expected, advice)
    return Check(
        name, CheckStatus.PROBLEM if late > limit else CheckStatus.OK, found, expected, advice if late > limit else ""
    )


def stop_check(plant: SerialPlant, torque: float) -> Check:
    """Command a torque and say Stop: the robot must confirm it, and follow no further command.

    Args:
        plant: the robot.
        torque: [N·m].

    Raises:
        LinkError: it does not arm, does not answer, or does not confirm in the end that it has stopped.
    """
    name, expected = "stop", "motors off at once, and no command followed until the next arming"
    advice = "Do not drive this robot. Let its firmware switch the motors off on Stop, as docs/protocol.md says."
    plant.reset(0)
    try:
        plant.step(torque)
        before = plant.telemetry
        answer = plant.line.ask(Stop(plant.line.next_number()), _AFTER_STOP, is_telemetry)
    finally:
        plant.stop()
    assert isinstance(answer, Telemetry)
    if not before.status & Status.ARMED:
        found = f"it was off before Stop came, by {_stopped_by(before) or 'what it does not say'}"
        return Check(name, CheckStatus.PROBLEM, found, expected, _STILL)
    if answer.status & Status.ARMED:
        return Check(name, CheckStatus.PROBLEM, "it answers Stop, and its motors stay on", expected, advice)
    if why := _stopped_by(answer):
        return Check(name, CheckStatus.PROBLEM, f"not Stop switched it off, but {why}", expected, advice)
    try:
        later = _answer_after_stop(plant)
    finally:
        plant.stop_again()
    if isinstance(later, Telemetry) and later.status & Status.ARMED:
        return Check(name, CheckStatus.PROBLEM, "a command after Stop switched it on again", expected, advice)
    return Check(name, CheckStatus.OK, "confirmed, and a command after it was not followed")


def _stopped_by(seen: Telemetry) -> str:
    """What a robot says that it stopped itself by, in words; empty where it says nothing."""
    return ", ".join(words for bit, words in _REASONS.items() if seen.status & bit)


def _answer_after_stop(plant: SerialPlant) -> Message | None:
    """What the robot says to a command of no torque; None where it refuses, or says nothing."""
    try:
        return plant.line.ask(Command(plant.line.next_number(), 0.0), _AFTER_STOP)
    except LinkLostError:
        raise
    except LinkError:
        return None
