"""One run, three ways to the same bytes: undisturbed, killed on the way, and stage by stage by hand."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from small_run import STEPS, command, listed_hashes

ROOT = Path(__file__).resolve().parents[2]
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("undisturbed") / "run"
    finish(folder)
    return folder


def environment(**more):
    return {**os.environ, "PYTHONPATH": str(ROOT), **more}


def finish(folder):
    done = subprocess.run(command(folder), env=environment(), capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def kill_after(folder, steps, delay):
    """Start the run and kill it, as long after its step number `steps` began as `delay` says [s]."""
    process = subprocess.Popen(command(folder), env=environment(), stdout=subprocess.PIPE, text=True)
    seen = 0
    for line in process.stdout:
        seen += " -> " in line
        if seen == steps:
            break
    time.sleep(delay)
    process.kill()
    process.communicate()
    return process.returncode


# The later, the sooner: after its last steps a run has little left to do, and would be done before it is killed.
@pytest.mark.parametrize(("steps", "delay"), [(step, 0.05 * (STEPS - step)) for step in range(1, STEPS)])
def test_killed_at_any_instant_it_ends_at_the_same_hashes(undisturbed, tmp_path, steps, delay):
    assert kill_after(tmp_path / "run", steps, delay) == -9
    assert not (tmp_path / "run" / "summary.json").exists()
    said = finish(tmp_path / "run")
    assert said.count("is there already") >= steps - 1
    assert listed_hashes(tmp_path / "run") == listed_hashes(undisturbed)


def test_the_commands_by_hand_make_the_same_files(undisturbed, tmp_path):
    program = tmp_path / "bin" / "twbal"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m twbal "$@"\n')
    program.chmod(0o755)
    path = f"{program.parent}{os.pathsep}{os.environ['PATH']}"
    out = tmp_path / "Anna's run ü"
    words = ["sh", str(undisturbed / "commands.sh"), str(out)]
    done = subprocess.run(words, env=environment(PATH=path), cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.splitlines()[-1] == f"The same hashes as in {undisturbed}"


def test_another_seed_gives_other_policies(undisturbed, tmp_path):
    other = [*command(tmp_path / "run"), "seed=1"]
    subprocess.run(other, env=environment(), check=True, capture_output=True)
    assert listed_hashes(tmp_path / "run")["best_policy.pt"] != listed_hashes(undisturbed)["best_policy.pt"]


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="a process is kept on one core on Linux")
def test_on_one_core_all_is_done_by_one_process_and_comes_to_the_same(undisturbed, tmp_path):
    """On several, copies of the process do some of it (`core.copies`)."""
    core = min(os.sched_getaffinity(0))
    alone = [
        sys.executable,
        "-c",
        f"import os, sys; os.sched_setaffinity(0, {{{core}}}); os.execv(sys.argv[1], sys.argv[1:])",
    ]
    subprocess.run([*alone, *command(tmp_path / "run")], env=environment(), check=True, capture_output=True)
    assert listed_hashes(tmp_path / "run") == listed_hashes(undisturbed)
    by_hand = "commands.sh"
    assert (tmp_path / "run" / by_hand).read_text() == (undisturbed / by_hand).read_text()
