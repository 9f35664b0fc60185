"""Faults of the link, of robot and host, in rollouts of the real host.

    python -m benchmarks.link_faults robot=virtual|firmware clock=lockstep|real_time [times=10] [kind=...]

Each kind of fault `times` times, or one kind. Trials are kept in outputs/bench/link_faults and not driven again; the
counts go to benchmarks/results/link_faults.json, and `python scripts/readme.py tables` makes tables of them. The
firmware is built into outputs/bench/link_faults/firmware (g++ and make).
"""

import json
import os
import shlex
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.link_faults.counts import counts
from benchmarks.link_faults.judging import judged
from benchmarks.link_faults.kinds import kinds
from benchmarks.link_faults.trial import Workplace
from twbal.core.files import write_atomically

DONE = Path("outputs/bench/link_faults")
RESULTS = Path("benchmarks/results/link_faults.json")
DEFAULTS = {"robot": "virtual", "clock": "lockstep", "times": "10", "kind": ""}
CHOICES = {"robot": ("virtual", "firmware"), "clock": ("lockstep", "real_time")}


def built() -> Path:
    """The firmware's program, as it is now."""
    folder = (DONE / "firmware").resolve()
    subprocess.run(["make", "-s", "-C", "firmware", f"BUILD={folder}", "all"], check=True)
    return folder / "robot_posix"


def settings_of(words: Sequence[str]) -> dict[str, str]:
    """The settings, checked."""
    settings = {**DEFAULTS, **dict(word.partition("=")[::2] for word in words)}
    known = {**CHOICES, "kind": ("", *kinds(settings["clock"]))}
    wrong = any(settings[name] not in choices for name, choices in known.items())
    if wrong or set(settings) != set(DEFAULTS) or not settings["times"].isdecimal():
        raise SystemExit(
            f"Settings are robot (virtual, firmware), clock (lockstep, real_time), times (a number) and kind (one of: "
            f"{'; '.join(kinds('lockstep'))}); found {shlex.join(words)}."
        )
    return settings


def main(words: Sequence[str]) -> None:
    """Run with settings of the form key=value."""
    settings = settings_of(words)
    os.environ["OMP_NUM_THREADS"] = "1"
    place = f"{settings['robot']} {settings['clock']}"
    file = DONE / f"{place.replace(' ', '_')}.jsonl"
    file.parent.mkdir(parents=True, exist_ok=True)
    known = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    done = {(trial["kind"], trial["trial"]) for trial in known}
    chosen = [kind for name, kind in kinds(settings["clock"]).items() if settings["kind"] in ("", name)]
    asked = [(kind, trial) for trial in range(int(settings["times"])) for kind in chosen]
    asked = [(kind, trial) for kind, trial in asked if (kind.name, trial) not in done]
    if asked:
        workplace = Workplace(settings["clock"], built() if settings["robot"] == "firmware" else None)
        try:
            for kind, trial in asked:
                with workplace.happened(kind, trial) as happened:
                    verdict = judged(happened, settings["clock"] == "real_time")
                known.append({"kind": kind.name, "trial": trial, **verdict.as_record()})
                with file.open("a") as stream:
                    stream.write(json.dumps(known[-1]) + "\n")
                if verdict.misses:
                    print(f"{kind.name}, trial {trial}: {'; '.join(verdict.misses)}", flush=True)
        finally:
            workplace.close()
    results: dict[str, Any] = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    results[place] = counts(known, kinds(settings["clock"]))
    write_atomically(RESULTS, json.dumps(results, indent=1) + "\n")
    print(f"{place}: {len(known)} trials, {sum(bool(trial['misses']) for trial in known)} not right", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
