"""How long after a key is pressed, or a stick is pushed, the robot has a command that shows it."""

import json
import math
import random
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.latency.answered import answers, moving
from benchmarks.latency.figures import distribution
from benchmarks.latency.person import GAMEPAD, RATE, Person
from benchmarks.latency.robot import robot

SETTLED = 6.0
"""After arming, by which the robot stands still [s]."""

_PAUSE, _HELD = (
    1.4,
    0.3,
)  # between two presses, in which the reference comes to rest, and for which a stick is pushed [s]
_PUSHED = 0.2  # share of the stick's way


def run(by: str, presses: int) -> dict[str, Any]:
    """Press so many keys, forward and backward in turn, each at another part of a control period."""
    draw = random.Random(1)
    with TemporaryDirectory() as folder, robot(RATE) as port:
        with Person(port, Path(folder), by) as person:
            person.wait(SETTLED)
            pressed = []
            for number in range(presses):
                pressed.append(_act(person, by, 1.0 if number % 2 == 0 else -1.0))
                person.wait(_PAUSE + draw.uniform(0.0, 2.0 / RATE))
            person.press(b"q") if by != GAMEPAD else person.lose_pad()
        episode, times = person.recorded()
    assert episode.references is not None
    count = len(times.taken)
    found = answers(pressed, times.measured, times.taken, moving(episode.references)[:count])
    heard = [each for each in found if math.isfinite(each)]
    if not heard:
        raise SystemExit(f"None of {presses} presses was answered in a drive of {episode.duration:.1f} s.")
    return {
        "presses": presses,
        "unanswered": sum(each == math.inf for each in found),
        "unclear": sum(map(math.isnan, found)),
        **distribution(heard, 2.0 / RATE),
    }


def _act(person: Person, by: str, way: float) -> float:
    if by != GAMEPAD:
        return person.press(b"w" if way > 0 else b"s")
    now = person.push(way * _PUSHED)
    person.wait(_HELD)
    person.push(0.0)
    return now


if __name__ == "__main__":
    print(json.dumps(run(**json.loads(sys.argv[1]))))
