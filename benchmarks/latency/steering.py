"""Time `twbal drive` from a key or a stick to the command that shows it, and look what each loss of input does.

    python -m benchmarks.latency.steering [presses=50] [cases=keyboard,gamepad,stop_key]

The robot is the firmware's program over MuJoCo's physics in real time; its person sits at a pseudo-terminal, or pushes
the stick of a gamepad, a pipe of its events. The cases `view_...` time all commands with a live view and without; they
need the extra [viewers]. Takes some nine minutes. What is measured on this machine is not measured
again. Raw results go to benchmarks/results/steering_latency.json.
"""

import shlex
import sys
from collections.abc import Sequence

from benchmarks.latency.losses import LOSSES
from benchmarks.latency.person import GAMEPAD, KEYBOARD
from benchmarks.latency.viewed import VIEWS
from benchmarks.measure import Case, measure
from benchmarks.settings import text_settings

VIEWED = 60.0
"""For which a robot is driven with and without a live view [s]."""


def cases(presses: int) -> dict[str, Case]:
    """All of them, by name."""
    keys = {by: Case("benchmarks.latency.keys", {"by": by, "presses": presses}) for by in (KEYBOARD, GAMEPAD)}
    lost = {loss.replace(" ", "_"): Case("benchmarks.latency.losses", {"loss": loss}) for loss in LOSSES}
    viewed = {f"view_{view}": Case("benchmarks.latency.viewed", {"view": view, "seconds": VIEWED}) for view in VIEWS}
    return {**keys, **lost, **viewed}


def main(words: Sequence[str]) -> None:
    """Run with settings of the form key=value."""
    every = list(cases(0))
    usage = f"Settings are presses (a number from 1 on) and cases (of {', '.join(every)}); found {shlex.join(words)}."
    settings = text_settings({"presses": "50", "cases": ",".join(every)}, words, usage)
    presses, names = settings["presses"], settings["cases"].split(",")
    if not set(names) <= set(every) or not presses.isdecimal() or int(presses) < 1:
        raise SystemExit(usage)
    known = cases(int(presses))
    measure("steering_latency", [known[name] for name in names])


if __name__ == "__main__":
    main(sys.argv[1:])
