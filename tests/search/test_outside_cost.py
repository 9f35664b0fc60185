"""A cost from outside the package: the example of CONTRIBUTING.md, in every place that takes a cost."""

import importlib
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_search import START, balancing

from twbal.core.cost import SaturatingCost
from twbal.core.errors import ConfigError
from twbal.core.gaussian import Gaussian
from twbal.models.moments.truncation import Truncation
from twbal.search.long_term_cost import long_term_cost
from twbal.search.particles import ParticleObjective
from twbal.search.sampled_rollouts import Draws, Limits, sampled_rollouts
from twbal.search.torch_robots import Robots
from twbal.search.transition import transition_model

ROOT = Path(__file__).resolve().parents[2]
BLOCKS = re.findall(
    r"^```(py|python|yaml)\n(.*?)^```", (ROOT / "CONTRIBUTING.md").read_text(), re.DOTALL | re.MULTILINE
)
COST, TEST, CHOICE = (
    next(text for kind, text in BLOCKS if kind == wanted and "SeparateCost" in text)
    for wanted in ("python", "py", "yaml")
)
WIDTHS = np.array([0.25, 2.5, 1.0, np.inf])


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "my_cost.py").write_text(COST)
    return tmp_path


@pytest.fixture
def SeparateCost(folder, monkeypatch):
    monkeypatch.syspath_prepend(str(folder))
    yield importlib.import_module("my_cost").SeparateCost
    del sys.modules["my_cost"]


@pytest.fixture(scope="module")
def model(make_system):
    return make_system(1, g=0.01, samples=80)[0]


@pytest.fixture(scope="module")
def policy(model):
    return balancing(model)


def test_the_test_of_the_example_passes(SeparateCost):
    names = {}
    exec(TEST.replace("twbal.core.separate_cost", "my_cost"), names)
    (test,) = (value for name, value in names.items() if name.startswith("test_"))
    test()


def test_its_derivatives_equal_finite_differences(SeparateCost):
    cost, rng = SeparateCost(np.zeros(4), WIDTHS), np.random.default_rng(1)
    root = 0.2 * rng.standard_normal((4, 4))
    state, by = Gaussian(0.2 * rng.standard_normal(4), root @ root.T), 1e-5 * rng.standard_normal((5, 4))
    found, turn = cost.expected(state), by[1:] + by[1:].T
    ends = [cost.expected(Gaussian(state.mean + s * by[0], state.covariance)).value for s in (1, -1)]
    assert found.by_mean @ by[0] == pytest.approx((ends[0] - ends[1]) / 2, rel=1e-6)
    ends = [cost.expected(Gaussian(state.mean, state.covariance + s * turn)).value for s in (1, -1)]
    assert (found.by_covariance * turn).sum() == pytest.approx((ends[0] - ends[1]) / 2, rel=1e-6)


@pytest.mark.slow  # compiles anew
@pytest.mark.parametrize("way", ["moment matching", "particles"])
def test_the_search_follows_its_gradient(way, SeparateCost, model, policy):
    cost = SeparateCost(np.zeros(4), WIDTHS)

    def found(candidate):
        if way == "particles":
            return ParticleObjective(model, cost, START, 10, 20, 50, 0, 0.0).cost_of(candidate, gradient=True)
        return long_term_cost(transition_model(model), candidate, cost, START, 10, Truncation())

    along = 1e-5 * policy.gain
    ends = [found(replace(policy, gain=policy.gain + s * along)).value for s in (1, -1)]
    assert found(policy).gradient.gain @ along == pytest.approx((ends[0] - ends[1]) / 2, rel=1e-4)


def test_a_cost_that_numba_cannot_compile_is_one_clear_error(model, policy):
    class Mistyped(SaturatingCost):
        def expected_at(self, mean, covariance):
            return self.mistyped

    cost = Mistyped(np.zeros(4), WIDTHS)
    with pytest.raises(ConfigError, match=r"Method 'expected_at' of Mistyped \(.*'mistyped'"):
        ParticleObjective(model, cost, START, 10, 20, 50, 0, 0.0).cost_of(policy, gradient=True)


@pytest.mark.slow  # compiles anew
def test_sampled_robots_pay_it(SeparateCost, model, policy):
    cost, rng = SeparateCost(np.zeros(4), WIDTHS), np.random.default_rng(2)
    draws = Draws(START.sample(5, rng), np.zeros((30, 5, 4)), np.zeros((30, 5, 3)))
    limits = Limits(0, 0.5, 0.5, 0)
    alone = replace(model, g=None)
    compiled = sampled_rollouts(alone, None, policy, cost, limits, draws)
    plain = Robots.of(alone, None, draws).balanced(policy.command, cost, limits)
    np.testing.assert_allclose(compiled.costs, plain.costs, rtol=1e-9)


@pytest.mark.slow
def test_a_command_takes_it_from_a_folder_of_choices(folder):
    (folder / "cost").mkdir()
    choice = CHOICE.partition("\n")[2].replace("twbal.core.separate_cost", "my_cost")
    (folder / "cost" / "separate.yaml").write_text(re.sub("^  ", "", choice, flags=re.MULTILINE))
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(folder), str(ROOT)])}
    done = subprocess.run(
        [sys.executable, "-m", "twbal", "lqr", f"--config-dir={folder}", "cost=separate", "hydra.run.dir=out"],
        cwd=folder,
        env=environment,
        capture_output=True,
    )
    assert done.returncode == 0, done.stderr.decode()
    assert (folder / "out" / "policy.pt").exists()
