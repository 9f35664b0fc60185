"""The robot as an environment: as Gymnasium wants it, and the same robot as everywhere else."""

import os
import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip("gymnasium", reason="comes with the extra [rl]")

import gymnasium
from gymnasium.utils.env_checker import check_env
from hydra import compose
from hydra.utils import instantiate

import twbal.environment  # noqa: F401 (registers)
from twbal.algorithm.rollout import rollout
from twbal.cli.composition import composing
from twbal.cli.environment_config import make
from twbal.cli.simulation_config import simulation_of
from twbal.core.episode import Outcome, Provenance
from twbal.core.errors import ConfigError, DataError
from twbal.policies.policy import Policy

UNBOUNDED = "ignore:.*Box observation space m(in|ax)imum value is -?infinity.*:UserWarning"  # tilt rates are


class Swaying(Policy):
    """Balances for a while, and then no more."""

    def __init__(self, periods):
        self.periods = periods

    def controller(self, rng):
        steps = iter(range(10_000))
        return lambda x: float(np.clip(60 * x[0] + 15 * x[1], -20, 20)) if next(steps) < self.periods else 0.0


def configured(*words):
    with composing():
        return compose("train_agent", list(words))


@pytest.mark.filterwarnings(UNBOUNDED)
@pytest.mark.parametrize("words", [[], ["robot=regbot", "sim=regbot", "state=paper"]], ids=["paper", "regbot"])
def test_gymnasium_finds_no_fault_with_it(words):
    with gymnasium.make("twbal/TwoWheeled-v0", overrides=words) as env:
        check_env(env.unwrapped)


def test_a_shell_makes_it_by_the_name_of_its_module(tmp_path):
    code = "import gymnasium; print(gymnasium.make('twbal.environment:twbal/TwoWheeled-v0').unwrapped.channels.names)"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, env=environment)
    assert done.returncode == 0, done.stderr
    assert "'tilt', 'tilt_rate', 'speed', 'command_1', 'command_2'" in done.stdout


@pytest.mark.parametrize(
    "words", [[], ["+effect@sim.effects.noise=sensor_noise", "state=paper"]], ids=["bare", "noisy"]
)
@pytest.mark.parametrize("periods", [40, 1000])
def test_an_episode_is_the_rollout_of_the_same_trial(words, periods):
    cfg = configured("seed=5", "success.duration=2.4", "success.place_time=2", *words)
    channels, cost, policy = instantiate(cfg.state), instantiate(cfg.cost), Swaying(periods)
    with simulation_of(cfg).plant(5) as plant:
        driven = rollout(
            plant, policy, channels, 120, cfg.success.tilt_limit, Provenance("paper", "simulation", seed=5, trial=3)
        )
    law = policy.controller(np.random.default_rng(0))
    with make(["seed=5", "success.duration=2.4", "success.place_time=2", *words]) as env:
        state, info = env.reset(options={"trial": 3})
        states, rewards, ended = [state], [], False
        while not ended:
            action = np.array([law(state) / env.torque_limit])
            state, reward, terminated, truncated, _ = env.step(action)
            states.append(state)
            rewards.append(reward)
            ended = terminated or truncated
    assert info == {"trial": 3}
    assert np.allclose(states, driven.states, rtol=0, atol=1e-9)  # a command may round differently as a share
    assert rewards == pytest.approx(1.0 - cost(np.array(states[1:])))
    assert (terminated, truncated) == (driven.outcome is Outcome.TILT_LIMIT, len(driven) == 120)
    assert terminated == (periods == 40)


def test_a_seed_decides_all_episodes_after_it():
    def starts(env, seed):
        return [env.reset(seed=seed)[0], *(env.reset()[0] for _ in range(2))]

    with make() as env, make() as other:
        first, again, different = starts(env, 1), starts(other, 1), starts(other, 2)
    assert np.array_equal(first, again)
    assert len(np.unique(np.vstack([first, different]), axis=0)) == 6


def test_an_action_beyond_one_is_the_torque_limit():
    with make() as env:
        env.reset(seed=0)
        state, *_ = env.step(np.array([7.0], dtype=np.float32))
    assert state[3] == env.torque_limit == 20.0


def test_a_picture_shows_how_the_robot_stands():
    with make(render_mode="rgb_array") as env:
        env.reset(options={"trial": 0})
        before, again = env.render(), env.render()
        for _ in range(8):
            env.step(np.array([-1.0]))
        after = env.render()
    assert before.shape == (270, 480, 3)
    assert before.dtype == np.uint8
    assert np.array_equal(before, again)
    assert (before != after).mean() > 0.01
    with make() as env:
        env.reset()
        assert env.render() is None


def test_its_words_are_those_of_the_command_line():
    with make(["robot=regbot", "success.duration=0.105", "success.settle_time=0.075", "success.place_time=0"]) as env:
        env.reset(seed=0)
        assert env.torque_limit == 0.49
        assert [env.step(np.zeros(1))[3] for _ in range(7)] == [False] * 6 + [True]
        assert env.metadata["render_fps"] == 67
    with pytest.raises(ConfigError, match=r"train-agent has no setting 'success\.durations'"):
        make(["success.durations=7"])
    with pytest.raises(ConfigError, match="robot has no choice 'r2d2'"):
        make(["robot=r2d2"])


@pytest.mark.filterwarnings(UNBOUNDED)
@pytest.mark.parametrize("action", [[np.nan], [np.inf], [0.1, 0.2], 0.3])
def test_an_action_that_is_not_one_finite_number_is_refused(action):
    with gymnasium.make("twbal/TwoWheeled-v0") as env:
        env.reset(seed=0)
        with pytest.raises(DataError, match="one finite number"):
            env.unwrapped.step(np.array(action, dtype=np.float32))
