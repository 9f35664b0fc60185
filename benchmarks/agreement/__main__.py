"""Four recordings of a hidden robot, of which one may be of a robot that was changed.

`python -m benchmarks.agreement [seeds=3000-3009] [root=outputs/bench/agreement] [code=.] [results=...]`: each
robot of the stratum `single 1/4` of `benchmarks.other_robots`, with ideal sensors, is recorded four times for 10 s. The
last recording is made four times: of the same robot, of one with a heavier body, of one with a weaker battery, and on
another floor. Each four are diagnosed together. What is there already is not done again.
"""

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.agreement.tables import agreement
from benchmarks.diagnosing import diagnosis_of
from benchmarks.other_robots.__main__ import sheet_of
from benchmarks.other_robots.mechanics import GRAVITY, Machine
from benchmarks.other_robots.recording import driven
from benchmarks.other_robots.robots import torque_unit
from benchmarks.other_robots.sets import designed
from benchmarks.settings import text_settings
from benchmarks.what_next.recording import again
from twbal.core.robot_parameters import RobotParameters

DEFAULTS = {
    "seeds": "3000-3009",
    "root": "outputs/bench/agreement",
    "code": ".",
    "results": "benchmarks/results/agreement.json",
}
_LOGS = 4
_WORDS = ("diagnosis.tempered_search=false", "diagnosis.max_effects=3", "next_experiment=false")


def _heavier(robot: Machine, sheet: RobotParameters) -> Machine:
    mass = 1.3 * robot.mass
    return robot._replace(mass=mass, load=robot.load + (mass - robot.mass) * GRAVITY)


def _weaker(robot: Machine, sheet: RobotParameters) -> Machine:
    return robot._replace(gain=0.75 * robot.gain)


def _on_a_carpet(robot: Machine, sheet: RobotParameters) -> Machine:
    return robot._replace(ground_kinetic=robot.ground_kinetic + 0.3 * torque_unit(sheet))


CHANGES: Mapping[str, Callable[[Machine, RobotParameters], Machine]] = {
    "nothing": lambda robot, sheet: robot,
    "body 1.3 times as heavy": _heavier,
    "motors 0.75 times as strong": _weaker,
    "a floor with rolling resistance": _on_a_carpet,
}


def disagreements_of(seed: int, root: Path, code: Path) -> list[dict[str, Any]]:
    """What the diagnoses of a robot's four recordings say of the last one, for each change."""
    each = designed("single 1/4", seed)._replace(excitation="E", sensors="ideal")
    sheet, folder = sheet_of(each), root / each.name
    recorded, rows = driven(each, sheet), []
    for number, (change, changed) in enumerate(CHANGES.items()):
        out, up = folder / f"diagnosis_{number}", 0.0
        logs = [folder / f"log_{k}" for k in range(_LOGS - 1)] + [folder / f"last_{number}"]
        for k, log in enumerate(logs):
            robot = changed(recorded.robot, sheet) if k == _LOGS - 1 else recorded.robot
            up = again(each, sheet, recorded._replace(robot=robot), 30 + k, log)
        found = diagnosis_of(each, logs, out, code, _WORDS)
        said = [[d["recording"], d["parameter"], d["p_value"], d["alike"]] for d in found["disagreements"]]
        rows.append({"seed": seed, "hidden": sorted(recorded.hidden), "change": change, "seconds_up": up})
        rows[-1] |= {"verdict": found["verdict"], "odd": logs[-1].name, "disagreements": said}
    return rows


def main(words: Sequence[str]) -> None:
    """Record, diagnose, and write the results."""
    settings = text_settings(DEFAULTS, words)
    first, last = map(int, settings["seeds"].split("-"))
    root, code, results = (Path(settings[name]) for name in ("root", "code", "results"))
    rows: list[dict[str, Any]] = []
    for seed in range(first, last + 1):
        rows += disagreements_of(seed, root, code)
        results.write_text('{"sets": [\n' + ",\n".join(map(json.dumps, rows)) + "\n]}\n")
        print(*rows[-len(CHANGES) :], sep="\n", flush=True)
    print("\n".join(agreement({"sets": rows})))


if __name__ == "__main__":
    main(sys.argv[1:])
