"""One case: a robot is driven by `twbal real-rollout` for a while, beside a load."""

import json
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from benchmarks.latency.figures import distribution
from benchmarks.latency.load import busy
from benchmarks.latency.robot import ROOT, environment, period_of, policy, robot, twbal, without_priority
from benchmarks.latency.timed import ARMED, Times, words
from benchmarks.latency.withheld import withheld_share
from twbal.core.episode import Episode, Outcome
from twbal.io.logs import read_episode

HOSTS = ("real_time", "ordinary", "on_board")
"""What drives: the policy on the host, with and without real-time priority; or the policy on board, whose host has none
and is halted for a while again and again."""

HALT_EVERY, HALT = 10.0, 1.0  # of the host of a policy on board [s]
ROLLOUTS = 5
"""At most, where they end early."""

_ENDED_EARLY = (Outcome.TILT_LIMIT, Outcome.LINK_LOST)
_START, _LOOK = 120.0, 0.02  # how long the host may take to begin, and how often to look for that [s]
_END = 600.0  # how long it may take to write what it recorded, beside the load [s]
_BEYOND = 2.0  # for which a rollout may last longer than its steps [s]


class Driven(NamedTuple):
    """A rollout.

    Attributes:
        episode: its log.
        times: of its commands.
        withheld: share of the processors' time that a virtual machine did not have [%]; None where nothing counts it.
    """

    episode: Episode
    times: Times
    withheld: float | None

    @property
    def seconds(self) -> float:
        """By the robot's clock, late periods included [s]."""
        return float(self.episode.observations[-1, 0])

    @property
    def ended_early(self) -> bool:
        """Whether it fell, or the robot's watchdog switched it off, by which it falls."""
        return self.episode.outcome in _ENDED_EARLY


def run(load: int, host: str, rate: int, seconds: float) -> dict[str, Any]:
    """Drive a robot for `seconds`, in several rollouts where they end early.

    Args:
        load: programs that compute beside it.
        host: one of `HOSTS`.
        rate: of the control periods [Hz].
        seconds: in all, by the robot's clock.
    """
    rollouts: list[Driven] = []
    with robot(rate) as port:
        while len(rollouts) < ROLLOUTS and (left := seconds - _driven(rollouts)) > 1.0 / rate:
            rollouts.append(_rollout(port, load, host, rate, left, len(rollouts)))
    early = [each for each in rollouts if each.ended_early]
    return {
        "seconds": round(_driven(rollouts), 1),
        "rollouts": len(rollouts),
        "falls": len(early),
        "first_fall": round(early[0].seconds, 2) if early else None,
        "why": early[0].episode.events[-1].text if early and early[0].episode.events else "",
        "withheld": _longest(rollouts).withheld,
        **distribution([time for each in rollouts for time in each.times.seconds], 1.0 / rate),
    }


def _driven(rollouts: list[Driven]) -> float:
    return sum(each.seconds for each in rollouts)


def _longest(rollouts: list[Driven]) -> Driven:
    return max(rollouts, key=lambda each: each.seconds)


def _rollout(port: str, load: int, host: str, rate: int, seconds: float, trial: int) -> Driven:
    with TemporaryDirectory() as folder:
        out, times = Path(folder) / "run", Path(folder) / "times.npz"
        on_board = host == "on_board"
        told = [
            f"policy.path={policy(rate)}",
            period_of(rate),
            f"steps={round(seconds * rate)}",
            f"first_trial={trial}",
        ]
        told += [*words(port, times), f"link.on_board={str(on_board).lower()}", f"hydra.run.dir={out}"]
        command = [*([] if host == "real_time" else without_priority()), *twbal("real-rollout", *told)]
        with _host(command, times) as process, busy(load):
            withheld = withheld_share()
            _wait(process, times, seconds, halted=on_board)
            share = withheld()
        (log,) = out.glob("*/*.mcap")
        return Driven(read_episode(log), Times.read(times), share)


@contextmanager
def _host(command: list[str], times: Path) -> Iterator[subprocess.Popen[str]]:
    """The host, armed: from then on there is a load, which would make it start late only."""
    process = subprocess.Popen(
        command, cwd=ROOT, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    try:
        until = time.monotonic() + _START
        while not Path(f"{times}{ARMED}").exists():
            if process.poll() is not None or time.monotonic() > until:
                process.kill()
                raise SystemExit(f"{' '.join(command)} does not begin:\n{process.communicate()[0]}")
            time.sleep(_LOOK)
        yield process
        process.communicate(timeout=_END)
    finally:
        process.kill()
        process.wait()


def _wait(process: subprocess.Popen[str], times: Path, seconds: float, halted: bool) -> None:
    """Return when the rollout is over; the host, each of whose late steps takes longer, is asked to end it in time."""
    begun = time.monotonic()
    next_halt = begun + 0.5 * HALT_EVERY
    while not times.exists() and process.poll() is None:
        now = time.monotonic()
        if halted and now >= next_halt:
            next_halt += HALT_EVERY
            process.send_signal(signal.SIGSTOP)
            time.sleep(HALT)
            process.send_signal(signal.SIGCONT)
        if now - begun > seconds + _BEYOND:
            process.send_signal(signal.SIGINT)
            return
        time.sleep(_LOOK)


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # begun in the background, it and its host would ignore it
    print(json.dumps(run(**json.loads(sys.argv[1]))))
