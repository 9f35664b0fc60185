"""What becomes of a drive whose input is lost while the robot drives."""

import json
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from benchmarks.latency.answered import moving
from benchmarks.latency.keys import SETTLED
from benchmarks.latency.person import GAMEPAD, KEYBOARD, RATE, Person
from benchmarks.latency.robot import robot
from benchmarks.latency.timed import Times
from twbal.core.episode import Episode

_PRESSES, _BETWEEN, _PUSHED = 3, 0.2, 0.37  # keys, 0.1 of the speed limit each, and the stick that does the same
_KEPT = 6  # times that this is asked for once more, by which the reference comes to it
_AFTER = 3.0  # for which a drive goes on after keys stop [s]
_NOT_OF_INPUT = ("the reference ", "the heading's reference ")  # that give way, and go on


def _drive(person: Person, by: str) -> float:
    """Get the robot going; returns when the last input was given [s]."""
    if by == GAMEPAD:
        now = person.push(_PUSHED)
        person.wait((_PRESSES + _KEPT) * _BETWEEN)
        return now
    for key in b"w" * _PRESSES + b"\r" * _KEPT:
        now = person.press(bytes([key]))
        person.wait(_BETWEEN)
    return now


def _no_key(person: Person) -> None:
    person.wait(_AFTER)
    person.press(b"q")


LOSSES: Mapping[str, tuple[str, Callable[[Person], float | None]]] = {
    "no key": (KEYBOARD, _no_key),
    "terminal closed": (KEYBOARD, Person.leave_terminal),
    "gamepad unplugged": (GAMEPAD, Person.lose_pad),
    "stop key": (KEYBOARD, lambda person: person.press(b"x")),
    "Ctrl-C": (KEYBOARD, lambda person: person.press(b"\x03")),
}
"""By what is lost: what is driven by, and how it is lost, which tells when; None: with the last key."""


def run(loss: str) -> dict[str, Any]:
    """Drive, lose the input, and look at what was logged."""
    by, lose = LOSSES[loss]
    with TemporaryDirectory() as folder, robot(RATE) as port:
        with Person(port, Path(folder), by) as person:
            person.wait(SETTLED)
            last = _drive(person, by)
            lost = lose(person)
        episode, times = person.recorded()
        found = after_loss(episode, times, last if lost is None else lost)
        found["events"] = [text.replace(f"{folder}/", "") for text in found["events"]]
        return {"exit_code": person.exit_code, "ends": lost is not None, **found}


def after_loss(episode: Episode, times: Times, lost: float) -> dict[str, Any]:
    """What a log says.

    Args:
        episode: of the drive.
        times: of its commands.
        lost: when the input was, on the robot's clock [s].

    Returns:
        Times since then, in s: of the command with the first event of the input, of the reference's rest, of the
        motors' end; None where it did not come. `speed` is that of the reference at the loss [m/s].
    """
    assert episode.references is not None
    since = (times.measured - int(lost * 1e6) + 2**31) % 2**32 * 1e-6 - 2**31 * 1e-6  # of each observation
    begun, taken = float(since[0]), since + np.asarray(times.seconds)
    moves = moving(episode.references)[: len(since)]
    (rests,) = np.nonzero((since > 0) & ~moves)
    told = [
        event  # of the observation before the loss, where the input was read after it
        for event in episode.events
        if begun + event.time > -1.0 / RATE and not event.text.startswith(_NOT_OF_INPUT)
    ]
    off = times.stopped - lost
    numbers = np.searchsorted(episode.observations[:, 0], [event.time - 1e-6 for event in told])
    noticed = [float(taken[number]) if number < len(taken) else off for number in numbers]
    return {
        "speed": round(float(episode.references[max(int(np.sum(since < 0)) - 1, 0), 1]), 3),
        "noticed": round(noticed[0], 3) if noticed else None,
        "at_rest": round(float(since[rests[0]]), 3) if rests.size else None,
        "motors_off": round(off, 3),
        "events": [event.text for event in told],
        "outcome": str(episode.outcome.value),
    }


if __name__ == "__main__":
    print(json.dumps(run(**json.loads(sys.argv[1]))))
