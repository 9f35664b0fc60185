"""Real training of real agents, very small."""

import tempfile

import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="comes with the extra [rl]")

from twbal.cli.environment_config import make
from twbal.core.errors import ConfigError
from twbal.environment.agent import AgentRecipe
from twbal.environment.agent_training import policy_of, train

SCALES = {"tilt": 0.25, "tilt_rate": 2.5, "speed": 1.0, "position": 0.5, "position_integral": 0.5}
SMALL = {
    "PPO": {"n_steps": 32, "batch_size": 16, "n_epochs": 2, "learning_rate": 0.01},
    "SAC": {"learning_starts": 20, "batch_size": 16, "buffer_size": 1000, "learning_rate": 0.01},
}


@pytest.fixture
def env():
    with make(["success.duration=0.6", "success.settle_time=0.2", "success.place_time=0"]) as env:
        yield env


def recipe(algorithm, activation="tanh", **options):
    return AgentRecipe(algorithm, [16, 8], activation, SCALES, {**SMALL[algorithm], **options})


@pytest.mark.parametrize("activation", ["tanh", "relu"])
@pytest.mark.parametrize("algorithm", ["PPO", "SAC"])
def test_the_policy_commands_what_the_network_does(env, algorithm, activation):
    chosen = recipe(algorithm, activation)
    agent = train(env, chosen, 64, 0, lambda steps, mean_return: None)
    policy = policy_of(agent, env, chosen)
    spread = np.array([0.3, 3.0, 2.0, 20.0, 20.0, 0.5, 0.5])
    states = np.vstack([w * np.random.default_rng(0).normal(size=(200, 7)) * spread for w in (0.1, 1.0, 10.0)])
    seen = (states / [0.25, 2.5, 1.0, 20.0, 20.0, 0.5, 0.5]).astype(np.float32)
    actions = agent.predict(seen, deterministic=True)[0][:, 0]
    assert np.abs(policy.command(states) / 20.0 - actions).max() < 1e-6
    assert np.ptp(actions) > 0.05  # else nothing was compared


@pytest.mark.parametrize("algorithm", ["PPO", "SAC"])
def test_the_same_seed_trains_the_same_agent_and_another_one_another(algorithm):
    def trained(seed):
        with make(["success.duration=0.6", "success.settle_time=0.2", "success.place_time=0"]) as env:
            chosen = recipe(algorithm)
            return policy_of(train(env, chosen, 64, seed, lambda steps, mean_return: None), env, chosen)

    first, again, other = trained(1), trained(1), trained(2)
    assert all(map(np.array_equal, first.weights, again.weights))
    assert not np.array_equal(first.weights[0], other.weights[0])


def test_progress_is_told_step_by_step(env):
    reported = []
    train(env, recipe("PPO"), 64, 0, lambda steps, mean_return: reported.append((steps, mean_return)))
    assert [steps for steps, _ in reported] == list(range(1, 65))
    assert reported[0][1] is None
    assert 0 < reported[-1][1] <= 30


def test_options_that_the_algorithm_does_not_take_are_refused(env):
    with pytest.raises(ConfigError, match=r"PPO of Stable-Baselines3 does not take agent\.options: .*'n_stepz'"):
        train(env, recipe("PPO", n_stepz=3), 64, 0, lambda steps, mean_return: None)


def test_training_leaves_no_temporary_files(env, tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    train(env, recipe("PPO"), 32, 0, lambda steps, mean_return: None)
    assert not list(tmp_path.iterdir())
