"""Faults of the link, of robot and host, in rollouts of the real host.

    python -m benchmarks.link_faults robot=virtual|firmware clock=lockstep|real_time [times=10] [workers=1] [kinds=none]

Each kind of fault, or each of those named ("kinds=none;host killed"), `times` times. Trials are kept in
outputs/bench/link_faults and not driven again; what they came to is counted in benchmarks/results/link_faults.json, and
`python scripts/readme.py tables` makes tables of it. Most of a trial is waiting, so in lockstep several workers, each
with a robot and a line of its own, are faster than one. In real time a busy computer is a fault of its own: put
`chrt --fifo 10` before the command. The firmware is built into outputs/bench/link_faults/firmware (g++ and make).
"""

import json
import shlex
import subprocess
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

from benchmarks.link_faults.counts import counts
from benchmarks.link_faults.judging import judged, lateness
from benchmarks.link_faults.kinds import Kind, kinds
from benchmarks.link_faults.trial import Workplace
from benchmarks.settings import text_settings
from benchmarks.side_by_side import side_by_side
from twbal.core.files import write_atomically

FIRMWARE = Path(__file__).resolve().parents[2] / "firmware"
DONE = Path("outputs/bench/link_faults")
RESULTS = Path("benchmarks/results/link_faults.json")
DEFAULTS = {"robot": "virtual", "clock": "lockstep", "times": "10", "workers": "1", "kinds": ""}
LATE = {"real_time": 0.04, "lockstep": 0.2}  # a computer that is late by so much is a fault of its own [s]
AGAIN = 5  # so often a trial of a late computer is driven again
CHOICES = {"robot": ("virtual", "firmware"), "clock": ("lockstep", "real_time")}


def built() -> Path:
    """The firmware's program, as it is now."""
    folder = (DONE / "firmware").resolve()
    subprocess.run(["make", "-s", "-C", str(FIRMWARE), f"BUILD={folder}", "all"], check=True)
    return folder / "robot_posix"


def settings_of(words: Sequence[str]) -> dict[str, str]:
    """The settings, checked."""
    usage = (
        "Settings are robot (virtual, firmware), clock (lockstep, real_time), times and workers (numbers) "
        f"and kinds (some of: {'; '.join(kinds('lockstep'))}); found {shlex.join(words)}."
    )
    settings = text_settings(DEFAULTS, words, usage)
    wrong = any(settings[name] not in choices for name, choices in CHOICES.items())
    wrong = wrong or not set(_names(settings)) <= set(kinds("lockstep"))
    wrong = wrong or not all(settings[name].isdecimal() and int(settings[name]) for name in ("times", "workers"))
    if wrong:
        raise SystemExit(usage)
    return settings


def _names(settings: dict[str, str]) -> list[str]:
    return [name.strip() for name in settings["kinds"].split(";") if name.strip()]


def drive(settings: dict[str, str], asked: Sequence[tuple[Kind, int]]) -> Iterator[dict[str, Any]]:
    """Records of trials, as they end."""
    program = built() if settings["robot"] == "firmware" else None
    in_real_time = settings["clock"] == "real_time"

    def work(jobs: Iterable[int]) -> Iterator[dict[str, Any]]:
        with closing(Workplace(settings["clock"], program)) as workplace:
            for job in jobs:
                kind, trial = asked[job]
                yield {"kind": kind.name, "trial": trial, **_driven(workplace, kind, trial, in_real_time)}

    return side_by_side(work, len(asked), int(settings["workers"]))


def _driven(workplace: Workplace, kind: Kind, trial: int, in_real_time: bool) -> dict[str, Any]:
    """A trial, driven again where the computer was late by itself."""
    limit = LATE["real_time" if in_real_time else "lockstep"]
    for late in range(AGAIN + 1):
        with workplace.happened(kind, trial) as happened:
            found = {**judged(happened, in_real_time).as_record(), "late": late}
            if max(lateness(passed, in_real_time) for passed in (happened.passed, happened.passed_again)) < limit:
                break
    return found


def main(words: Sequence[str]) -> None:
    """Run with settings of the form key=value."""
    settings = settings_of(words)
    every = kinds(settings["clock"])
    place = f"{settings['robot']} {settings['clock']}"
    file = DONE / f"{place.replace(' ', '_')}.jsonl"
    file.parent.mkdir(parents=True, exist_ok=True)
    known = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    done = {(trial["kind"], trial["trial"]) for trial in known}
    chosen = [every[name] for name in _names(settings) or every]
    asked = [(kind, trial) for trial in range(int(settings["times"])) for kind in chosen]
    asked = [(kind, trial) for kind, trial in asked if (kind.name, trial) not in done]
    for found in drive(settings, asked) if asked else ():
        known.append(found)
        with file.open("a") as stream:
            stream.write(json.dumps(found) + "\n")
        if found["misses"]:
            print(f"{found['kind']}, trial {found['trial']}: {'; '.join(found['misses'])}", flush=True)
    results: dict[str, Any] = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    results[place] = counts(known, every)
    write_atomically(RESULTS, json.dumps(results, indent=1) + "\n")
    print(f"{place}: {len(known)} trials, {sum(bool(trial['misses']) for trial in known)} not right", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
