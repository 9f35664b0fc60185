"""How long the robot waits for each command, with a live view and without."""

import json
import os
import signal
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.latency.figures import distribution
from benchmarks.latency.keys import SETTLED
from benchmarks.latency.person import KEYBOARD, RATE, Person
from benchmarks.latency.robot import robot

VIEWS = {"none": (), "recording": ("view=file",), "stalled": ("view=file",)}
"""Words of the drive. A stalled view is stopped (SIGSTOP) once the robot stands, and reads nothing any more."""

_PROCESS = "twbal.viz.live"
_BETWEEN = 0.7  # two presses [s]


def run(view: str, seconds: float) -> dict[str, Any]:
    """Drive by keys for a time [s], forward and backward in turn."""
    with TemporaryDirectory() as folder, robot(RATE) as port:
        with Person(port, Path(folder), KEYBOARD, *VIEWS[view]) as person:
            person.wait(SETTLED)
            viewing = _child_of(person.pid) if view == "stalled" else None
            if viewing is not None:
                os.kill(viewing, signal.SIGSTOP)
            for number in range(round(seconds / _BETWEEN)):
                person.press(b"ws"[number % 2 : number % 2 + 1])
                person.wait(_BETWEEN)
            person.press(b"q")
            person.wait(SETTLED)
            if viewing is not None:
                os.kill(viewing, signal.SIGCONT)
        episode, times = person.recorded()
    return {"seconds": round(episode.duration, 2), **distribution(times.seconds, 1.0 / RATE)}


def _child_of(process: int) -> int:
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            parent = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
            words = (entry / "cmdline").read_text().split("\0")
        except OSError:  # it has ended
            continue
        if parent == process and _PROCESS in words:
            return int(entry.name)
    raise SystemExit(f"The drive has no process {_PROCESS}.")


if __name__ == "__main__":
    print(json.dumps(run(**json.loads(sys.argv[1]))))
