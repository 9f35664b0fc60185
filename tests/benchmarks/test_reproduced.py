"""Whether runs are reproduced by their commands."""

from hashlib import sha256

import pytest

from benchmarks.hidden_robots.reproduced import main, reproduced

COMMANDS = """#!/bin/sh
set -eu
here=$(cd "$(dirname "$0")" && pwd)
OUT=${1:-"$here/by_hand"}
mkdir -p "$OUT"
printf 'made' > "$OUT/log"
cd "$OUT" && sha256sum --check "$here/artefacts.sha256"
"""


@pytest.fixture
def run(tmp_path):
    (tmp_path / "commands.sh").write_text(COMMANDS)
    return tmp_path


def test_commands_that_make_the_same_again_leave_nothing_behind(run):
    (run / "artefacts.sha256").write_text(f"{sha256(b'made').hexdigest()}  log\n")
    assert reproduced(run) == {"artefacts": 1, "same": True}
    assert not (run / "by_hand").exists()


def test_other_artefacts_are_told_with_the_last_words(run):
    (run / "artefacts.sha256").write_text(f"{sha256(b'other').hexdigest()}  log\n")
    found = reproduced(run)
    assert not found["same"]
    assert "log: FAILED" in found["said"]
    assert (run / "by_hand" / "log").read_text() == "made"


@pytest.mark.parametrize("words", [[], ["family=soft"], ["family=hard", "robot=3"]])
def test_settings_that_are_none_are_refused(words):
    with pytest.raises(SystemExit, match="Settings are family"):
        main(words)
