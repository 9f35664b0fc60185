"""Threads and processes of a program that uses the library: the same numbers, and one program that drives the robot."""

import os
import subprocess
import sys

import pytest
import scipy.linalg  # noqa: F401  the tests count its BLAS, too
import threadpoolctl
import torch

import twbal
from twbal.core.threads import THREADS, OneThread, one_thread
from twbal.policies.policy import Policy

FIT = """
import hashlib
import twbal
import numpy as np
from twbal.models.fit import fit_gp
from twbal.models.fit_settings import FitSettings
rng = np.random.default_rng(1)
inputs = rng.standard_normal((120, 6))
targets = np.column_stack([np.sin(inputs[:, 0]), inputs[:, 1], inputs[:, 2] * inputs[:, 3]])
targets += 0.05 * rng.standard_normal(targets.shape)
gp = fit_gp(inputs, targets, FitSettings(2, 1.0, 60, 1, 20, 1000.0, 100.0), 0).gp
print(hashlib.sha256(gp.weights.tobytes() + gp.length_scales.tobytes()).hexdigest())
"""


def printed(code, **environment):
    """What a program prints in which the numbers of threads are these alone."""
    free = {name: value for name, value in os.environ.items() if name not in THREADS}
    words = [sys.executable, "-c", code]
    return subprocess.run(words, capture_output=True, text=True, check=True, env={**free, **environment}).stdout


def test_a_program_that_says_nothing_of_threads_gets_the_numbers_of_one():
    """As a command does; on a machine of one core both are the same anyway."""
    assert printed(FIT) == printed(FIT, **dict.fromkeys(THREADS, "1"))


def test_the_number_of_threads_that_the_person_gave_stays():
    code = "import os, twbal; print([os.environ[name] for name in ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS')])"
    assert printed(code, OMP_NUM_THREADS="3") == "['3', '1']\n"


class Looking(Policy):
    """Notes how many threads compute while it drives."""

    def __init__(self):
        self.seen = []

    def controller(self, rng):
        self.seen.append((blas(), torch.get_num_threads()))
        return lambda state: 0.0


def blas():
    return {each["num_threads"] for each in threadpoolctl.threadpool_info() if each["user_api"] == "blas"}


@pytest.fixture
def two_threads(monkeypatch):
    """A program that loaded numpy and PyTorch before, with two threads each."""
    for name in THREADS:
        monkeypatch.setenv(name, "1")
    before = torch.get_num_threads()
    torch.set_num_threads(2)
    with threadpoolctl.threadpool_limits(2, "blas"):
        yield
    torch.set_num_threads(before)


def test_libraries_that_were_loaded_before_compute_by_one_thread_while_the_library_does(two_threads):
    policy = Looking()
    twbal.simulate(policy=policy, steps=2)
    assert policy.seen == [({1}, 1)]
    assert (blas(), torch.get_num_threads()) == ({2}, 2)


def test_a_number_of_threads_in_the_environment_is_not_overruled(two_threads, monkeypatch):
    for name in THREADS:
        monkeypatch.setenv(name, "2")
    policy = Looking()
    twbal.simulate(policy=policy, steps=2)
    assert policy.seen == [({2}, 2)]


def test_threads_are_given_back_when_the_last_function_has_ended_also_by_an_error(two_threads):
    other = OneThread()
    with pytest.raises(ZeroDivisionError), one_thread:
        with one_thread:
            pass
        assert blas() == {1}
        raise ZeroDivisionError
    assert (blas(), torch.get_num_threads()) == ({2}, 2)
    with other:
        assert blas() == {1}
    assert blas() == {2}


SPAWNED = """
import multiprocessing
import twbal

class Still:
    def controller(self, rng):
        return lambda state: 0.0

if __name__ == "__main__":
    process = multiprocessing.get_context("spawn").Process(target=print, args=("worked",))
    process.start()
    process.join()
else:
    (episode,) = twbal.simulate(policy=Still(), steps=3)
    for drive in (twbal.connect, lambda: twbal.learn(None), lambda: twbal.evaluate(Still(), plant=3)):
        try:
            drive()
        except SystemExit as end:
            print(end)
"""


def test_a_process_that_reads_the_main_module_of_a_program_drives_no_robot_of_it(tmp_path):
    """Whoever started it; what drives no robot is done."""
    script = tmp_path / "script.py"
    script.write_text(SPAWNED)
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=True)
    *ended, last = done.stdout.splitlines()
    assert last == "worked"
    assert len(ended) == 3
    assert all("read its main module, which does its work as it is read" in line for line in ended)
