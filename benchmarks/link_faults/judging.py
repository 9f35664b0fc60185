"""Whether a trial went right, by the robot's own side and by what the line saw; nothing here asks the host."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from benchmarks.link_faults.frames import Said
from benchmarks.link_faults.kinds import PERIOD_US
from benchmarks.link_faults.line import Passed
from benchmarks.link_faults.trial import Happened
from twbal.core.episode import Episode
from twbal.io.logs import read_episode

LONGEST_MS = 105.0  # from the last valid command to torque 0: the watchdog, and a period of the safety loop
WATCHDOG_S, TIMEOUT_S = 0.1, 0.5  # of the robot, and of the host
_JITTER_S = 0.02  # a process may be late by this much
_PREFIX = "twbal: error: "


@dataclass(frozen=True)
class Verdict:
    """What became of a trial.

    Attributes:
        code: exit code.
        off_ms: by the robot's clock, from the last command that it took to where its motors got nothing; None where
            they never got anything [ms].
        error: what the command said, up to its first full stop.
        samples: of the episode that was kept.
        spoilt: frames that the faults took away or changed before the host said Stop.
        misses: what was not right.
    """

    code: int
    off_ms: float | None
    error: str
    samples: int
    spoilt: int
    misses: tuple[str, ...]

    def as_record(self) -> dict[str, Any]:
        """For a file."""
        return asdict(self)


def judged(done: Happened, in_real_time: bool) -> Verdict:
    """What became of a trial, and what was not right."""
    off = off_ms(done)
    episode = _episode(done)
    misses = [*_of_ending(done, in_real_time), *_of_motors(done, off), *_of_episode(done, episode), *_of_again(done)]
    error = " ".join(done.complaints).removeprefix(_PREFIX)
    return Verdict(
        done.code, off, error[:300], 0 if episode is None else len(episode), done.passed.spoilt, tuple(misses)
    )


def lateness(passed: Passed, in_real_time: bool) -> float:
    """By how much this computer was late: the robot's process, the line's, or the host's [s].

    In real time robot and line tell by the robot's clock, which is that of the computer. In lockstep the robot answers
    a command at once, and its lateness is the time from one to the other; the line's is that between two looks at it.
    The host tells by how long it takes to its next command when an answer has reached it.
    """
    if in_real_time:
        robots = [(round(now * 1e6) - said.time_us) % 2**32 * 1e-6 for now, said in passed.sent if said.is_armed]
    else:
        robots = [passed.blind, *_delays({n: now for now, n, _ in reversed(passed.reached)}, passed.sent)]
    answered: dict[int, float] = {}
    for now, said in passed.heard:
        answered.setdefault(said.seq, now)
    hosts = [passed.asked[n + 1] - now for n, now in answered.items() if n in passed.asked and n + 1 in passed.asked]
    return max([*robots, *hosts, 0.0])


def _delays(since: dict[int, float], answers: Sequence[tuple[float, Said]]) -> Iterator[float]:
    """From a message, by its number, to the first telemetry that answers it [s]."""
    for now, said in answers:
        if said.seq in since:
            yield now - since.pop(said.seq)


def off_ms(done: Happened) -> float | None:
    """How long the motors got something after the last command that the robot took [ms]."""
    driven = np.flatnonzero(done.torques)
    if not driven.size or not done.passed.sent:
        return None
    begin = done.passed.sent[0][1].time_us
    off = (int(driven[-1]) + 1) * PERIOD_US
    taken = max((said.command_us - begin) % 2**32 for _, said in done.passed.sent if _is_after(said, begin))
    return (off - taken) * 1e-3


def _is_after(said: Said, begin: int) -> bool:
    return (said.command_us - begin) % 2**32 < 2**31 and (said.is_armed or said.period > 0)


def _of_ending(done: Happened, in_real_time: bool) -> list[str]:
    kind, is_killed = done.kind, done.kind.act == "kill"
    if kind.right == "rides" and done.code:
        return [f"ended, though it can be ridden out: {' '.join(done.complaints)}"]
    if kind.right == "ends" and not done.code:
        return ["did not end"]
    if not done.code or is_killed:
        return []
    misses = []
    if done.code != 1 or len(done.complaints) != 1 or not done.complaints[0].startswith(_PREFIX):
        misses.append(f"exit code {done.code} with {len(done.complaints)} lines: {' '.join(done.complaints)[:200]}")
    if kind.because and not any(reason in " ".join(done.complaints) for reason in kind.because):
        misses.append(f"says another reason: {' '.join(done.complaints)[:200]}")
    if kind.right == "either" and not _had_to_end(done, in_real_time):
        misses.append(f"ended, though enough came through: {' '.join(done.complaints)[:200]}")
    return misses


def _had_to_end(done: Happened, in_real_time: bool) -> bool:
    """Whether so much was lost that the robot's watchdog ran out, or the host waited in vain."""
    passed = done.passed
    if in_real_time and longest_silence(passed.reached, passed.sent) > WATCHDOG_S - _JITTER_S:
        return True
    last = max(passed.commanded, default=None)
    if last is not None and _waited_in_vain(passed, last):
        return True
    return all(said.is_armed for _, said in passed.heard)  # nothing that came proved its Stop


