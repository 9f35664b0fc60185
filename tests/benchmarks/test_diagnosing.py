"""Diagnoses in processes of their own: what is noted of them, and which may stand in one record."""

import json
import signal
import sys
from pathlib import Path

import pytest

from benchmarks import diagnosing
from benchmarks.diagnosing import Version, timed_diagnosis, version_in


def run_as(monkeypatch, tmp_path, code):
    """Let a script take the place of the Python that runs twbal."""
    script = tmp_path / "python"
    script.write_text(f"#!{sys.executable}\nimport os, sys\n{code}\n")
    script.chmod(0o755)
    monkeypatch.setattr(diagnosing.sys, "executable", str(script))


@pytest.mark.parametrize(
    "code",
    ["sys.exit(130)", f"os.kill(os.getpid(), {int(signal.SIGTERM)})", f"os.kill(os.getpid(), {int(signal.SIGINT)})"],
)
def test_a_diagnosis_that_was_stopped_is_not_noted_and_so_done_again(code, monkeypatch, tmp_path):
    run_as(monkeypatch, tmp_path, f"import signal; signal.signal(signal.SIGINT, signal.SIG_DFL); {code}")
    with pytest.raises(KeyboardInterrupt, match="set_1"):
        timed_diagnosis("set_1", [], tmp_path / "out")
    assert not (tmp_path / "out" / "cpu.json").exists()


def test_a_diagnosis_that_failed_is_noted_with_its_code_its_words_and_its_version(monkeypatch, tmp_path):
    run_as(monkeypatch, tmp_path, "print('no data'); sys.exit(1)")
    timed_diagnosis("set_1", ["episodes=e"], tmp_path / "out", None, ["diagnosis.max_effects=3"])
    note = json.loads((tmp_path / "out" / "cpu.json").read_text())
    assert (note["returncode"], note["failed"], note["words"]) == (1, "no data\n", ["diagnosis.max_effects=3"])
    assert version_in([tmp_path / "out"]) == Version(note["commit"], ("diagnosis.max_effects=3",))


def made_by(folder: Path, **note: object) -> Path:
    folder.mkdir()
    (folder / "cpu.json").write_text(json.dumps(note))
    return folder


def test_diagnoses_of_several_versions_are_refused_with_their_folders(tmp_path):
    first = made_by(tmp_path / "first", commit="0123abcd", words=[])
    second = made_by(tmp_path / "second", commit="0123abcd", words=["diagnosis.max_effects=3"])
    third = made_by(tmp_path / "third", cpu_s=1.0)
    assert version_in([first, first]) == Version("0123abcd", ())
    for other in (second, third):
        with pytest.raises(SystemExit, match=f"(?s){first}.*{other}"):
            version_in([first, other])
