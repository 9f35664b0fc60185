"""Whether the line is fast, loses nothing, and both clocks agree."""

from math import isnan
from statistics import linear_regression, median

from twbal.core.check import Check, CheckStatus, Measurement
from twbal.link.checks.telemetry_record import Pings, TelemetryRecord
from twbal.link.protocol import Clock, Sensors
from twbal.link.serial_plant import SerialPlant

CONTROL_PERIOD = "control period by the robot's clock"
"""Measured by `clock_check`."""

_FEW = 0.01  # share of messages, or of periods, that may be lost without a rollout suffering much
_DRIFT = 0.02  # of the robot's clock against the host's; beyond any crystal or resonator
_SHORTEST = 0.5  # in which a drift shows [s]


def handshake_check(plant: SerialPlant) -> Check:
    """Who the robot says that it is, and what it lacks."""
    lacks = [str(sensor.name).lower().replace("_", " ") for sensor in Sensors if sensor not in plant.sensors]
    drives = "turns" if plant.turns else "does not turn"
    found = (
        f"{plant.robot_name!r} speaks version {plant.version}, control period {plant.control_period * 1e3:g} ms, at "
        f"most {plant.torque_limit:g} N·m, {drives}, clock {plant.clock.name.lower().replace('_', ' ')}; does not "
        f"measure: {', '.join(lacks) or 'nothing'}"
    )
    return Check("handshake", CheckStatus.OK, found)


def round_trip_check(pings: Pings, control_period: float) -> Check:
    """Whether answers come well within a control period.

    Args:
        pings: what was measured.
        control_period: of the robot [s].
    """
    name, expected = "round trip", f"99 % within half a control period, {control_period * 5e2:g} ms"
    if not pings.round_trips:
        return Check(name, CheckStatus.PROBLEM, "no message was answered", expected, "Is the line alive both ways?")
    trips = sorted(pings.round_trips)
    most = trips[min(len(trips) - 1, round(0.99 * len(trips)))]
    found = f"{median(trips) * 1e3:.2f} ms (median), {most * 1e3:.2f} ms (99 %), {trips[-1] * 1e3:.2f} ms (longest)"
    measured = (Measurement("round trip, median", median(trips), "s"), Measurement("round trip, 99 %", most, "s"))
    advice = "See `twbal doctor` for latency timer and priority; try a higher baud rate."
    if median(trips) > control_period:
        return Check(name, CheckStatus.PROBLEM, found, expected, advice)
    if most > control_period / 2:
        return Check(name, CheckStatus.WARNING, found, expected, advice, measured)
    return Check(name, CheckStatus.OK, found, measured=measured)


def loss_check(pings: Pings, bad_frames: int) -> Check:
    """Whether what is sent arrives whole, and in time.

    Args:
        pings: what was measured.
        bad_frames: damaged ones that the host got.
    """
    sent = len(pings.round_trips) + pings.lost
    damaged = f"{bad_frames} damaged here, {pings.dropped} dropped by the robot"
    found = f"{pings.lost} of {sent} lost, {pings.late} late, {damaged}"
    advice = "Check cable, plugs, ground and supply of the robot; try a lower baud rate."
    bad = pings.lost + bad_frames + pings.dropped
    verdict = CheckStatus.PROBLEM if bad > _FEW * sent else CheckStatus.WARNING if bad or pings.late else CheckStatus.OK
    return Check("losses", verdict, found, "none", "" if verdict is CheckStatus.OK else advice)


def clock_check(plant: SerialPlant, rest: TelemetryRecord) -> Check:
    """Whether the robot's clock runs as fast as the host's, and ticks as its control period says.

    Args:
        plant: the robot.
        rest: a recording.
    """
    name, expected = "clock", f"within {_DRIFT:.0%}"
    if plant.clock is Clock.LOCKSTEP:
        return Check(name, CheckStatus.SKIPPED, "in lockstep the robot's clock waits for the host")
    times, periods = rest.elapsed(), (rest.seen[-1].period - rest.seen[0].period) % 2**16
    if times[-1] < _SHORTEST or periods == 0:
        return Check(name, CheckStatus.SKIPPED, f"only {times[-1]:.2f} s were recorded; a drift needs {_SHORTEST:g} s")
    drift = linear_regression(rest.host_times, times).slope - 1.0
    tick = times[-1] / periods
    found = (
        f"the robot's is {abs(drift):.2%} {'fast' if drift > 0 else 'slow'}, its period {tick * 1e3:.2f} ms, "
        f"{rest.missed} of {periods} periods missed, {rest.seen[-1].late} without a new command"
    )
    if isnan(drift) or abs(drift) > _DRIFT or abs(tick / plant.control_period - 1.0) > _DRIFT:
        advice = "Does `time_us` count microseconds, and is the announced control period that of the loop?"
        return Check(name, CheckStatus.PROBLEM, found, expected, advice)
    measured = (Measurement(CONTROL_PERIOD, tick, "s"), Measurement("drift of the robot's clock", drift, ""))
    if rest.missed > _FEW * periods:
        advice = "This computer, or the line, is late: `twbal doctor` looks for what makes it so."
        return Check(name, CheckStatus.WARNING, found, f"{_FEW:.0%} of periods missed at most", advice, measured)
    return Check(name, CheckStatus.OK, found, measured=measured)
