"""The process that is a virtual robot."""

import os
import signal
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from types import FrameType

from twbal.core.plant import Plant
from twbal.virtual_robot.firmware import Firmware, Identity
from twbal.virtual_robot.pseudo_terminal import PseudoTerminal

_LOOK_ROUND = 0.5  # longest wait before looking whether the parent lives [s]
MOVE_EVERY = 0.001
"""Time after which the physics of a robot in real time goes on, so that little of it is left at a period's end [s]."""


def serve(plant: Plant, identity: Identity, idle_timeout: float, parent: int) -> None:
    """Be a robot behind a pseudo-terminal, until nobody needs it any more.

    Prints `port <path>` once a host may open it. Returns when no host has had the port open for a while, when its
    parent has ended, or on SIGTERM; the plant is closed on every way out.

    Args:
        plant: what moves.
        identity: what it says of itself.
        idle_timeout: how long it waits for a host, the first or the next [s].
        parent: process that started this one.
    """
    with plant, closing(PseudoTerminal()) as line, ended_by_signals():
        print(f"port {line.path}", flush=True)
        attend(line, Firmware(plant, identity), idle_timeout, parent)


def attend(line: PseudoTerminal, firmware: Firmware, idle_timeout: float, parent: int) -> None:
    """Pass bytes and time between `line` and `firmware` while the process `parent` lives and hosts come."""
    attended = time.monotonic()
    while os.getppid() == parent:
        data = line.read(_until(firmware.next_tick_us))
        now = time.monotonic()
        if data is None:
            firmware.host_gone()
            if now - attended > idle_timeout:
                return
            continue
        attended = now
        now_us = int(now * 1e6)
        answer = firmware.receive(data, now_us) + firmware.advance(now_us)
        if answer:
            line.write(answer)


def _until(tick_us: int | None) -> float:
    if tick_us is None:
        return _LOOK_ROUND
    return min(max(tick_us * 1e-6 - time.monotonic(), 0.0), MOVE_EVERY)


class _EndedError(BaseException):
    """A signal asked for the end."""


@contextmanager
def ended_by_signals() -> Iterator[None]:
    """Leave the body quietly on SIGTERM or SIGHUP."""

    def end(number: int, frame: FrameType | None) -> None:
        raise _EndedError

    before = {number: signal.signal(number, end) for number in (signal.SIGTERM, signal.SIGHUP)}
    try:
        yield
    except _EndedError:
        pass
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
