"""`twbal diagnose` on recordings of one robot."""

import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.other_robots.sets import Set


def diagnosis_of(
    each: Set, recordings: Sequence[Path], out: Path, code: Path, words: Sequence[str] = ()
) -> Mapping[str, Any]:
    """The diagnosis of recordings together; from its file, where it was made before.

    Args:
        each: the set of the robot.
        recordings: folders of them.
        out: folder of the diagnosis.
        code: folder of the twbal that diagnoses.
        words: further settings of the command.
    """
    file = out / "diagnosis.json"
    if not file.exists():
        episodes = ",".join(str(recording.resolve()) for recording in recordings)
        command = [sys.executable, "-m", "twbal", "diagnose", f"episodes=[{episodes}]", *words]
        command += [f"hydra.run.dir={out.resolve()}", f"robot={each.sheet}"]
        command += [f"robot.control_period={1.0 / each.rate}", f"diagnosis.tolerances.data_sheet={each.tolerance}"]
        surroundings = {**os.environ, "OMP_NUM_THREADS": "1"}
        subprocess.run(command, check=True, capture_output=True, env=surroundings, cwd=code)
    found: Mapping[str, Any] = json.loads(file.read_text())
    return found
