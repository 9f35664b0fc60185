"""Trials of virtual robots in lockstep, several at a time."""

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor, wait
from pathlib import Path

from omegaconf import DictConfig

from twbal.algorithm.rollout import Watch
from twbal.cli.console import say
from twbal.cli.signals import stopped_once
from twbal.core.episode import Ending, Episode, Outcome
from twbal.core.heading import HeadingSample
from twbal.core.motion_profile import Motion
from twbal.core.plant import Observation
from twbal.core.threads import cores
from twbal.link.protocol import Clock

WhyStop = Callable[[], str | None]
"""Why trials are to end now; None: they are not."""

Tell = Callable[[Episode], None]
"""Is called with each trial as soon as it is logged; trials that are driven at a time end in any order."""

_EACH = 2  # trials, at least, that make another robot worth its start
_OTHER_ROBOT = ("clock=", "firmware=")  # settings of a virtual robot that no longer waits, or must be alone


def go_on() -> str | None:
    """No reason to stop."""
    return None


def robots_at_once(link: DictConfig, trials: int, workers: int) -> int:
    """How many robots drive the trials: of virtual ones in lockstep up to one for two trials, of others one.

    Seed and trial decide all of a rollout of a virtual robot: any number of them logs the same episodes.

    Args:
        link: to the robot.
        trials: that are to be driven.
        workers: most robots; 0: one a core.
    """
    return max(min(workers or cores(), trials // _EACH), 1) if waits(link) else 1


def waits(link: DictConfig) -> bool:
    """Whether a link is to virtual robots that wait for their host, and of which there may be several."""
    is_alone = any(str(word).startswith(_OTHER_ROBOT) for word in link.get("overrides", ())) or link.get("program")
    return not is_alone and link.get("clock") == Clock.LOCKSTEP.name.lower()


def until(why_stop: WhyStop, watch: Watch) -> Watch:
    """What `watch` says, or that the rollout ends."""

    def watching(seen: Observation, reference: Motion, heading: HeadingSample | None, command: float) -> Ending | None:
        why = why_stop()
        return watch(seen, reference, heading, command) if why is None else Ending(Outcome.STOPPED, why)

    return watching


def one_at_a_time(tell: Tell) -> Tell:
    """The same for trials that are driven in several threads."""
    lock = threading.Lock()

    def tell_one(trial: Episode) -> None:
        with lock:
            tell(trial)

    return tell_one


def beside_each_other(drives: Sequence[Callable[..., list[Path]]]) -> list[Path]:
    """The logs of trials that are driven in a thread each; once one fails, or the person presses Ctrl-C, all end.

    Args:
        drives: each drives some trials and returns their logs; asks `why_stop` before each and within them.

    Raises:
        TwbalError: what the first to fail raised; errors of others are said.
        KeyboardInterrupt: the person pressed Ctrl-C.
    """
    reasons, running = list[str](), list[Future[list[Path]]]()
    with stopped_once(), ThreadPoolExecutor(len(drives)) as pool:
        try:
            for drive in drives:
                running.append(pool.submit(drive, why_stop=lambda: reasons[0] if reasons else None))
            wait(running, return_when=FIRST_EXCEPTION)
            reasons.append("stopped, as a trial beside it failed")  # which nothing reads where none did
            wait(running)
        except KeyboardInterrupt:  # the only one that `stopped_once` lets through
            reasons.insert(0, "stopped by the person")
            wait(running)
    ends = [each.exception() for each in running]
    errors = [end for end in ends if end is not None and not isinstance(end, KeyboardInterrupt)]
    for error in errors[1:]:
        say(str(error))
    if errors:
        raise errors[0]
    if any(ends) or reasons[0] == "stopped by the person":
        raise KeyboardInterrupt
    return [log for each in running for log in each.result()]
