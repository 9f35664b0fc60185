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
    settings = dict(word.partition("=")[::2] for word in words)
    presses = settings.get("presses", "50")
    known = cases(int(presses) if presses.isdecimal() else 0)
    names = settings["cases"].split(",") if "cases" in settings else list(known)
    unknown = sorted(set(settings) - {"presses", "cases"})
    if unknown or not set(names) <= set(known) or not presses.isdecimal() or int(presses) < 1:
        wrong = f"unknown settings: {', '.join(unknown)}. " if unknown else ""
        raise SystemExit(
            f"{wrong}Settings are presses (a number from 1 on) and cases (of {', '.join(known)}); found "
            f"{shlex.join(words)}."
        )
    measure("steering_latency", [known[name] for name in names])


if __name__ == "__main__":
    main(sys.argv[1:])
