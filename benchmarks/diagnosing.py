"""`twbal diagnose` on recordings of hidden robots, in processes of its own."""

import json
import os
import subprocess
import sys
import tempfile
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
        subprocess.run(command, check=True, capture_output=True, env=_one_thread(), cwd=code)
    found: Mapping[str, Any] = json.loads(file.read_text())
    return found


def timed_diagnosis(name: str, words: Sequence[str], out: Path, code: Path | None = None) -> None:
    """Run the command once, and note its CPU time, and how it failed if it did, in `out`/cpu.json.

    Args:
        name: printed before the first line that the command says.
        words: its settings, but for the folder.
        out: its folder.
        code: folder of the twbal that diagnoses; None: this one.
    """
    command = [sys.executable, "-m", "twbal", "diagnose", *words, f"hydra.run.dir={out}"]
    with tempfile.TemporaryFile("w+") as said:
        process = subprocess.Popen(command, stdout=said, stderr=said, env=_one_thread(), cwd=code)
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        said.seek(0)
        text = said.read()
    out.mkdir(parents=True, exist_ok=True)
    note = {"cpu_s": used.ru_utime + used.ru_stime, "failed": text[-500:] if process.returncode else ""}
    (out / "cpu.json").write_text(json.dumps(note))
    print(name, next((line for line in text.splitlines() if not line.startswith(" ")), ""), flush=True)


def _one_thread() -> dict[str, str]:
    """The surroundings of a process that computes in one thread."""
    return {**os.environ, "OMP_NUM_THREADS": "1"}
