"""`twbal diagnose` on recordings of hidden robots, in processes of its own."""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.measure import version_of
from benchmarks.other_robots.sets import Set

_NOTE, _VERSION = "cpu.json", "version.json"
_STOPPED = 130  # exit code of a twbal that Ctrl-C ended


class Version(NamedTuple):
    """What made a diagnosis.

    Attributes:
        commit: of the code.
        words: further settings of the command, which are the same for all robots.
    """

    commit: str
    words: tuple[str, ...]

    def record(self) -> dict[str, Any]:
        """As JSON has it."""
        return {"commit": self.commit, "words": list(self.words)}


def diagnosis_of(
    each: Set, recordings: Sequence[Path], out: Path, code: Path, words: Sequence[str] = ()
) -> Mapping[str, Any]:
    """The diagnosis of recordings together; from its file, where the same version made it before.

    Args:
        each: the set of the robot.
        recordings: folders of them.
        out: folder of the diagnosis.
        code: folder of the twbal that diagnoses.
        words: further settings of the command.

    Raises:
        SystemExit: another version made it.
    """
    file, version = out / "diagnosis.json", Version(version_of(code), tuple(words))
    if file.exists():
        if version_in([out], _VERSION) != version:
            raise SystemExit(f"{out} was made by another version than {version.record()}: remove it, or change root=.")
    else:
        episodes = ",".join(str(recording.resolve()) for recording in recordings)
        command = [sys.executable, "-m", "twbal", "diagnose", f"episodes=[{episodes}]", *words]
        command += [f"hydra.run.dir={out.resolve()}", f"robot={each.sheet}"]
        command += [f"robot.control_period={1.0 / each.rate}", f"diagnosis.tolerances.data_sheet={each.tolerance}"]
        subprocess.run(command, check=True, capture_output=True, env=_one_thread(), cwd=code)
        (out / _VERSION).write_text(json.dumps(version.record()))
    found: Mapping[str, Any] = json.loads(file.read_text())
    return found


def timed_diagnosis(
    name: str, words: Sequence[str], out: Path, code: Path | None = None, further: Sequence[str] = ()
) -> None:
    """Run the command once; note its CPU time, its version, and how it failed if it did, in `out`/cpu.json.

    Args:
        name: printed before the first line that the command says.
        words: its settings for this robot, but for the folder.
        out: its folder.
        code: folder of the twbal that diagnoses; None: this one.
        further: settings that are the same for all robots.

    Raises:
        KeyboardInterrupt: it was stopped, by Ctrl-C or a signal; nothing is noted.
    """
    command = [sys.executable, "-m", "twbal", "diagnose", *words, *further, f"hydra.run.dir={out}"]
    version = Version(version_of(code or Path()), tuple(further))
    with tempfile.TemporaryFile("w+") as said:
        process = subprocess.Popen(command, stdout=said, stderr=said, env=_one_thread(), cwd=code)
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        said.seek(0)
        text = said.read()
    if process.returncode < 0 or process.returncode == _STOPPED:
        raise KeyboardInterrupt(f"the diagnosis of {name} was stopped (exit code {process.returncode})")
    out.mkdir(parents=True, exist_ok=True)
    note = {"cpu_s": used.ru_utime + used.ru_stime, "failed": text[-500:] if process.returncode else ""}
    note |= {"returncode": process.returncode, **version.record()}
    (out / _NOTE).write_text(json.dumps(note))
    print(name, next((line for line in text.splitlines() if not line.startswith(" ")), ""), flush=True)


def version_in(folders: Iterable[Path], name: str = _NOTE) -> Version:
    """The version that made the diagnoses in some folders; its commit is "unknown" where their notes have none.

    Args:
        folders: of the diagnoses.
        name: of the notes in them.

    Raises:
        SystemExit: several versions made them, or there are none.
    """
    made: dict[Version, list[Path]] = {}
    for folder in folders:
        file = folder / name
        note = json.loads(file.read_text()) if file.exists() else {}
        made.setdefault(Version(note.get("commit", "unknown"), tuple(note.get("words", ()))), []).append(folder)
    if not made:
        raise SystemExit("There is no diagnosis here.")
    if len(made) > 1:
        found = "".join(f"\n{v.commit} {' '.join(v.words)}: {', '.join(map(str, made[v]))}" for v in made)
        raise SystemExit(f"The diagnoses must be of one version; found {len(made)}:{found}")
    return next(iter(made))


def _one_thread() -> dict[str, str]:
    """The surroundings of a process that computes in one thread."""
    return {**os.environ, "OMP_NUM_THREADS": "1"}
