"""Algorithm 1 over the firmware, with the policy on the host and on board, beside the virtual robot.

    python -m benchmarks.on_firmware [robots=default,hard_743,moderate_840] [updates=6]

Each robot is learned three times by `twbal iterate`: as twbal's own virtual robot, as the firmware's program with that
robot's physics behind its board layer (`link=firmware`), and the same with each policy built into it before its trials
(`link.on_board=true`). The clock is lockstep. `default` is the robot of `twbal iterate`; the others are hidden robots.

What comes before the first trial (f and policy 0, from simulation alone) is learned once and copied, as no robot is
driven for it; from there on all is done anew. Artefacts (models, policies, logs) are compared with those over the
virtual robot by their sha256, policies apart: a policy on board drives in single precision, to other bits of its logs.

Runs lie in outputs/bench/on_firmware/<robot>/<way>; one that is done is not done again. Raw results go to
benchmarks/results/on_firmware.json after each run. Needs g++ and make.
"""

import json
import shlex
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.hidden_robots.families import FAMILIES
from benchmarks.hidden_robots.record import iteration_records
from benchmarks.hidden_robots.robots import Workshop, iterate
from benchmarks.settings import text_settings
from twbal.cli.commands import text
from twbal.core.files import write_atomically

ROOT = Path("outputs/bench/on_firmware")
TARGET = Path("benchmarks/results/on_firmware.json")
DEFAULTS = {"robots": "default,hard_743,moderate_840", "updates": "6"}
VIRTUAL, HOST, ON_BOARD = WAYS = ("virtual", "host", "on_board")
_KEPT = ("index", "successes", "reason", "real_seconds", "trial_seconds")


class Hidden(NamedTuple):
    """A virtual robot, and the seed that it is learned with.

    Attributes:
        family: of `FAMILIES`.
        robot: which of it.
        seed: of `twbal iterate`.
    """

    family: str
    robot: int
    seed: int


def hidden(name: str) -> Hidden:
    """The robot of a name such as `hard_743`, or `default`; raises ValueError where there is none."""
    if name == "default":
        return Hidden("hard", 2, 0)
    family, _, number = name.rpartition("_")
    if FAMILIES[family].sheet != "paper":
        raise ValueError(f"robots of the sheet paper only; found {name}")
    return Hidden(family, int(number), int(number))


def words(robot: Hidden, way: str, build: Path) -> list[str]:
    """Settings of `twbal iterate` that learn a robot in one of the ways.

    Args:
        robot: which.
        way: one of `WAYS`.
        build: folder of the firmware's program.
    """
    faults = f"faults={FAMILIES[robot.family].faults}"
    chosen = [f'link.overrides=["idle_timeout=300","{faults}"]', f"link.seed={robot.robot}", f"seed={robot.seed}"]
    if way == VIRTUAL:
        return chosen
    program = f"link.program={text(str(build / 'robot_posix'))}"
    if way == HOST:
        return ["link=firmware", program, *chosen]
    deploy = f'make -s -C firmware POLICY="$POLICY_FOLDER" BUILD={shlex.quote(str(build))}'
    return ["link=firmware", program, f"link.deploy={text(deploy)}", "link.on_board=true", *chosen]


def learned(robot: Hidden, way: str, folder: Path, updates: int) -> dict[str, Any]:
    """What `twbal iterate` comes to in `folder`."""
    build, before = (folder / "firmware").absolute(), folder.parent / VIRTUAL / "run" / "simulation"
    if way != VIRTUAL and not (folder / "run" / "summary.json").exists():
        subprocess.run(["make", "-s", "-C", "firmware", f"BUILD={build}"], check=True)
        shutil.copytree(before, folder / "run" / "simulation", dirs_exist_ok=True)
    summary = iterate(folder / "run", [*words(robot, way, build), f"updates={updates}"])
    rules = Workshop(FAMILIES[robot.family]).rules
    iterations = iteration_records(folder / "run", summary, rules)
    headers = sorted((folder / "run").glob("iteration_*/*/on_board/policy.h"))
    return {
        "iterations": [
            {**{name: each[name] for name in _KEPT}, "farthest": _farthest(each["trials"])} for each in iterations
        ],
        "on_board": [header.parent.parent.relative_to(folder / "run").as_posix() for header in headers],
        "same": _same(folder / "run", folder.parent / VIRTUAL / "run"),
    }


def _farthest(trials: Sequence[Mapping[str, Any]]) -> float | None:
    """The farthest place of the trials that succeed [m]."""
    return max((trial["farthest"] for trial in trials if trial["default"]["succeeded"]), default=None)


def _same(run: Path, virtual: Path) -> dict[str, list[int]]:
    """How many artefacts of a run are those over the virtual robot, and of how many: all, and policies alone."""
    mine, others = _hashes(run), _hashes(virtual)
    kinds = {"artefacts": list(mine), "policies": [path for path in mine if path.endswith("policy.pt")]}
    return {kind: [sum(mine[path] == others.get(path) for path in paths), len(paths)] for kind, paths in kinds.items()}


def _hashes(run: Path) -> dict[str, str]:
    """sha256 by path within the run folder."""
    lines = (run / "artefacts.sha256").read_text().splitlines()
    return {path: sha256 for sha256, path in (line.split("  ", 1) for line in lines)}


def main(given: Sequence[str]) -> None:
    """Run with settings of the form key=value."""
    settings = text_settings(DEFAULTS, given)
    found: dict[str, Any] = json.loads(TARGET.read_text()) if TARGET.exists() else {}
    for name in settings["robots"].split(","):
        for way in WAYS:
            made = learned(hidden(name), way, ROOT / name / way, int(settings["updates"]))
            found.setdefault(name, {})[way] = made
            write_atomically(TARGET, json.dumps(found, indent=1) + "\n")
            print(f"{name} {way}: {[each['successes'] for each in made['iterations']]} successes by update", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
