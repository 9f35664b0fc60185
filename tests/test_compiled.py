import os
import subprocess
import sys

from twbal.compiled import cache_folder


def folder_seen(**environment):
    """The cache folder of a fresh process."""
    words = [sys.executable, "-c", "from twbal.compiled import numba; print(numba.config.CACHE_DIR)"]
    found = subprocess.run(words, env={**os.environ, **environment}, capture_output=True, text=True, check=True)
    return found.stdout.strip()


def test_machine_code_lies_in_the_persons_cache(tmp_path):
    assert folder_seen(XDG_CACHE_HOME=str(tmp_path)).startswith(f"{tmp_path}/twbal/kernels-")


def test_a_cache_that_the_person_chose_is_used(tmp_path):
    assert folder_seen(NUMBA_CACHE_DIR=str(tmp_path)) == str(tmp_path)


def test_a_home_that_cannot_be_written_to_is_no_obstacle(tmp_path):
    (tmp_path / "file").write_text("")
    assert "kernels-" in folder_seen(XDG_CACHE_HOME=str(tmp_path / "file"))


def test_another_source_is_another_folder(tmp_path, monkeypatch):
    source = tmp_path / "some.py"
    names = []
    for text in ("x = 1", "x = 2"):
        source.write_text(f"from twbal.compiled import kernel\n{text}\n")
        monkeypatch.setattr("twbal.compiled._PACKAGE", tmp_path)
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
        names.append(cache_folder().name)
    assert names[0] != names[1]
