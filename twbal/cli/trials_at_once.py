"""Trials of virtual robots in lockstep, several at a time."""

import os
import threading
from collections.abc import Callable
from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor, wait
from dataclasses import replace
from pathlib import Path

import numpy as np
from omegaconf import DictConfig

from twbal.algorithm.rollout import Watch
from twbal.algorithm.settings import RolloutSettings
from twbal.cli.signals import stopped_once
from twbal.core.episode import Ending, Outcome
from twbal.core.heading import HeadingSample
from twbal.core.motion_profile import Motion
from twbal.core.plant import Observation
from twbal.link.protocol import Clock

IsStopping = Callable[[], bool]
"""Whether trials are to end, as one beside them failed or the person asked for it."""

_LEAST = 2  # trials for which starting another robot is worth it


def never() -> bool:
    """Nothing is to end."""
    return False


def robots_at_once(link: DictConfig, settings: RolloutSettings) -> int:
    """How many robots drive the trials: of virtual ones in lockstep as many as there are cores, else one.

    Seed and trial decide all of a rollout of a virtual robot: any number of them logs the same episodes.
    """
    waits = link.get("clock") == Clock.LOCKSTEP.name.lower() and not link.get("program")
    return max(min(os.cpu_count() or 1, settings.trials // _LEAST), 1) if waits else 1


def until(is_stopping: IsStopping, watch: Watch) -> Watch:
    """What `watch` says, or that the rollout ends."""

    def watching(seen: Observation, reference: Motion, heading: HeadingSample | None, command: float) -> Ending | None:
        if is_stopping():
            return Ending(Outcome.STOPPED, "stopped with the trials beside it")
        return watch(seen, reference, heading, command)

    return watching


def beside_each_other(
    drive: Callable[[RolloutSettings, IsStopping], list[Path]], settings: RolloutSettings, robots: int
) -> list[Path]:
    """The logs of all trials, which so many robots drive; once one trial fails, all end.

    Args:
        drive: drives a part of the trials, on a robot of its own, and returns their logs.
        settings: of all trials.
        robots: how many.

    Raises:
        TwbalError: what `drive` raised.
        KeyboardInterrupt: the person pressed Ctrl-C.
    """
    if robots == 1:
        return drive(settings, never)
    stopping = threading.Event()
    parts = [replace(settings, first_trial=int(n[0]), trials=len(n)) for n in np.array_split(settings.numbers, robots)]
    with stopped_once(), ThreadPoolExecutor(robots) as pool:
        try:
            running = [pool.submit(drive, part, stopping.is_set) for part in parts]
            wait(running, return_when=FIRST_EXCEPTION)
        finally:  # all are done, or the others are to end
            stopping.set()
    return [log for each in sorted(running, key=_was_only_stopped) for log in each.result()]


def _was_only_stopped(trials: Future[list[Path]]) -> bool:
    """Whether these trials ended because others did: then the error of those is the one to raise."""
    return isinstance(trials.exception(), KeyboardInterrupt)
