"""Algorithm 1 over the firmware's program: what it does over the virtual robot, its policies here or on board."""

import subprocess
import sys

import numpy as np
import pytest
from building import FIRMWARE, make, needs_compiler
from small_run import OVERRIDES, STEPS, listed_hashes

from twbal.embedded.header import identity_in
from twbal.io.logs import read_episode

pytestmark = [needs_compiler, pytest.mark.slow]


def learned(folder, *words):
    """The run folder of a small run, which a process of its own makes as a person would."""
    command = [sys.executable, "-m", "twbal", "iterate", *OVERRIDES, *words, f"hydra.run.dir={folder}"]
    said = subprocess.run(command, capture_output=True, text=True, cwd=folder.parent)
    assert said.returncode == 0, said.stderr
    return folder, said.stdout


def on_firmware(folder):
    """Words that choose the program in a folder of its own."""
    make("all", folder=folder)
    return ["link=firmware", f"link.program='{folder / 'robot_posix'}'"]


@pytest.fixture(scope="module")
def over_the_virtual_robot(tmp_path_factory):
    return learned(tmp_path_factory.mktemp("virtual") / "run")[0]


def test_with_the_policy_here_every_artefact_is_the_same(over_the_virtual_robot, tmp_path):
    run, _ = learned(tmp_path / "run", *on_firmware(tmp_path / "build"))
    expected = listed_hashes(over_the_virtual_robot)
    assert len(expected) > STEPS
    assert listed_hashes(run) == expected


def test_with_the_policy_on_board_each_policy_is_driven_by_the_board(over_the_virtual_robot, tmp_path):
    build = tmp_path / "build"
    deploy = f"link.deploy='make -s -C {FIRMWARE} BUILD={build} POLICY=$POLICY_FOLDER'"
    run, said = learned(tmp_path / "run", *on_firmware(build), deploy, "link.on_board=true")
    headers = sorted(run.glob("iteration_*/*/on_board/policy.h"))
    assert [header.parent.parent.relative_to(run).as_posix() for header in headers] == [
        "iteration_0/trials",
        "iteration_1/trials",
    ]
    assert said.count("on board: make") == 2
    assert said.count("commands come from here") == 1
    assert len({identity_in(header.read_text()) for header in headers}) == 2
    learned_from = listed_hashes(over_the_virtual_robot)
    for path, sha256 in listed_hashes(run).items():
        if "/trials/" not in path:  # what is learned, and learned from, has nothing of single precision in it
            assert learned_from[path] == sha256, path
    for name in ("iteration_0", "iteration_1"):
        _check_same_drive_in_single_precision(run / name, over_the_virtual_robot / name)


def _check_same_drive_in_single_precision(*iterations):
    on_board, here = ([read_episode(path) for path in sorted(each.glob("trials/*/*.mcap"))] for each in iterations)
    assert len(on_board) == len(here) == 2
    for one, other in zip(on_board, here, strict=True):
        n = min(len(one.commands), 10)  # a robot that falls lets small differences grow
        np.testing.assert_allclose(one.commands[:n], other.commands[:n], atol=1e-3)
        assert np.any(one.commands[:n] != other.commands[:n])
