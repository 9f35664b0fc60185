"""The process of a live view: reads samples from standard input until it ends, and gives them to Rerun.

Its arguments are the robot's shape as JSON, and where to draw: `window`, an address or a path. It says `ready` once it
can draw, so that its start takes no time of a robot that balances.
"""

import json
import os
import sys
import time
from pathlib import Path

from twbal.viz.live.sample import SIZE, decoded
from twbal.viz.live.scene import Scene, save, show
from twbal.viz.live.shape import Shape
from twbal.viz.live.view import ADDRESS, READY, WINDOW

_LOOK = 0.05  # between two looks for samples [s]
_SHOWN, _KEPT = 0.05, 1.0  # time of what is drawn at once, in a viewer and in a file, which it makes smaller [s]
_NICE = 5  # drawing is less urgent than what else this computer does
_ROOM = 1 << 20  # read at once [bytes]


def main(shape: str, target: str) -> None:
    """Draw a drive of a robot of that shape."""
    robot = Shape(**json.loads(shape))
    if target == WINDOW or target.startswith(ADDRESS):
        scene, stream = show(robot, None if target == WINDOW else target)
        every = _SHOWN
    else:
        scene, stream = save(robot, Path(target))
        every = _KEPT
    print(READY, flush=True)
    os.nice(_NICE)
    _draw(scene, sys.stdin.fileno(), every)
    stream.disconnect()  # which flushes first


def _draw(scene: Scene, end: int, every: float) -> None:
    """Empty the queue soon after each sample, and draw what came in so much time [s]."""
    came, due = b"", time.monotonic() + every
    while data := os.read(end, _ROOM):
        came += data
        if time.monotonic() >= due:
            whole = len(came) - len(came) % SIZE
            scene.draw(decoded(came[:whole]))
            came, due = came[whole:], time.monotonic() + every
        time.sleep(_LOOK)
    scene.draw(decoded(came[: len(came) - len(came) % SIZE]))


if __name__ == "__main__":
    main(*sys.argv[1:])
