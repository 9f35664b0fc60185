"""Random and mutated bytes into both decoders, and mutated sessions of the firmware beside a model of its states.

    python -m benchmarks.link_fuzz [bytes=10000000] [sessions=1000000] [workers=2]

Each decoder gets the bytes; the one of the firmware under sanitizers, with the robot behind it. The sessions are shared
by the workers. What came of it is in benchmarks/results/link_fuzz.json; what is there is not done again. Needs g++ and
make; the firmware is built into outputs/bench/link_fuzz.
"""

import json
import re
import subprocess
import sys
from collections.abc import Iterable, Iterator, Sequence
from ctypes import CDLL
from pathlib import Path
from typing import Any

from benchmarks.link_fuzz.harness import loaded
from benchmarks.link_fuzz.noise import decoded
from benchmarks.link_fuzz.sessions import Driven, driven
from benchmarks.settings import number_settings
from benchmarks.side_by_side import side_by_side
from twbal.core.files import write_atomically

FIRMWARE = Path(__file__).resolve().parents[2] / "firmware"
BUILT = Path("outputs/bench/link_fuzz")
RESULTS = Path("benchmarks/results/link_fuzz.json")
DEFAULTS = {"bytes": 10_000_000, "sessions": 1_000_000, "workers": 2}
SEED, BLOCK, AT_ONCE = 20, 500, 20_000  # of the bytes; sessions in a job; sessions between two records
_SAID = re.compile(
    r"fuzz: (\d+) bytes, (\d+) good frames after noise, (\d+) lost; (\d+) of (\d+) corrupt runs accepted"
)


def built() -> Path:
    """The folder of the firmware's fuzz program and its library, as it is now."""
    folder = BUILT.resolve()
    words = ["make", "-s", "-C", str(FIRMWARE), f"BUILD={folder}"]
    subprocess.run([*words, str(folder / "fuzz"), str(folder / "harness.so")], check=True)
    return folder


def in_cpp(program: Path, size: int) -> dict[str, Any]:
    """As `noise.decoded`, of the decoder in C++; sanitizers end it at the first fault."""
    said = subprocess.run([program, str(size), str(SEED)], capture_output=True, text=True, check=True).stdout
    found = _SAID.search(said)
    assert found is not None, said
    total, frames, lost, accepted, runs = map(int, found.groups())
    return {"bytes": total, "frames": frames, "lost": lost, "runs": runs, "accepted": accepted}


def sessions(robot: CDLL, first: int, count: int, workers: int) -> Driven:
    """Drive `count` sessions from number `first` on."""

    def work(jobs: Iterable[int]) -> Iterator[Driven]:
        for job in jobs:
            yield driven(robot, range(first + BLOCK * job, first + min(BLOCK * (job + 1), count)))

    blocks = list(side_by_side(work, -(-count // BLOCK), workers))
    return Driven(*map(sum, zip(*blocks, strict=True)))


def main(words: Sequence[str]) -> None:
    """Run with settings of the form key=value."""
    settings = number_settings(DEFAULTS, words)
    folder = built()
    results: dict[str, Any] = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    decoders = {"C++": lambda size: in_cpp(folder / "fuzz", size), "Python": lambda size: decoded(size, SEED)}
    for name, decode in decoders.items():
        if results.setdefault("decoders", {}).get(name, {}).get("bytes", 0) < settings["bytes"]:
            results["decoders"][name] = decode(settings["bytes"])
            _write(results)
    robot = loaded(folder / "harness.so")
    before = Driven(**results.get("sessions", dict.fromkeys(Driven._fields, 0)))
    while before.sessions < settings["sessions"]:
        count = min(AT_ONCE, settings["sessions"] - before.sessions)
        more = sessions(robot, before.sessions, count, settings["workers"])
        before = Driven(*map(sum, zip(before, more, strict=True)))
        results["sessions"] = before._asdict()
        _write(results)


def _write(results: dict[str, Any]) -> None:
    write_atomically(RESULTS, json.dumps(results, indent=1) + "\n")
    print(json.dumps(results), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
