"""From the command to the torque of the motors."""

from math import floor

import numpy as np

from twbal.core.compiled import kernel
from twbal.core.gaussian import Array
from twbal.effects.slew_limit import Ramp, ramp
from twbal.planar.parameters import PlanarParameters
from twbal.planar.terms import drive

_ramp = kernel(is_kept=False, is_inlined=True)(ramp)

EVEN = np.zeros(0)
"""Instants of the commands of an even loop, each of which comes as its control period begins."""


@kernel(is_inlined=True)
def slew_limited(torque: float, demanded: float, most: float) -> Ramp:
    """The way of the driver's torque to what is demanded of it in one physics step, as of `ramp`."""
    return _ramp(torque, demanded, most)


@kernel(is_inlined=True)
def command_at(commands: Array, start: float, length: float) -> float:
    """Mean of a command sequence over a stretch of time, at most one control period long.

    As the mean moves smoothly with the stretch, so does the robot with a delay.

    Args:
        commands: (T,), each held for one control period; before the first the motors are idle.
        start: of the stretch, in control periods since the first command.
        length: of the stretch, in control periods.
    """
    first = floor(start)
    end = start + length
    last = len(commands) - 1
    before = 0.0 if first < 0 else commands[min(first, last)]
    beyond = end - (first + 1)
    if beyond <= 1e-9 * length:
        return before
    after = 0.0 if first + 1 < 0 else commands[min(first + 1, last)]
    return before + (after - before) * beyond / length


@kernel(is_inlined=True)
def command_between(commands: Array, instants: Array, past: int, start: float, length: float) -> float:
    """Mean over a stretch of time of a command sequence that comes at any instants.

    Args:
        commands: (T,), each held until the next one comes; before the first the motors are idle.
        instants: (T,) or more, at which they come, increasing [s].
        past: number of a command that comes at the start of the stretch, or later.
        start: of the stretch [s].
        length: of the stretch [s].
    """
    last, end = len(commands) - 1, start + length
    n = past
    while n >= 0 and instants[n] > start:
        n -= 1
    total, at = 0.0, start
    while at < end:
        until = end if n == last else min(end, instants[n + 1])
        if n >= 0:
            total += commands[n] * (until - at)
        at, n = until, min(n + 1, last)
    return total / length


@kernel()
def driver_torque(p: PlanarParameters, command: float, time: float) -> float:
    """What drivers, gears and motors make of a command [N·m].

    Args:
        p: the planar model.
        command: that arrives at the driver [N·m].
        time: since the rollout began [s].
    """
    return drive(p, command, time)


@kernel()
def equivalent_gain(p: PlanarParameters, commands: Array) -> float:
    """Mean slope of the driver's torque over commands, by its gain: how far they still have influence, 0 to 1.

    Booton's equivalent gain of a static nonlinearity, N = E[f'(u)] (statistical linearisation, 1954): the share of the
    commands that lie outside the dead zone and below the saturation.

    Args:
        p: the planar model.
        commands: (T,) [N·m].
    """
    e = 1e-6 * p.torque_limit
    total = 0.0
    for command in commands:
        total += driver_torque(p, command + e, 0.0) - driver_torque(p, command - e, 0.0)
    return total / (2.0 * e * len(commands) * p.torque_gain_gain)
