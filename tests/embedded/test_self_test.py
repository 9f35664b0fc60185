"""The self-test passes where the header is right, in C and in C++, and fails where it is not."""

import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest
from some_policies import COMPILER, POLICIES, exported, needs_compiler, widths_of

from twbal.core.channels import Channels
from twbal.core.errors import DataError
from twbal.embedded import board_export
from twbal.embedded.header import header
from twbal.embedded.self_test import PROGRAM, vectors

CXX = shutil.which("g++") or shutil.which("c++")
STRICT = ("-O2", "-Wall", "-Wextra", "-Wconversion", "-Wpedantic", "-Werror")
LANGUAGES = {"c": (COMPILER, "-std=c99"), "c++": (CXX, "-std=c++17", "-fno-exceptions", "-fno-rtti", "-x", "c++")}


def built(folder, policy, robot, language="c", spoil=lambda text: text):
    made = exported(policy, robot)
    (folder / "policy.h").write_text(spoil(header(made)))
    (folder / "policy_vectors.h").write_text(vectors(made, widths_of(policy, robot), np.random.default_rng(3)))
    (folder / "policy_selftest.c").write_text(PROGRAM)
    words = [*LANGUAGES[language], *STRICT, "-o", folder / "selftest", folder / "policy_selftest.c", "-lm"]
    subprocess.run(words, check=True)
    return subprocess.run([folder / "selftest"], capture_output=True, text=True)


@needs_compiler
@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("name", ["searched", "friction", "linear", "tanh"])
def test_it_passes_without_a_warning(name, language, paper, tmp_path):
    if LANGUAGES[language][0] is None:
        pytest.skip("there is no C++ compiler")
    done = built(tmp_path, POLICIES[name], paper, language)
    assert done.returncode == 0
    assert done.stdout == "48 commands and 24 instants of a rollout: 0 wrong\n"


@needs_compiler
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("a += TWBAL_READ(twbal_policy_gain[i]) * x[i];", "a += 1.001f * TWBAL_READ(twbal_policy_gain[i]) * x[i];"),
        ("memory->commands[0]; /* command_1 */", "memory->commands[1]; /* command_1 */"),
        ("speed - asked->speed", "1.001f * speed - asked->speed"),
        ("memory->integral + seen->duration", "memory->integral + 1.01f * seen->duration"),
    ],
)
def test_it_fails_where_the_header_is_wrong(right, wrong, paper, tmp_path):
    def spoil(text):
        assert right in text
        return text.replace(right, wrong)

    assert built(tmp_path, POLICIES["place"], paper, spoil=spoil).returncode == 1


@needs_compiler
@pytest.mark.parametrize("name", ["日本/x", "what??!", "two\nlines", 'a "b" \\', "ends in */"])
def test_any_name_of_a_robot_compiles(name, paper, tmp_path):
    assert built(tmp_path, POLICIES["linear"], replace(paper, name=name)).returncode == 0


@needs_compiler
def test_a_header_that_is_not_the_policy_is_not_written(paper, tmp_path, monkeypatch):
    policy = POLICIES["place"]
    monkeypatch.setattr(board_export, "header", lambda made: header(made).replace("a += TWBAL", "a += 1.01f * TWBAL"))
    channels = Channels(tuple(policy.channels), paper.wheel_radius, paper.control_period)
    with pytest.raises(DataError, match="The compiled header is not the policy"):
        board_export.export_to(tmp_path, policy, channels, paper, 0.5, "a test", np.random.default_rng(3), checked=200)
    assert list(tmp_path.iterdir()) == []
