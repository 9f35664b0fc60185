"""Tasks on all cores: in order, the same on any number of cores, and with their errors."""

import os
import threading

import numpy as np
import pytest

from twbal.core.threads import in_threads, made_once
from twbal.models.fit import fit_gp
from twbal.models.fit_settings import FitSettings

VALUES = {"starts": 2, "screening_points": 20, "finalists": 1, "iterations": 30, "perturbation": 0.5}
VALUES |= {"max_relative_length_scale": 100.0, "max_signal_to_noise": 1000.0}


def test_results_come_in_the_order_of_the_tasks_whichever_is_done_first(monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    done = [threading.Event() for _ in range(2)]

    def work(number):
        if number == 0:
            assert done[1].wait(10.0)
        done[number].set()
        return number

    assert in_threads(work, [0, 1]) == [0, 1]


def test_an_error_of_a_task_is_that_of_all():
    with pytest.raises(ZeroDivisionError):
        in_threads(lambda number: 1 / number, [1, 0])


def test_threads_that_ask_at_the_same_time_get_one_and_the_same():
    """As the classes for which kernels are compiled must be: for another one, each would be compiled again."""
    asking, made = threading.Barrier(2), []

    @made_once
    def make(name):
        made.append(name)
        threading.Event().wait(0.1)  # in which another thread asks
        return object()

    def ask(name):
        asking.wait(10.0)
        return make(name)

    first, second = in_threads(ask, ["a", "a"], 2)
    assert first is second
    assert made == ["a"]


def test_a_fit_is_the_same_on_any_number_of_cores(monkeypatch):
    rng = np.random.default_rng(0)
    inputs = rng.standard_normal((40, 3))
    targets = np.stack([np.sin(inputs[:, 0]), inputs[:, 1] ** 2, inputs.sum(axis=1)], axis=1)
    targets += 0.05 * rng.standard_normal(targets.shape)
    found = []
    for cores in (1, 3):
        monkeypatch.setattr(os, "cpu_count", lambda cores=cores: cores)
        found.append(fit_gp(inputs, targets, FitSettings(**VALUES), seed=0))
    one, three = found
    for name in ("length_scales", "signal_variance", "noise_variance"):
        np.testing.assert_array_equal(getattr(one.gp, name), getattr(three.gp, name))