def _waited_in_vain(passed: Passed, last: int) -> bool:
    """Whether the host stopped after no answer to its last command had come for as long as it waits.

    When it sent the command is known to lie between two looks at the line; on a busy computer they are far apart. The
    earlier one counts here.
    """
    until = min([now for now, said in passed.heard if said.seq == last] + [passed.stopping])
    return until - passed.unasked[last] >= TIMEOUT_S


def longest_silence(reached: Sequence[tuple[float, int, float]], sent: Sequence[tuple[float, Said]]) -> float:
    """The longest time without a new command that came through whole, while the robot drove [s]."""
    instants, newest = [sent[0][0]] if sent else [], -1
    for now, number, _ in reached:
        if number != newest:
            instants.append(now)
            newest = number
    instants += [now for now, said in sent[-1:]]
    return float(np.diff(sorted(instants)).max(initial=0.0))


def _of_motors(done: Happened, off: float | None) -> list[str]:
    misses = []
    if off is not None and off > LONGEST_MS:
        misses.append(f"torque for {off:.0f} ms after the last command")
    asked = {0.0, *(np.float32(total).item() for total in done.passed.commanded.values())}
    strange = sum(float(np.float32(torque)) not in asked for torque in done.torques)
    if strange:
        misses.append(f"{strange} torques that nobody asked for")
    return misses


def _episode(done: Happened) -> Episode | None:
    """What was kept of the rollout with the fault."""
    found = sorted(done.folder.glob("interrupted/*.mcap" if done.code == 1 else "episodes/*.mcap"))
    return read_episode(found[0 if done.code == 1 else -1]) if found else None  # a second start may have left others


def _of_episode(done: Happened, episode: Episode | None) -> list[str]:
    if episode is None:
        return ["no episode is kept"]
    answered = len({said.seq for _, said in done.passed.heard if said.is_armed} & set(done.passed.commanded))
    if done.code == 1 and len(episode) < answered - 1:  # the last one ended it
        return [f"{len(episode)} commands are kept of {answered} that were answered"]
    if not (done.code or done.kind.changes or episode.events) and done.passed.spoilt:
        return [f"{done.passed.spoilt} frames were spoilt, and the episode does not say so"]
    return []


def _of_again(done: Happened) -> list[str]:
    if done.again is None:
        return []
    misses = [f"the next start ends with {done.again}: {done.said_again[-200:]}"] if done.again else []
    if done.kind.act == "kill" and "kept" not in done.said_again:
        misses.append("the next start does not say what was kept")
    return misses
